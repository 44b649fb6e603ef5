// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/vehicle.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace understory {
namespace {

constexpr double kStepS = 0.002;
constexpr double kGravityMps2 = 9.81;

VehicleConfig without_drag() {
  VehicleConfig config;
  config.airframe.rotor_drag_xy_kgps = 0.0;
  config.airframe.rotor_drag_z_kgps = 0.0;
  config.airframe.body_drag_kgpm = 0.0;
  return config;
}

MotorCommands hover_commands(const AirframeConfig& airframe) {
  MotorCommands commands{};
  commands.fill(0.25 * airframe.mass_kg * kGravityMps2 / airframe.max_motor_thrust_n);
  return commands;
}

VehicleState at_height(double height_m) {
  VehicleState state;
  state.position_m.z() = height_m;
  return state;
}

void run(Vehicle& vehicle, const MotorCommands& commands, double duration_s) {
  const auto steps = static_cast<int>(std::lround(duration_s / kStepS));
  for (int i = 0; i < steps; ++i) {
    vehicle.step(commands, kStepS);
  }
}

TEST(Vehicle, FallsFreelyWithoutDrag) {
  Vehicle vehicle(without_drag(), {0.0, 0.0, 100.0}, 0.0, Rng(1));

  run(vehicle, {}, 2.0);

  EXPECT_NEAR(vehicle.state().position_m.z(), 100.0 - 0.5 * kGravityMps2 * 4.0, 1e-9);
  EXPECT_NEAR(vehicle.state().velocity_mps.z(), -2.0 * kGravityMps2, 1e-9);
}

TEST(Vehicle, HoverThrustHoldsItStill) {
  const VehicleConfig config;
  Vehicle vehicle(config, {0.0, 0.0, 2.0}, 0.3, Rng(1));
  vehicle.set_state(at_height(2.0));

  run(vehicle, hover_commands(config.airframe), 10.0);

  EXPECT_NEAR((vehicle.state().position_m - Vector3d(0.0, 0.0, 2.0)).norm(), 0.0, 1e-9);
}

TEST(Vehicle, FallSettlesAtTheSpeedWhereDragCarriesTheWeight) {
  const VehicleConfig config;
  const AirframeConfig& airframe = config.airframe;
  Vehicle vehicle(config, {0.0, 0.0, 2000.0}, 0.0, Rng(1));
  const double weight_n = airframe.mass_kg * kGravityMps2;
  const double linear = airframe.rotor_drag_z_kgps;
  const double square = airframe.body_drag_kgpm;
  const double terminal_mps =
      (-linear + std::sqrt(linear * linear + 4.0 * square * weight_n)) / (2.0 * square);

  run(vehicle, {}, 40.0);

  EXPECT_NEAR(vehicle.state().velocity_mps.z(), -terminal_mps, 1e-3 * terminal_mps);
}

TEST(Vehicle, MotorsFollowTheirCommandWithAFirstOrderLag) {
  const VehicleConfig config;
  const AirframeConfig& airframe = config.airframe;
  Vehicle vehicle(config, {0.0, 0.0, 2.0}, 0.0, Rng(1));
  MotorCommands full{};
  full.fill(1.0);

  run(vehicle, full, 0.1);

  const double risen = 1.0 - std::exp(-0.1 / airframe.motor_time_constant_s);
  for (const double thrust_n : vehicle.motor_thrusts_n()) {
    EXPECT_NEAR(thrust_n, risen * airframe.max_motor_thrust_n, 1e-9);
  }
}

TEST(Vehicle, CommandsBeyondTheirRangeAreClampedByTheMotors) {
  const VehicleConfig config;
  Vehicle vehicle(config, {0.0, 0.0, 50.0}, 0.0, Rng(1));

  run(vehicle, {7.0, 7.0, -3.0, -3.0}, 1.0);

  EXPECT_NEAR(vehicle.motor_thrusts_n()[0], config.airframe.max_motor_thrust_n, 1e-6);
  EXPECT_NEAR(vehicle.motor_thrusts_n()[2], 0.0, 1e-6);
}

struct TurnCase {
  MotorCommands change;
  Vector3d rates_sign;  // of the body rates it causes
};

class VehicleTurn : public testing::TestWithParam<TurnCase> {};

TEST_P(VehicleTurn, MotorPairTurnsTheBodyAboutOneAxisOnly) {
  const VehicleConfig config;
  Vehicle vehicle(config, {0.0, 0.0, 50.0}, 0.0, Rng(1));
  vehicle.set_state(at_height(50.0));
  MotorCommands commands = hover_commands(config.airframe);
  for (std::size_t i = 0; i < 4; ++i) {
    commands[i] += 0.05 * GetParam().change[i];
  }

  run(vehicle, commands, 0.05);

  const Vector3d& rates = vehicle.state().body_rates_radps;
  for (int axis = 0; axis < 3; ++axis) {
    if (GetParam().rates_sign[axis] == 0.0) {
      EXPECT_NEAR(rates[axis], 0.0, 1e-9);
    } else {
      EXPECT_GT(GetParam().rates_sign[axis] * rates[axis], 0.01);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(AllAxes,
                         VehicleTurn,
                         testing::Values(TurnCase{{1.0, -1.0, -1.0, 1.0}, {1.0, 0.0, 0.0}},
                                         TurnCase{{1.0, 1.0, -1.0, -1.0}, {0.0, -1.0, 0.0}},
                                         TurnCase{{1.0, -1.0, 1.0, -1.0}, {0.0, 0.0, 1.0}}));

TEST(Vehicle, TumblingWithoutTorqueKeepsAngularMomentumAndEnergy) {
  VehicleConfig config = without_drag();
  config.airframe.inertia_xx_kgm2 = 0.008;
  config.airframe.inertia_yy_kgm2 = 0.012;
  const Vector3d inertia(0.008, 0.012, config.airframe.inertia_zz_kgm2);
  Vehicle vehicle(config, {0.0, 0.0, 200.0}, 0.0, Rng(1));
  VehicleState state = at_height(200.0);
  state.body_rates_radps = {2.0, 0.4, 1.0};
  vehicle.set_state(state);
  MotorCommands commands = hover_commands(config.airframe);  // the four torques cancel
  const auto momentum = [&](const VehicleState& s) {
    return Vector3d(s.world_from_body * inertia.cwiseProduct(s.body_rates_radps));
  };
  const auto energy = [&](const VehicleState& s) {
    return 0.5 * s.body_rates_radps.dot(inertia.cwiseProduct(s.body_rates_radps));
  };
  const Vector3d momentum_before = momentum(state);
  const double energy_before = energy(state);

  run(vehicle, commands, 2.0);

  EXPECT_NEAR(
      (momentum(vehicle.state()) - momentum_before).norm() / momentum_before.norm(), 0.0, 0.01);
  EXPECT_NEAR(energy(vehicle.state()) / energy_before, 1.0, 0.01);
  EXPECT_NEAR(vehicle.state().world_from_body.norm(), 1.0, 1e-12);
}

TEST(Vehicle, DriftsWithTheWindUntilItMovesWithTheAir) {
  VehicleConfig config;
  config.wind.mean_x_mps = 3.0;
  config.wind.mean_y_mps = -1.0;
  Vehicle vehicle(config, {0.0, 0.0, 50.0}, 0.0, Rng(1));
  vehicle.set_state(at_height(50.0));

  run(vehicle, hover_commands(config.airframe), 60.0);

  EXPECT_NEAR(vehicle.state().velocity_mps.x(), 3.0, 0.01);
  EXPECT_NEAR(vehicle.state().velocity_mps.y(), -1.0, 0.01);
}

TEST(Vehicle, GustsHaveTheirDeviationAndCorrelationTime) {
  VehicleConfig config;
  config.wind.gust_deviation_mps = 0.8;
  config.wind.gust_time_s = 0.5;
  Vehicle vehicle(config, {0.0, 0.0, 1.0}, 0.0, Rng(5));
  constexpr int kLag = 250;  // 0.5 s
  std::vector<double> gusts_mps;
  for (int i = 0; i < 1000000; ++i) {
    vehicle.step({}, kStepS);
    gusts_mps.push_back(vehicle.wind_mps().x());
  }

  double squares = 0.0;
  double products = 0.0;
  for (std::size_t i = kLag; i < gusts_mps.size(); ++i) {
    squares += gusts_mps[i] * gusts_mps[i];
    products += gusts_mps[i] * gusts_mps[i - kLag];
  }
  const auto count = static_cast<double>(gusts_mps.size() - kLag);
  EXPECT_NEAR(std::sqrt(squares / count), 0.8, 0.05);
  EXPECT_NEAR(products / squares, std::exp(-1.0), 0.05);
}

TEST(Vehicle, SameSeedAndCommandsGiveTheSameBytesAndAnotherSeedDoesNot) {
  VehicleConfig config;
  config.wind = {1.0, 0.5, 0.7, 1.0};
  Vehicle first(config, {0.0, 0.0, 5.0}, 0.0, Rng(3));
  Vehicle second(config, {0.0, 0.0, 5.0}, 0.0, Rng(3));
  Vehicle other(config, {0.0, 0.0, 5.0}, 0.0, Rng(4));

  for (Vehicle* vehicle : {&first, &second, &other}) {
    run(*vehicle, {0.4, 0.39, 0.4, 0.39}, 0.5);
  }

  EXPECT_EQ(first.state().position_m, second.state().position_m);
  EXPECT_EQ(first.state().world_from_body.coeffs(), second.state().world_from_body.coeffs());
  EXPECT_NE(first.state().position_m, other.state().position_m);
}

TEST(Vehicle, StandsOnItsLegsInWindWithTheMotorsOff) {
  VehicleConfig config;
  config.wind = {5.0, 0.0, 1.0, 1.0};
  Vehicle vehicle(config, {1.0, 2.0, 0.0}, 0.4, Rng(1));

  run(vehicle, {}, 5.0);

  EXPECT_TRUE(vehicle.on_ground());
  EXPECT_EQ(vehicle.state().position_m, Vector3d(1.0, 2.0, config.gear_height_m));
  EXPECT_NEAR(yaw_of(vehicle.state().world_from_body), 0.4, 1e-9);
}

TEST(Vehicle, LeaningTouchDownEndsLevelWhereItTouched) {
  VehicleConfig config;
  Vehicle vehicle(config, {0.0, 0.0, 1.0}, 0.0, Rng(1));
  VehicleState state = at_height(0.12);
  state.velocity_mps = {0.2, 0.0, -0.5};
  state.world_from_body =
      Eigen::AngleAxisd(0.9, Vector3d::UnitZ()) * Eigen::AngleAxisd(0.2, Vector3d::UnitX());
  vehicle.set_state(state);

  run(vehicle, {}, 2.0);

  EXPECT_TRUE(vehicle.on_ground());
  EXPECT_EQ(vehicle.state().position_m.z(), config.gear_height_m);
  EXPECT_LT(vehicle.state().position_m.head<2>().norm(), 0.03);
  const Vector3d up = vehicle.state().world_from_body * Vector3d::UnitZ();
  EXPECT_NEAR(up.z(), 1.0, 1e-9);
  EXPECT_NEAR(yaw_of(vehicle.state().world_from_body), 0.9, 0.05);
}

TEST(Vehicle, LeavesTheGroundOnlyWhenThrustExceedsItsWeight) {
  const VehicleConfig config;
  const double hover = hover_commands(config.airframe)[0];
  Vehicle weak(config, Vector3d::Zero(), 0.0, Rng(1));
  Vehicle strong(config, Vector3d::Zero(), 0.0, Rng(1));

  run(weak, {0.98 * hover, 0.98 * hover, 0.98 * hover, 0.98 * hover}, 3.0);
  run(strong, {1.02 * hover, 1.02 * hover, 1.02 * hover, 1.02 * hover}, 3.0);

  EXPECT_TRUE(weak.on_ground());
  EXPECT_FALSE(strong.on_ground());
  EXPECT_GT(strong.state().position_m.z(), 0.2);
}

TEST(Vehicle, HangsStillInTheLauncherUntilItsMotorsCarryIt) {
  VehicleConfig config;
  config.wind = {5.0, 0.0, 1.0, 1.0};
  const double hover = hover_commands(config.airframe)[0];
  Vehicle vehicle(config, {1.0, 2.0, 1.5}, 0.4, Rng(1));
  vehicle.hang_in_launcher();

  run(vehicle, {}, 5.0);
  run(vehicle, {0.94 * hover, 0.94 * hover, 0.94 * hover, 0.94 * hover}, 5.0);

  EXPECT_TRUE(vehicle.on_ground());
  EXPECT_EQ(vehicle.state().position_m, Vector3d(1.0, 2.0, 1.5));
  EXPECT_TRUE(vehicle.state().velocity_mps.isZero());
}

TEST(Vehicle, LeavesTheLauncherWithExactlyTheThrustOfAHover) {
  const VehicleConfig config;
  Vehicle vehicle(config, {0.0, 0.0, 1.5}, 0.0, Rng(1));
  vehicle.hang_in_launcher();

  run(vehicle, hover_commands(config.airframe), 0.5);

  EXPECT_FALSE(vehicle.on_ground());
  EXPECT_GT(vehicle.state().position_m.z(), 1.48);
}

TEST(Vehicle, LeavesTheLauncherOnceAndThenFallsWithoutThrust) {
  const VehicleConfig config;
  const double hover = hover_commands(config.airframe)[0];
  Vehicle vehicle(config, {0.0, 0.0, 1.5}, 0.0, Rng(1));
  vehicle.hang_in_launcher();

  run(vehicle, {1.05 * hover, 1.05 * hover, 1.05 * hover, 1.05 * hover}, 1.0);
  EXPECT_FALSE(vehicle.on_ground());
  EXPECT_GT(vehicle.state().position_m.z(), 1.5);
  run(vehicle, {}, 2.0);

  EXPECT_TRUE(vehicle.on_ground());
  EXPECT_EQ(vehicle.state().position_m.z(), config.gear_height_m);
}

TEST(Vehicle, ConfigurationNamesEveryField) {
  const std::string text = to_yaml(VehicleConfig{});

  for (const char* key :
       {"airframe:", "mass_kg: 1.2", "wind:", "gust_time_s: 2", "gear_height_m"}) {
    EXPECT_NE(text.find(key), std::string::npos) << key << " in\n" << text;
  }
}

}  // namespace
}  // namespace understory
