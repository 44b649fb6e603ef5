// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What a mission does when the world is not as it was when the flown trajectory was planned, or the
// host was too late.
#include <gtest/gtest.h>

#include "support/mission_flight.hpp"

namespace understory {
namespace {

using test::hall_known_between;
using test::long_hall;
using test::MissionFlight;

// A wall across the hall, 1.9 m ahead of the vehicle in the direction of its flight.
void put_a_wall_ahead(MissionFlight& flight) {
  const TrajectoryPoint here = flight.here();
  const double ahead_m = here.velocity_mps.x() > 0.0 ? 1.9 : -2.2;
  const double x_m = here.position_m.x() + ahead_m;
  flight.builder.set_box({Vector3d(x_m, -1.0, 0.0), Vector3d(x_m + 0.3, 1.0, 2.0)},
                         VoxelState::kOccupied);
}

test::SnapshotBuilder hall_with_a_closed_room() {
  test::SnapshotBuilder builder = hall_known_between(-8.0, 5.0);
  builder.set_box({Vector3d(1.5, -1.0, 0.0), Vector3d(1.8, 1.0, 2.0)}, VoxelState::kOccupied);
  return builder;
}

TEST(MissionSafety, WithdrawnTrajectoryIsNotFlownAndTheOneBeforeIs) {
  MissionFlight flight(long_hall());
  ASSERT_TRUE(flight.fly_until_fast());
  const TrajectoryPtr before = flight.mission.pilot().follower().newest();
  ASSERT_TRUE(flight.fly_until_something_new_is_published());
  ASSERT_EQ(flight.mission.pilot().follower().newest(), flight.last.published);

  flight.mission.withdraw(flight.last.published);

  EXPECT_EQ(flight.mission.pilot().follower().newest(), before);
  EXPECT_TRUE(flight.fly_until_something_new_is_published()) << "the mission goes on";
}

TEST(MissionSafety, WhatBecomesUnsafeIsBrakedWhilePausedOrDescending) {
  for (const bool is_paused : {true, false}) {
    MissionFlight flight(long_hall());
    ASSERT_TRUE(flight.fly_until_fast());
    const Mission::Answer answer =
        is_paused ? flight.mission.pause(flight.now) : flight.mission.land(flight.now);
    flight.mission.withdraw(answer.published);  // what was flown before is flown on
    EXPECT_EQ(flight.step().published, nullptr) << "as long as it is safe";
    put_a_wall_ahead(flight);

    const MissionStep step = flight.step();

    ASSERT_NE(step.published, nullptr) << is_paused;
    EXPECT_EQ(step.published->mode, FlightMode::kBrake);
    EXPECT_FALSE(flight.mission.pilot().unsafe_from(flight.now).has_value());
    EXPECT_EQ(flight.mission.state(), is_paused ? MissionState::kPaused : MissionState::kDescend);
  }
}

TEST(MissionSafety, ObstacleBelowEndsADescentAboveIt) {
  MissionFlight flight(long_hall());
  ASSERT_TRUE(flight.fly_until_state(MissionState::kExplore));
  ASSERT_TRUE(flight.mission.land(flight.now).accepted);
  ASSERT_TRUE(flight.fly_until([&] { return flight.here().velocity_mps.z() < -0.05; }));
  const Vector3d here_m = flight.here().position_m;
  flight.builder.set_box({Vector3d(-8.0, -1.0, 0.0), Vector3d(8.0, 1.0, here_m.z() - 0.45)},
                         VoxelState::kOccupied);

  const MissionStep step = flight.step();

  ASSERT_NE(step.published, nullptr);
  EXPECT_EQ(step.published->mode, FlightMode::kBrake);
  EXPECT_FALSE(flight.mission.pilot().unsafe_from(flight.now).has_value());
  EXPECT_TRUE(flight.fly_until_state(MissionState::kLand)) << "gives up after some tries";
  EXPECT_GT(flight.here().position_m.z(), here_m.z() - 0.3);
}

TEST(MissionSafety, NothingLeftIsLookedForAgainFromHomeABoundedNumberOfTimes) {
  MissionFlight flight(hall_with_a_closed_room());
  int explored = 0;
  MissionState last = MissionState::kTakeOff;

  flight.fly_until([&] {
    explored += last != MissionState::kExplore && flight.mission.state() == MissionState::kExplore;
    last = flight.mission.state();
    return flight.mission.is_over();
  });

  EXPECT_EQ(flight.mission.state(), MissionState::kLand);
  EXPECT_EQ(flight.mission.stop_reason(), StopReason::kNothingLeft);
  EXPECT_EQ(explored, 1 + 3);
}

TEST(MissionSafety, ReturnThatWasAskedForOnTheWayHomeIsFinal) {
  MissionFlight flight(hall_with_a_closed_room());
  ASSERT_TRUE(flight.fly_until_state(MissionState::kReturnHome));
  ASSERT_EQ(flight.mission.stop_reason(), StopReason::kNothingLeft);
  ASSERT_TRUE(flight.mission.explorer().has_open_clusters());

  ASSERT_TRUE(flight.mission.return_home(flight.now).accepted);

  while (!flight.mission.is_over() && flight.now < Time(std::chrono::minutes(2))) {
    flight.step();
    ASSERT_NE(flight.mission.state(), MissionState::kExplore) << to_seconds(flight.now);
  }
  EXPECT_EQ(flight.mission.state(), MissionState::kLand);
  EXPECT_EQ(flight.mission.stop_reason(), StopReason::kNothingLeft);
}

TEST(MissionSafety, LaunchSiteReachesFromTheGroundToAboveTakeOffHeight) {
  MissionConfig config;
  config.take_off_height_m = 1.5;
  config.launch_site_radius_m = 0.7;

  const Box3d low = launch_site_m(config, {1.0, 2.0, 0.2});
  const Box3d high = launch_site_m(config, {1.0, 2.0, 3.0});

  EXPECT_TRUE(low.min().isApprox(Vector3d(0.3, 1.3, 0.0)));
  EXPECT_TRUE(low.max().isApprox(Vector3d(1.7, 2.7, 2.0)));
  EXPECT_TRUE(high.max().isApprox(Vector3d(1.7, 2.7, 3.5)));
}

}  // namespace
}  // namespace understory
