// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/plan/pilot.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "support/plan_room.hpp"

namespace understory {
namespace {

using test::end_of;
using test::open_room;
using test::room_with_wall;
using test::SnapshotBuilder;

constexpr Duration kLead{100000};
const Vector3d kStart_m(-4.0, 0.0, 1.0);

Time at_s(double seconds) {
  return Time(duration_from_seconds(seconds));
}

FlightGoal goal_at(const Vector3d& from_m, const Vector3d& to_m) {
  FlightGoal goal;
  goal.route_m = {from_m, to_m};
  return goal;
}

Pilot pilot_in(const MapSnapshotPtr& map) {
  Pilot pilot(PlanConfig{}, kLead);
  pilot.take_position(kStart_m, 0.3, Time{});
  pilot.update_map(map);
  return pilot;
}

// What is flown from `from` until all has come to rest, looked at as one motion.
void expect_flown_safely(const Pilot& pilot, const MapSnapshot& map, Time from, double radius_m) {
  const TrajectoryFollower& follower = pilot.follower();
  TrajectoryPoint last = follower.sample(from);
  for (Time time = from; time <= follower.newest()->end(); time += Duration(1000)) {
    const TrajectoryPoint point = follower.sample(time);
    ASSERT_LT((point.position_m - last.position_m).norm(), 0.004) << "jump at " << to_seconds(time);
    ASSERT_LT((point.velocity_mps - last.velocity_mps).norm(), 0.004) << to_seconds(time);
    if (time.time_since_epoch().count() % 10000 == 0) {
      ASSERT_GT(test::brute_force_clearance_m(map, point.position_m, radius_m + 0.01), radius_m)
          << to_seconds(time);
    }
    last = point;
  }
  EXPECT_LT(last.velocity_mps.norm(), 1e-3);
}

TEST(Pilot, RestsWhereItWasPutUntilToldOtherwise) {
  const Pilot pilot = pilot_in(open_room().build());

  for (const double time_s : {0.0, 0.05, 10.0, 1000.0}) {
    const TrajectoryPoint point = pilot.follower().sample(at_s(time_s));
    EXPECT_LT((point.position_m - kStart_m).norm(), 1e-12);
    EXPECT_EQ(point.velocity_mps.norm(), 0.0);
    EXPECT_DOUBLE_EQ(point.yaw_rad, 0.3);
  }
  EXPECT_TRUE(pilot.is_at_rest(at_s(1.0)));
}

TEST(Pilot, NewTrajectoryTakesOverAfterTheLeadAndWithoutAJump) {
  const MapSnapshotPtr map = open_room().build();
  Pilot pilot = pilot_in(map);
  ASSERT_TRUE(pilot.fly(goal_at(kStart_m, {3, 0, 1}), at_s(1.0)).has_value());

  // In full flight, off to one side.
  const Time now = at_s(3.456789);
  const TrajectoryPoint before = pilot.follower().sample(now);
  const Vector3d next_m = pilot.next_start_point(now).position_m;
  const Result<TrajectoryPtr, PlanError> flown = pilot.fly(goal_at(next_m, {2, 3, 1}), now);

  ASSERT_TRUE(flown.has_value()) << to_string(flown.error());
  EXPECT_GT(before.velocity_mps.norm(), 1.0);
  EXPECT_EQ((*flown)->start, now + kLead);
  EXPECT_EQ(pilot.follower().sample(now).position_m, before.position_m);
  EXPECT_LT((end_of(**flown) - Vector3d(2, 3, 1)).norm(), 1e-6);
  expect_flown_safely(pilot, *map, now, 0.28);
}

TEST(Pilot, EveryAcceptedTrajectoryHasAGreaterIdentity) {
  Pilot pilot = pilot_in(open_room().build());

  const std::uint64_t rest = pilot.follower().newest()->id;
  const Result<TrajectoryPtr, PlanError> flown = pilot.fly(goal_at(kStart_m, {3, 0, 1}), at_s(1.0));
  const Result<TrajectoryPtr, PlanError> braked = pilot.brake(at_s(3.0));

  ASSERT_TRUE(flown && braked);
  EXPECT_GT((*flown)->id, rest);
  EXPECT_GT((*braked)->id, (*flown)->id);
}

TEST(Pilot, PlanThatFailsChangesNothingThatIsFlown) {
  SnapshotBuilder builder = room_with_wall(1.5);
  Pilot pilot = pilot_in(builder.build());
  ASSERT_TRUE(pilot.fly(goal_at(kStart_m, {0, 0, 1}), at_s(1.0)).has_value());
  const TrajectoryPtr before = pilot.follower().newest();

  const Result<TrajectoryPtr, PlanError> refused =
      pilot.fly(goal_at(pilot.next_start_point(at_s(2.0)).position_m, {4, 0, 1}), at_s(2.0));

  EXPECT_FALSE(refused.has_value());
  EXPECT_EQ(pilot.follower().newest(), before);
  EXPECT_EQ(pilot.counters().plans, 2U);
  EXPECT_EQ(pilot.counters().failed_plans, 1U);
}

TEST(Pilot, ObstacleOnTheFlownPathIsSeenAndBrakedFor) {
  SnapshotBuilder builder = open_room();
  Pilot pilot = pilot_in(builder.build());
  ASSERT_TRUE(pilot.fly(goal_at(kStart_m, {4, 0, 1}), at_s(1.0)).has_value());
  const Time now = at_s(3.5);
  EXPECT_FALSE(pilot.unsafe_from(now).has_value());

  const double wall_m = pilot.follower().sample(now).position_m.x() + 2.5;
  builder.set_box({Vector3d(wall_m, -6, 0), Vector3d(wall_m + 0.5, 6, 2)}, VoxelState::kOccupied);
  const MapSnapshotPtr map = builder.build();
  pilot.update_map(map);

  const std::optional<Time> unsafe = pilot.unsafe_from(now);
  ASSERT_TRUE(unsafe.has_value());
  EXPECT_GT(*unsafe, now);
  const Result<TrajectoryPtr, PlanError> braked = pilot.brake(now);
  ASSERT_TRUE(braked.has_value()) << to_string(braked.error());
  EXPECT_FALSE(pilot.unsafe_from(now).has_value());
  expect_flown_safely(pilot, *map, now, 0.25);
  EXPECT_EQ(pilot.counters().brakes, 1U);
  EXPECT_EQ(pilot.counters().failed_brakes, 0U);
}

TEST(Pilot, BrakeThatFailsLeavesWhatIsFlown) {
  SnapshotBuilder builder = open_room();
  Pilot pilot = pilot_in(builder.build());
  ASSERT_TRUE(pilot.fly(goal_at(kStart_m, {4, 0, 1}), at_s(1.0)).has_value());
  const TrajectoryPtr before = pilot.follower().newest();
  const Time now = at_s(3.5);
  const double wall_m = pilot.follower().sample(now).position_m.x() + 0.6;
  builder.set_box({Vector3d(wall_m, -6, 0), Vector3d(wall_m + 0.5, 6, 2)}, VoxelState::kOccupied);
  pilot.update_map(builder.build());

  EXPECT_FALSE(pilot.brake(now).has_value());

  EXPECT_EQ(pilot.follower().newest(), before);
  EXPECT_EQ(pilot.counters().failed_brakes, 1U);
}

TEST(Pilot, PathThatIsNoLongerFlownIsNotLookedAt) {
  SnapshotBuilder builder = open_room();
  Pilot pilot = pilot_in(builder.build());
  ASSERT_TRUE(pilot.fly(goal_at(kStart_m, {4, 0, 1}), at_s(1.0)).has_value());
  const Time now = at_s(3.5);
  const Vector3d next_m = pilot.next_start_point(now).position_m;
  ASSERT_TRUE(pilot.fly(goal_at(next_m, {next_m.x() + 1.0, 3, 1}), now).has_value());

  // Where the first trajectory would have gone.
  builder.set_box({Vector3d(3.2, -1, 0), Vector3d(5, 1, 2)}, VoxelState::kOccupied);
  pilot.update_map(builder.build());

  EXPECT_FALSE(pilot.unsafe_from(now).has_value());
}

TEST(Pilot, BrakingTrajectoryIsReadyAtEveryInstantOfAFlight) {
  const MapSnapshotPtr map = test::room_with_gap(0.8).build();
  Pilot pilot = pilot_in(map);
  FlightGoal goal;
  goal.route_m = {kStart_m, {-0.8, 0, 1}, {0.8, 0, 1}, {3, -1, 1}};
  goal.yaw_rad = 2.0;
  const Result<TrajectoryPtr, PlanError> flown = pilot.fly(goal, at_s(1.0));
  ASSERT_TRUE(flown.has_value()) << to_string(flown.error());

  for (Time now = at_s(1.0); now < (*flown)->end(); now += Duration(66667)) {
    Pilot other = pilot;
    const Result<TrajectoryPtr, PlanError> braked = other.brake(now);
    ASSERT_TRUE(braked.has_value()) << to_seconds(now) << " s: " << to_string(braked.error());
    expect_flown_safely(other, *map, now, 0.25);
  }
}

TEST(Pilot, BrakeDropsWhatWasToFollow) {
  Pilot pilot = pilot_in(open_room().build());
  ASSERT_TRUE(pilot.fly(goal_at(kStart_m, {3, 0, 1}), at_s(1.0)).has_value());
  const Time now = at_s(3.0);
  const Vector3d next_m = pilot.next_start_point(now).position_m;
  ASSERT_TRUE(pilot.fly(goal_at(next_m, {2, 3, 1}), now).has_value());

  const Result<TrajectoryPtr, PlanError> braked = pilot.brake(now);

  ASSERT_TRUE(braked.has_value());
  EXPECT_EQ(pilot.follower().newest(), *braked);
  EXPECT_LT((pilot.follower().sample(at_s(60.0)).position_m - end_of(**braked)).norm(), 1e-9);
}

TEST(Pilot, WhoBrakesAlreadyDoesNotBeginAnew) {
  Pilot pilot = pilot_in(open_room().build());
  ASSERT_TRUE(pilot.fly(goal_at(kStart_m, {3, 0, 1}), at_s(1.0)).has_value());
  const Result<TrajectoryPtr, PlanError> first = pilot.brake(at_s(3.0));
  ASSERT_TRUE(first && *first);

  const Result<TrajectoryPtr, PlanError> again = pilot.brake(at_s(3.1));

  ASSERT_TRUE(again.has_value());
  EXPECT_EQ(*again, nullptr);
  EXPECT_EQ(pilot.follower().newest(), *first);
  EXPECT_EQ(pilot.counters().brakes, 1U);
}

// (3 m/s)^2 / (2 m/s2) is 4.5 m for two of them, who see each other from 4.5 m.
TEST(Pilot, WaryItFliesSoThatTwoCanStopAndLooksWhereItFlies) {
  FlightGoal goal = goal_at(kStart_m, {4, 2, 1});
  goal.yaw_rad = -2.5;
  goal.limits = {3.0, 2.0, 0.9, 2.0};
  double fastest_mps = 0.0;
  double widest_rad = 0.0;
  Pilot pilot = pilot_in(open_room().build());
  pilot.be_wary(4.5);
  const Result<TrajectoryPtr, PlanError> flown = pilot.fly(goal, at_s(1.0));
  ASSERT_TRUE(flown.has_value());
  for (Time time = (*flown)->start; time < (*flown)->end(); time += Duration(10000)) {
    const TrajectoryPoint point = (*flown)->sample(time);
    const double speed_mps = point.velocity_mps.norm();
    fastest_mps = std::max(fastest_mps, speed_mps);
    if (speed_mps > 1.0 && (point.position_m - Vector3d(4, 2, 1)).norm() > 1.0) {
      const double heading_rad = std::atan2(point.velocity_mps.y(), point.velocity_mps.x());
      widest_rad = std::max(widest_rad, std::abs(angle_difference(heading_rad, point.yaw_rad)));
    }
  }

  EXPECT_LT(fastest_mps, 2.0);
  EXPECT_GT(fastest_mps, 1.8);
  EXPECT_LT(widest_rad, 0.5);
  EXPECT_NEAR(angle_difference((*flown)->sample((*flown)->end()).yaw_rad, -2.5), 0.0, 1e-6);

  pilot = pilot_in(open_room().build());
  ASSERT_TRUE(pilot.fly(goal, at_s(1.0)).has_value());
  EXPECT_GT(pilot.follower().sample(at_s(3.5)).velocity_mps.norm(), 2.2);
}

TEST(Pilot, WaryItIsSlowUntilItsCameraHasTurned) {
  Pilot pilot(PlanConfig{}, kLead);
  pilot.take_position(kStart_m, 3.1, Time{});
  pilot.update_map(open_room().build());
  pilot.be_wary(4.5);

  const Result<TrajectoryPtr, PlanError> flown = pilot.fly(goal_at(kStart_m, {4, 0, 1}), at_s(1.0));

  ASSERT_TRUE(flown.has_value());
  for (Time time = (*flown)->start; time < (*flown)->end(); time += Duration(10000)) {
    const TrajectoryPoint point = (*flown)->sample(time);
    if (std::abs(angle_difference(point.yaw_rad, 0.0)) > 0.7) {
      ASSERT_LT(point.velocity_mps.norm(), 0.8) << to_seconds(time);
    }
  }
}

TEST(Pilot, WithdrawnTrajectoryIsAsIfItHadNeverBeenHandedOut) {
  const MapSnapshotPtr map = open_room().build();
  Pilot pilot = pilot_in(map);
  const Result<TrajectoryPtr, PlanError> first = pilot.fly(goal_at(kStart_m, {3, 0, 1}), at_s(1.0));
  ASSERT_TRUE(first.has_value());
  const Time now = at_s(3.0);
  const Vector3d next_m = pilot.next_start_point(now).position_m;
  const Result<TrajectoryPtr, PlanError> late = pilot.fly(goal_at(next_m, {2, 3, 1}), now);
  ASSERT_TRUE(late.has_value());

  pilot.withdraw(*late);

  EXPECT_EQ(pilot.follower().newest(), *first);
  EXPECT_EQ(pilot.next_start_point(now).position_m, next_m);
  EXPECT_LT((pilot.follower().sample(at_s(60.0)).position_m - Vector3d(3, 0, 1)).norm(), 1e-6);
  expect_flown_safely(pilot, *map, now, 0.28);
}

TEST(Pilot, RestsOnWhenItsOnlyTrajectoryIsWithdrawn) {
  Pilot pilot = pilot_in(open_room().build());

  pilot.withdraw(pilot.follower().newest());

  EXPECT_TRUE(pilot.is_at_rest(at_s(1.0)));
  EXPECT_EQ(pilot.follower().sample(at_s(1.0)).position_m, kStart_m);
}

}  // namespace
}  // namespace understory
