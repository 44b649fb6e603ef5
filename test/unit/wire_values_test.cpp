// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <functional>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "understory/base/rng.hpp"
#include "understory/link/wire_sets.hpp"

namespace understory::can {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

template <class Receiver>
bool complete(Receiver& receiver, const FrameSet& frames) {
  bool is_complete = false;
  for (const Frame& frame : frames) {
    is_complete = receiver.add(frame, Time{});
  }
  return is_complete;
}

WireSetpoint sent_and_received(const WireSetpoint& wire) {
  SetpointReceiver receiver;
  EXPECT_TRUE(complete(receiver, encode_setpoint(wire, 0).value()));
  return receiver.setpoint().value();
}

WireOdometry sent_and_received(const WireOdometry& wire) {
  OdometryReceiver receiver;
  EXPECT_TRUE(complete(receiver, encode_odometry(wire, 0).value()));
  return receiver.odometry().value();
}

Vector3d random_vector(Rng& rng, double most) {
  return {rng.uniform(-most, most), rng.uniform(-most, most), rng.uniform(-most, most)};
}

double largest_difference(const Vector3d& a, const Vector3d& b) {
  return (a - b).cwiseAbs().maxCoeff();
}

double angle_between(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  return a.angularDistance(b);
}

TEST(SetpointFrames, CarryValuesWithinHalfAStepOfTheirScale) {
  Rng rng(11);
  for (int i = 0; i < 20'000; ++i) {
    WireSetpoint wire;
    wire.setpoint.position_m = random_vector(rng, 8388.0);
    wire.setpoint.velocity_mps = random_vector(rng, 32.7);
    wire.setpoint.acceleration_mps2 = random_vector(rng, 65.5);
    wire.setpoint.yaw_rad = rng.uniform(-M_PI, M_PI);
    wire.setpoint.yaw_rate_radps = rng.uniform(-32.7, 32.7);
    wire.mode = rng.below(2) == 0 ? SpMode::kTrack : SpMode::kHold;
    wire.seq = static_cast<std::uint8_t>(rng.below(256));
    wire.time_wire_us = static_cast<std::uint32_t>(rng.below(1U << 24U));

    const WireSetpoint back = sent_and_received(wire);

    const Setpoint& a = wire.setpoint;
    const Setpoint& b = back.setpoint;
    ASSERT_LE(largest_difference(a.position_m, b.position_m), 0.5001e-3);
    ASSERT_LE(largest_difference(a.velocity_mps, b.velocity_mps), 0.5001e-3);
    ASSERT_LE(largest_difference(a.acceleration_mps2, b.acceleration_mps2), 1.0001e-3);
    ASSERT_NEAR(a.yaw_rad, b.yaw_rad, 0.5001e-4);
    ASSERT_NEAR(a.yaw_rate_radps, b.yaw_rate_radps, 0.5001e-3);
    ASSERT_TRUE(back.mode == wire.mode && back.seq == wire.seq &&
                back.time_wire_us == wire.time_wire_us && back.mask == SpMask::kAll);
  }
}

TEST(SetpointFrames, CarryAYawOfAnyNumberOfTurns) {
  for (int half_turns = -6; half_turns <= 6; ++half_turns) {
    WireSetpoint wire;
    wire.setpoint.yaw_rad = 0.3 + M_PI * half_turns;

    const double back_rad = sent_and_received(wire).setpoint.yaw_rad;

    EXPECT_NEAR(std::remainder(back_rad - wire.setpoint.yaw_rad, 2.0 * M_PI), 0.0, 1e-4)
        << half_turns;
  }
}

TEST(SetpointFrames, CarryAYawOfHalfATurnEitherWay) {
  for (const double yaw_rad : {M_PI, -M_PI, 3.0 * M_PI, M_PI + 1e-9, -M_PI - 1e-9}) {
    WireSetpoint wire;
    wire.setpoint.yaw_rad = yaw_rad;

    EXPECT_NEAR(std::abs(sent_and_received(wire).setpoint.yaw_rad), M_PI, 1e-4) << yaw_rad;
  }
}

// Each value of a setpoint by itself.
const std::vector<std::function<double&(Setpoint&)>> kFields = {
    [](Setpoint& s) -> double& { return s.position_m.x(); },
    [](Setpoint& s) -> double& { return s.position_m.y(); },
    [](Setpoint& s) -> double& { return s.position_m.z(); },
    [](Setpoint& s) -> double& { return s.velocity_mps.x(); },
    [](Setpoint& s) -> double& { return s.velocity_mps.y(); },
    [](Setpoint& s) -> double& { return s.velocity_mps.z(); },
    [](Setpoint& s) -> double& { return s.acceleration_mps2.x(); },
    [](Setpoint& s) -> double& { return s.acceleration_mps2.y(); },
    [](Setpoint& s) -> double& { return s.acceleration_mps2.z(); },
    [](Setpoint& s) -> double& { return s.yaw_rate_radps; },
    [](Setpoint& s) -> double& { return s.yaw_rad; },
};

TEST(SetpointFrames, AreNotMadeWithAnyValueThatIsNotFinite) {
  for (std::size_t i = 0; i < kFields.size(); ++i) {
    for (const double bad : {kNan, kInfinity, -kInfinity}) {
      WireSetpoint wire;
      kFields[i](wire.setpoint) = bad;
      EXPECT_FALSE(encode_setpoint(wire, 0)) << "field " << i << " is " << bad;
    }
  }
}

TEST(SetpointFrames, AreNotMadeWithAnyValueOutOfRange) {
  for (std::size_t i = 0; i + 1 < kFields.size(); ++i) {  // any yaw is one within a turn
    const double most = i < 3 ? 8388.607 : i < 6 || i == 9 ? 32.767 : 65.534;
    for (const double sign : {1.0, -1.0}) {
      WireSetpoint wire;
      kFields[i](wire.setpoint) = sign * (most - 0.001);
      EXPECT_TRUE(encode_setpoint(wire, 0)) << "field " << i;
      kFields[i](wire.setpoint) = sign * (most + 0.01);
      EXPECT_FALSE(encode_setpoint(wire, 0)) << "field " << i;
    }
  }
}

TEST(SetpointFrames, WithAValueThatIsNotAvailableAreNoSetpoint) {
  SpVel velocity;
  velocity.sp_vx_mps = velocity.sp_vy_mps = 0.0;
  velocity.sp_vz_mps = kNotAvailable;
  FrameSet frames = encode_setpoint(WireSetpoint{}, 2).value();
  frames[2] = encode(velocity, 2).value();
  SetpointReceiver receiver;

  EXPECT_TRUE(complete(receiver, frames));

  EXPECT_FALSE(receiver.setpoint().has_value());
}

TEST(OdometryFrames, CarryValuesWithinHalfAStepOfTheirScale) {
  Rng rng(12);
  for (int i = 0; i < 20'000; ++i) {
    WireOdometry wire;
    wire.state.position_m = random_vector(rng, 8388.0);
    wire.state.velocity_mps = random_vector(rng, 32.7);
    wire.state.body_rates_radps = random_vector(rng, 32.7);
    wire.state.world_from_body =
        Eigen::Quaterniond(rng.normal(), rng.normal(), rng.normal(), rng.normal()).normalized();
    wire.quality = OdoQuality::kGood;
    wire.time_wire_us = static_cast<std::uint32_t>(rng.below(1U << 24U));

    const WireOdometry back = sent_and_received(wire);

    const VehicleState& a = wire.state;
    const VehicleState& b = back.state;
    ASSERT_LE(largest_difference(a.position_m, b.position_m), 0.5001e-3);
    ASSERT_LE(largest_difference(a.velocity_mps, b.velocity_mps), 0.5001e-3);
    ASSERT_LE(largest_difference(a.body_rates_radps, b.body_rates_radps), 0.5001e-3);
    ASSERT_LE(angle_between(a.world_from_body, b.world_from_body), 3e-4);
    ASSERT_TRUE(back.quality == wire.quality && back.time_wire_us == wire.time_wire_us);
  }
}

TEST(OdometryFrames, CarryTheAttitudeOfAVehicleThatPointsStraightUpOrDown) {
  for (const double pitch_rad : {0.5 * M_PI, -0.5 * M_PI, 0.5 * M_PI - 1e-7, 1e-7 - 0.5 * M_PI}) {
    for (const double yaw_rad : {-3.1, -1.0, 0.0, 2.0, M_PI}) {
      for (const double roll_rad : {-2.0, 0.0, 0.7}) {
        WireOdometry wire;
        wire.state.world_from_body = Eigen::AngleAxisd(yaw_rad, Vector3d::UnitZ()) *
                                     Eigen::AngleAxisd(pitch_rad, Vector3d::UnitY()) *
                                     Eigen::AngleAxisd(roll_rad, Vector3d::UnitX());

        const WireOdometry back = sent_and_received(wire);

        EXPECT_LT(angle_between(back.state.world_from_body, wire.state.world_from_body), 1e-3)
            << pitch_rad << " " << yaw_rad << " " << roll_rad;
      }
    }
  }
}

TEST(OdometryFrames, CarryAYawOfHalfATurn) {
  for (const double yaw_rad : {M_PI, -M_PI, M_PI - 1e-6, 1e-6 - M_PI}) {
    WireOdometry wire;
    wire.state.world_from_body = Eigen::AngleAxisd(yaw_rad, Vector3d::UnitZ());

    const double back_rad = yaw_of(sent_and_received(wire).state.world_from_body);

    EXPECT_NEAR(std::abs(back_rad), M_PI, 1e-4) << yaw_rad;
  }
}

TEST(OdometryFrames, AreNotMadeOfAStateThatIsNotFinite) {
  WireOdometry wire;
  wire.state.world_from_body.x() = kNan;
  EXPECT_FALSE(encode_odometry(wire, 0));

  wire = {};
  wire.state.body_rates_radps.y() = kInfinity;

  EXPECT_FALSE(encode_odometry(wire, 0));
}

TEST(OdometryFrames, AreNotMadeOfATumbleTooFastForTheScale) {
  WireOdometry wire;
  wire.state.body_rates_radps.x() = 33.0;

  EXPECT_FALSE(encode_odometry(wire, 0));
}

}  // namespace
}  // namespace understory::can
