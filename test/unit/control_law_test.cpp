// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/autopilot/control_law.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "support/jerk_profile.hpp"
#include "understory/sim/vehicle.hpp"

namespace understory {
namespace {

using test::JerkProfile;
using test::MotionLimits;
using test::straight_leg;
using test::YawProfile;

constexpr double kStepS = 0.002;

VehicleState hovering_at(const Vector3d& position_m) {
  VehicleState state;
  state.position_m = position_m;
  return state;
}

ControlLaw tracking_law(const ControlConfig& config = {}) {
  ControlLaw law(AirframeConfig{}, config);
  law.set_mode(ControlMode::kTrack);
  return law;
}

Vehicle flying_vehicle(const VehicleConfig& config, std::uint64_t seed = 1) {
  Vehicle vehicle(config, {0.0, 0.0, 1.0}, 0.0, Rng(seed));
  vehicle.set_state(hovering_at({0.0, 0.0, 1.0}));
  return vehicle;
}

double total(const MotorCommands& commands) {
  return commands[0] + commands[1] + commands[2] + commands[3];
}

struct TrackingErrors {
  double position_m = 0.0;
  double yaw_rad = 0.0;
  double top_speed_mps = 0.0;
  double rest_m = 0.0;  // one second after the end
};

// Setpoints arrive every `period_s`, as over the bus, and are extrapolated in between.
TrackingErrors fly(const JerkProfile& path, double step_s, double period_s) {
  Vehicle vehicle = flying_vehicle({});
  ControlLaw law = tracking_law();
  YawProfile yaw(0.9, 2.0);
  TrackingErrors errors;
  Setpoint received;
  double received_at_s = -1.0;
  const int steps = static_cast<int>((path.duration_s() + 2.0) / step_s);
  for (int i = 0; i < steps; ++i) {
    const double time_s = i * step_s;
    Setpoint wanted = path.sample(time_s);
    yaw.step(time_s, step_s, wanted);
    if (time_s - received_at_s > period_s - 1e-9) {
      received = wanted;
      received_at_s = time_s;
    }
    const VehicleState& state = vehicle.state();
    errors.rest_m = (state.position_m - wanted.position_m).norm();
    errors.position_m = std::max(errors.position_m, errors.rest_m);
    errors.yaw_rad = std::max(
        errors.yaw_rad, std::abs(angle_difference(yaw_of(state.world_from_body), wanted.yaw_rad)));
    errors.top_speed_mps = std::max(errors.top_speed_mps, state.velocity_mps.norm());
    vehicle.step(law.update(state, extrapolated(received, time_s - received_at_s), step_s), step_s);
  }
  return errors;
}

TEST(ControlLaw, HoverAsksForExactlyTheWeight) {
  const AirframeConfig airframe;
  ControlLaw law = tracking_law();
  Setpoint setpoint;
  setpoint.position_m = {1.0, 2.0, 3.0};

  const MotorCommands commands = law.update(hovering_at({1.0, 2.0, 3.0}), setpoint, kStepS);

  for (const double command : commands) {
    EXPECT_NEAR(command * airframe.max_motor_thrust_n, 0.25 * airframe.mass_kg * 9.81, 1e-12);
  }
}

TEST(ControlLaw, ErrorToTheLeftRaisesTheRightMotors) {
  ControlLaw law = tracking_law();
  Setpoint setpoint;
  setpoint.position_m = {0.0, 0.1, 0.0};

  const MotorCommands commands = law.update(hovering_at(Vector3d::Zero()), setpoint, kStepS);

  EXPECT_GT(commands[1], commands[0]);  // front right above front left
  EXPECT_GT(commands[2], commands[3]);  // rear right above rear left
}

TEST(ControlLaw, YawErrorToTheLeftRaisesTheClockwiseMotorsAndKeepsTheThrust) {
  ControlLaw law = tracking_law();
  const Setpoint level;
  Setpoint turned;
  turned.yaw_rad = 0.02;

  const double hover = total(law.update(hovering_at(Vector3d::Zero()), level, kStepS));
  const MotorCommands commands = law.update(hovering_at(Vector3d::Zero()), turned, kStepS);

  EXPECT_GT(commands[0], commands[1]);
  EXPECT_GT(commands[2], commands[3]);
  EXPECT_NEAR(total(commands), hover, 1e-9);
}

TEST(ControlLaw, CommandsStayBetweenZeroAndOneWhateverTheState) {
  Rng rng(7);
  ControlLaw law = tracking_law();
  for (int i = 0; i < 20000; ++i) {
    VehicleState state;
    Setpoint setpoint;
    for (int axis = 0; axis < 3; ++axis) {
      state.position_m[axis] = rng.uniform(-100.0, 100.0);
      state.velocity_mps[axis] = rng.uniform(-20.0, 20.0);
      state.body_rates_radps[axis] = rng.uniform(-30.0, 30.0);
      setpoint.acceleration_mps2[axis] = rng.uniform(-30.0, 30.0);
    }
    state.world_from_body =
        Eigen::Quaterniond(rng.normal(), rng.normal(), rng.normal(), rng.normal()).normalized();
    setpoint.yaw_rad = rng.uniform(-10.0, 10.0);

    for (const double command : law.update(state, setpoint, kStepS)) {
      ASSERT_GE(command, 0.0) << "draw " << i << " of seed 7";
      ASSERT_LE(command, 1.0) << "draw " << i << " of seed 7";
    }
  }
}

TEST(ControlLaw, FollowsTheExplorersSpeedWithinThreeCentimetres) {
  const MotionLimits limits{1.5, 1.0, 6.0};

  const TrackingErrors errors = fly(straight_leg(limits, {1.0, 0.3, 0.1}), kStepS, kStepS);

  EXPECT_LT(errors.position_m, 0.03);
  EXPECT_LT(errors.yaw_rad, 0.03);
  EXPECT_LT(errors.top_speed_mps, 1.01 * limits.speed_mps);
  EXPECT_LT(errors.rest_m, 0.002);
}

TEST(ControlLaw, FollowsTheCollectorsSpeedWithinThreeCentimetres) {
  const MotionLimits limits{3.0, 2.0, 8.0};

  const TrackingErrors errors = fly(straight_leg(limits, {-0.4, 1.0, -0.05}), kStepS, kStepS);

  EXPECT_LT(errors.position_m, 0.03);
  EXPECT_LT(errors.yaw_rad, 0.03);
  EXPECT_LT(errors.top_speed_mps, 1.01 * limits.speed_mps);
  EXPECT_LT(errors.rest_m, 0.002);
}

TEST(ControlLaw, FollowsSetpointsThatComeAtOneHundredHertz) {
  const MotionLimits limits{3.0, 2.0, 20.0};

  const TrackingErrors errors = fly(straight_leg(limits, {1.0, 0.0, 0.0}), 0.001, 0.01);

  EXPECT_LT(errors.position_m, 0.03);
  EXPECT_LT(errors.yaw_rad, 0.03);
  EXPECT_LT(errors.top_speed_mps, 1.03 * limits.speed_mps);
}

TEST(ControlLaw, FollowsATurnAtFullSpeed) {
  // A circle of 4.5 m at 3 m/s takes 2 m/s2; the reference starts on it in mid-flight.
  const double radius_m = 4.5;
  const double speed_mps = 3.0;
  Vehicle vehicle = flying_vehicle({});
  ControlLaw law = tracking_law();
  VehicleState start = hovering_at({radius_m, 0.0, 1.0});
  start.velocity_mps = {0.0, speed_mps, 0.0};
  start.world_from_body = Eigen::AngleAxisd(0.5 * kPi, Vector3d::UnitZ());
  vehicle.set_state(start);

  double late_error_m = 0.0;
  for (int i = 0; i < 5000; ++i) {
    const double time_s = i * kStepS;
    const double angle_rad = speed_mps / radius_m * time_s;
    const Vector3d outward(std::cos(angle_rad), std::sin(angle_rad), 0.0);
    Setpoint setpoint;
    setpoint.position_m = radius_m * outward + Vector3d(0.0, 0.0, 1.0);
    setpoint.velocity_mps = speed_mps * Vector3d(-outward.y(), outward.x(), 0.0);
    setpoint.acceleration_mps2 = -speed_mps * speed_mps / radius_m * outward;
    setpoint.yaw_rad = angle_rad + 0.5 * kPi;
    setpoint.yaw_rate_radps = speed_mps / radius_m;
    if (time_s > 2.0) {  // the vehicle starts level, so it has to lean into the circle first
      late_error_m =
          std::max(late_error_m, (vehicle.state().position_m - setpoint.position_m).norm());
    }
    vehicle.step(law.update(vehicle.state(), setpoint, kStepS), kStepS);
  }

  EXPECT_LT(late_error_m, 0.03);
}

TEST(ControlLaw, HoversInGustyWindWithinSixCentimetres) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    VehicleConfig config;
    config.wind = {2.4, -1.8, 0.75, 2.0};  // 3 m/s
    Vehicle vehicle = flying_vehicle(config, seed);
    ControlLaw law = tracking_law();
    Setpoint setpoint;
    setpoint.position_m = {0.0, 0.0, 1.0};

    double largest_m = 0.0;
    for (int i = 0; i < 30000; ++i) {
      vehicle.step(law.update(vehicle.state(), setpoint, kStepS), kStepS);
      if (i * kStepS > 3.0) {  // the wind starts at once, which no wind does
        largest_m = std::max(largest_m, (vehicle.state().position_m - setpoint.position_m).norm());
      }
    }

    EXPECT_LT(largest_m, 0.06) << "seed " << seed;
  }
}

TEST(ControlLaw, SteadyWindLeavesNoOffset) {
  VehicleConfig config;
  config.wind.mean_x_mps = 5.0;
  Vehicle vehicle = flying_vehicle(config);
  ControlLaw law = tracking_law();
  Setpoint setpoint;
  setpoint.position_m = {0.0, 0.0, 1.0};

  for (int i = 0; i < 5000; ++i) {
    vehicle.step(law.update(vehicle.state(), setpoint, kStepS), kStepS);
  }

  EXPECT_LT((vehicle.state().position_m - setpoint.position_m).norm(), 0.001);
  EXPECT_LT(vehicle.state().velocity_mps.norm(), 0.001);
}

TEST(ControlLaw, AFarSetpointWindsNothingUpAndTheTiltStaysBounded) {
  const ControlConfig config;
  Vehicle vehicle = flying_vehicle({});
  ControlLaw law = tracking_law(config);
  Setpoint setpoint;
  setpoint.position_m = {40.0, 0.0, 1.0};

  double largest_tilt_rad = 0.0;
  double largest_x_m = 0.0;
  for (int i = 0; i < 15000; ++i) {
    vehicle.step(law.update(vehicle.state(), setpoint, kStepS), kStepS);
    const Vector3d up = vehicle.state().world_from_body * Vector3d::UnitZ();
    largest_tilt_rad = std::max(largest_tilt_rad, std::acos(std::min(1.0, up.z())));
    largest_x_m = std::max(largest_x_m, vehicle.state().position_m.x());
  }

  EXPECT_LT(largest_tilt_rad, config.max_tilt_rad + 0.1);
  EXPECT_NEAR(vehicle.state().position_m.x(), 40.0, 0.02);
  EXPECT_LT(largest_x_m, 48.0);
}

TEST(ControlLaw, StaysStableWhenTheAirframeIsNotAsConfigured) {
  VehicleConfig real;
  real.airframe.mass_kg *= 1.2;
  real.airframe.inertia_xx_kgm2 *= 1.4;
  real.airframe.inertia_yy_kgm2 *= 0.7;
  real.airframe.motor_time_constant_s = 0.045;
  real.airframe.rotor_drag_xy_kgps = 0.0;
  Vehicle vehicle = flying_vehicle(real);
  ControlLaw law = tracking_law();
  Setpoint setpoint;
  setpoint.position_m = {0.5, -0.5, 1.5};
  setpoint.yaw_rad = 1.0;

  for (int i = 0; i < 5000; ++i) {
    vehicle.step(law.update(vehicle.state(), setpoint, kStepS), kStepS);
  }

  EXPECT_LT((vehicle.state().position_m - setpoint.position_m).norm(), 0.005);
  EXPECT_LT(vehicle.state().body_rates_radps.norm(), 0.01);
  EXPECT_NEAR(yaw_of(vehicle.state().world_from_body), 1.0, 0.005);
}

TEST(ControlLaw, TakesOffFromTheGroundHoversAndLandsWithTheMotorsOff) {
  VehicleConfig config;
  Vehicle vehicle(config, {1.0, 2.0, 0.0}, 0.7, Rng(1));
  ControlLaw law(AirframeConfig{}, ControlConfig{});
  ASSERT_TRUE(vehicle.on_ground());
  JerkProfile climb = straight_leg({0.5, 0.5, 2.0}, Vector3d::UnitZ());
  climb.start_m = vehicle.state().position_m;

  law.set_mode(ControlMode::kTrack);
  for (int i = 0; i * kStepS < climb.duration_s() + 1.0; ++i) {
    Setpoint setpoint = climb.sample(i * kStepS);
    setpoint.yaw_rad = 0.7;
    vehicle.step(law.update(vehicle.state(), setpoint, kStepS), kStepS);
  }
  EXPECT_NEAR(vehicle.state().position_m.z(), climb.sample(100.0).position_m.z(), 0.01);
  ASSERT_GT(vehicle.state().position_m.z(), 0.9);

  law.set_mode(ControlMode::kLand);
  double fastest_mps = 0.0;
  int steps = 0;
  for (; steps < 5000 && law.mode() == ControlMode::kLand; ++steps) {
    vehicle.step(law.update(vehicle.state(), {}, kStepS), kStepS);
    fastest_mps = std::max(fastest_mps, -vehicle.state().velocity_mps.z());
  }

  EXPECT_EQ(law.mode(), ControlMode::kIdle);
  EXPECT_TRUE(vehicle.on_ground());
  EXPECT_LT(fastest_mps, 1.25 * ControlConfig{}.landing_rate_mps);
  EXPECT_NEAR(vehicle.state().position_m.x(), 1.0, 0.01);
  EXPECT_NEAR(vehicle.state().position_m.y(), 2.0, 0.01);
  EXPECT_NEAR(yaw_of(vehicle.state().world_from_body), 0.7, 0.01);
  EXPECT_EQ(law.update(vehicle.state(), {}, kStepS), MotorCommands{});
}

TEST(ControlLaw, LandingInMidFlightBrakesAndDoesNotTakeHoverForTheGround) {
  Vehicle vehicle = flying_vehicle({});
  VehicleState fast = hovering_at({0.0, 0.0, 5.0});
  fast.velocity_mps = {3.0, 0.0, 0.5};
  vehicle.set_state(fast);
  ControlLaw law = tracking_law();
  law.set_mode(ControlMode::kLand);

  int steps = 0;
  for (; steps < 20000 && law.mode() == ControlMode::kLand; ++steps) {
    vehicle.step(law.update(vehicle.state(), {}, kStepS), kStepS);
  }

  EXPECT_EQ(law.mode(), ControlMode::kIdle);
  EXPECT_TRUE(vehicle.on_ground());
  EXPECT_LT(vehicle.state().position_m.head<2>().norm(), 2.0);
}

TEST(ControlLaw, IdleKeepsTheMotorsOff) {
  ControlLaw law(AirframeConfig{}, ControlConfig{});
  Setpoint setpoint;
  setpoint.position_m = {0.0, 0.0, 5.0};

  EXPECT_EQ(law.mode(), ControlMode::kIdle);
  EXPECT_EQ(law.update(hovering_at(Vector3d::Zero()), setpoint, kStepS), MotorCommands{});
}

TEST(ControlLaw, SetpointThatIsNotFiniteIsCountedAndTheLastOneHeld) {
  ControlLaw law = tracking_law();
  Vehicle vehicle = flying_vehicle({});
  Setpoint good;
  good.position_m = {0.0, 0.0, 1.0};
  Setpoint bad = good;
  bad.acceleration_mps2.y() = std::numeric_limits<double>::quiet_NaN();

  vehicle.step(law.update(vehicle.state(), good, kStepS), kStepS);
  for (int i = 0; i < 1000; ++i) {
    vehicle.step(law.update(vehicle.state(), bad, kStepS), kStepS);
  }

  EXPECT_EQ(law.rejected_inputs(), 1000U);
  EXPECT_LT((vehicle.state().position_m - good.position_m).norm(), 1e-6);
}

TEST(ControlLaw, StateThatIsNotFiniteIsCountedAndCommandsStayFinite) {
  ControlLaw law = tracking_law();
  VehicleState bad = hovering_at(Vector3d::Zero());
  bad.world_from_body.coeffs().setZero();

  const MotorCommands commands = law.update(bad, {}, kStepS);

  EXPECT_EQ(law.rejected_inputs(), 1U);
  for (const double command : commands) {
    EXPECT_TRUE(std::isfinite(command));
  }
}

TEST(ControlLaw, AirframeThatCannotLiftItselfIsRefused) {
  AirframeConfig heavy;
  heavy.mass_kg = 2.5;

  EXPECT_THROW(ControlLaw(heavy, ControlConfig{}), ConfigError);
}

TEST(ControlLaw, ExtrapolatedSetpointMovesOnWithConstantAcceleration) {
  Setpoint setpoint;
  setpoint.velocity_mps = {2.0, 0.0, 0.0};
  setpoint.acceleration_mps2 = {0.0, 1.0, 0.0};
  setpoint.yaw_rate_radps = 0.5;

  const Setpoint later = extrapolated(setpoint, 0.1);

  EXPECT_NEAR((later.position_m - Vector3d(0.2, 0.005, 0.0)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((later.velocity_mps - Vector3d(2.0, 0.1, 0.0)).norm(), 0.0, 1e-12);
  EXPECT_NEAR(later.yaw_rad, 0.05, 1e-12);
}

}  // namespace
}  // namespace understory
