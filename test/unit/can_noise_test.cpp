// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include <gtest/gtest.h>

#include "support/frame_noise.hpp"
#include "support/station_pair.hpp"

namespace understory::can {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using test::FrameNoise;
using test::StationPair;

constexpr int kFrames = 100'000;
constexpr int kFramesPerStep = 5;

std::vector<Frame> frames_of(const std::vector<PortFrame>& list) {
  std::vector<Frame> frames;
  for (const PortFrame& frame : list) {
    frames.push_back(frame.frame);
  }
  return frames;
}

// All that the host has sent to fly; no KILL.
std::vector<Frame> real_frames_of_a_host() {
  StationPair pair;
  EXPECT_TRUE(pair.take_off());
  pair.run(seconds(2));
  return frames_of(pair.from_host);
}

std::vector<Frame> real_frames_of_a_vehicle() {
  StationPair pair;
  EXPECT_TRUE(pair.take_off());
  pair.run(seconds(2));
  return frames_of(pair.from_vehicle);
}

bool are_commands(const MotorCommands& commands) {
  return std::all_of(commands.begin(), commands.end(), [](double command) {
    return std::isfinite(command) && command >= 0.0 && command <= 1.0;
  });
}

using Make = Frame (FrameNoise::*)();

class NoiseOf : public ::testing::TestWithParam<Make> {
 public:
  FrameNoise noise{Rng(31), real_frames_of_a_host()};
};

TEST_P(NoiseOf, FramesNeverArmsAVehicleThatNoHostArms) {
  StationPair pair;
  pair.run(seconds(1));

  for (int i = 0; i < kFrames; ++i) {
    pair.pass_up((noise.*GetParam())());
    if (i % kFramesPerStep == 0) {
      pair.step();
      ASSERT_NE(pair.vehicle_state(), State::kArmed) << i;
      ASSERT_EQ(pair.commands, MotorCommands{}) << i;
    }
  }

  EXPECT_EQ(pair.vehicle->setpoints_flown(), 0U);
}

TEST_P(NoiseOf, FramesNeverBringsAnythingButCommandsToTheMotors) {
  StationPair pair;
  ASSERT_TRUE(pair.take_off());

  for (int i = 0; i < kFrames; ++i) {
    pair.pass_up((noise.*GetParam())());
    if (i % kFramesPerStep == 0) {
      pair.step();
      ASSERT_TRUE(are_commands(pair.commands)) << i;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Can,
                         NoiseOf,
                         ::testing::Values(&FrameNoise::random,
                                           &FrameNoise::altered,
                                           &FrameNoise::altered_with_right_checksum));

// Without a right checksum nothing comes through, so that what is flown is what was sent.
TEST(CanNoise, OfAlteredFramesNoSetIsFlown) {
  StationPair pair;
  ASSERT_TRUE(pair.take_off());
  FrameNoise noise(Rng(32), real_frames_of_a_host());

  for (int i = 0; i < kFrames; ++i) {
    pair.pass_up(noise.altered());
    if (i % kFramesPerStep == 0) {
      pair.step();
      const auto& flown = pair.vehicle->flown();
      ASSERT_TRUE(!flown || flown->setpoint.position_m.isApprox(pair.setpoint->position_m, 1e-3));
    }
  }
}

// A gateway that is faulty, or worse: all that is left then are the limits.
TEST(CanNoise, WrongDataWithARightChecksumAreFlownOnlyWithinTheLimits) {
  const SupervisorConfig limits;
  int flown_sets = 0;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    StationPair pair;
    ASSERT_TRUE(pair.take_off());
    Rng rng(seed);
    pair.up_filter = [&](const Frame& frame) {
      if (!SetpointReceiver::takes(frame.id) || rng.below(4) != 0) {
        return true;
      }
      Frame wrong = frame;
      const std::uint64_t bit = 16 + rng.below(48);
      wrong.data[bit / 8] = static_cast<std::uint8_t>(wrong.data[bit / 8] ^ (1U << (bit % 8)));
      pair.pass_up(test::with_right_checksum(wrong));
      return false;
    };
    for (int i = 0; i < 1000; ++i) {
      const std::uint64_t before = pair.vehicle->setpoints_flown();
      pair.step();
      if (pair.vehicle->setpoints_flown() == before) {
        continue;
      }
      ++flown_sets;
      const Setpoint& setpoint = pair.vehicle->flown()->setpoint;
      const double error_m = (setpoint.position_m - pair.readings.state.position_m).norm();
      ASSERT_LE(error_m, limits.max_error_m) << "seed " << seed;
      ASSERT_LE(setpoint.velocity_mps.norm(), limits.max_speed_mps) << "seed " << seed;
      ASSERT_LE(setpoint.acceleration_mps2.norm(), limits.max_acceleration_mps2) << "seed " << seed;
      ASSERT_TRUE(are_commands(pair.commands)) << "seed " << seed;
    }
  }
  EXPECT_GT(flown_sets, 1000);
}

TEST(CanNoise, TheHostBelievesNoAlteredFrame) {
  StationPair pair;
  ASSERT_TRUE(pair.take_off());
  FrameNoise noise(Rng(33), real_frames_of_a_vehicle());
  const Vector3d here_m = pair.readings.state.position_m;

  for (int i = 0; i < kFrames; ++i) {
    pair.host.on_frame(noise.altered(), pair.now);
    if (i % kFramesPerStep == 0) {
      pair.step();
      const auto& odometry = pair.host.odometry();
      ASSERT_TRUE(!odometry || odometry->state.position_m.isApprox(here_m, 1e-3)) << i;
    }
  }
}

TEST(CanNoise, TheHostsOdometryIsFiniteWhateverItHears) {
  StationPair pair;
  ASSERT_TRUE(pair.take_off());
  FrameNoise noise(Rng(34), real_frames_of_a_vehicle());

  for (int i = 0; i < kFrames; ++i) {
    pair.host.on_frame(noise.altered_with_right_checksum(), pair.now);
    if (i % kFramesPerStep == 0) {
      pair.step();
      const auto& odometry = pair.host.odometry();
      ASSERT_TRUE(!odometry || (odometry->state.position_m.allFinite() &&
                                odometry->state.velocity_mps.allFinite()))
          << i;
    }
  }
}

TEST(CanNoise, TheRightChecksumIsTheOneOfTheCodec) {
  for (const Frame& frame : real_frames_of_a_host()) {
    ASSERT_EQ(test::with_right_checksum(frame), frame);
  }
  for (const Frame& frame : real_frames_of_a_vehicle()) {
    ASSERT_EQ(test::with_right_checksum(frame), frame);
  }
}

}  // namespace
}  // namespace understory::can
