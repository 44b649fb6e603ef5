// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// The verdicts on trajectories, and braking.
#include <gtest/gtest.h>

#include "support/plan_room.hpp"
#include "understory/plan/trajectory_planner.hpp"

namespace understory {
namespace {

using test::brake_requirements;
using test::end_of;
using test::fault_in;
using test::open_room;
using test::PlanRoom;
using test::request_along;
using test::room_with_wall;
using test::SnapshotBuilder;

TEST(FirstUnsafeTime, IsTheFirstSampleThatIsTooClose) {
  const PlanRoom room(room_with_wall(2.0));
  const Trajectory straight = test::straight_trajectory({0, 0, 1}, {1, 0, 0}, 3.0);

  const std::optional<Time> unsafe = first_unsafe_time(room.map, straight, Time{}, 0.255);

  ASSERT_TRUE(unsafe.has_value());
  EXPECT_EQ(*unsafe, Time(Duration(1750000)));
}

TEST(FirstUnsafeTime, WhatLiesBehindDoesNotCount) {
  SnapshotBuilder builder = open_room();
  builder.set_ball({0, 0, 1}, 0.3, VoxelState::kOccupied);
  const PlanRoom room(std::move(builder));
  const Trajectory straight = test::straight_trajectory({-1, 0, 1}, {1, 0, 0}, 3.0);

  EXPECT_TRUE(first_unsafe_time(room.map, straight, Time{}, 0.25).has_value());
  EXPECT_FALSE(first_unsafe_time(room.map, straight, Time(Duration(1700000)), 0.25).has_value());
}

TEST(FirstUnsafeTime, RestAfterTheEndIsLookedAtAsWell) {
  const PlanRoom room(room_with_wall(2.0));
  const Trajectory into_the_wall = test::straight_trajectory({0, 0, 1}, {1, 0, 0}, 1.8);
  const Time long_after(Duration(60000000));

  EXPECT_EQ(first_unsafe_time(room.map, into_the_wall, long_after, 0.25), long_after);
  EXPECT_FALSE(first_unsafe_time(room.map, into_the_wall, long_after, 0.19).has_value());
}

TEST(FirstUnsafeTime, TimeBeforeTheStartBeginsAtTheStart) {
  const PlanRoom room(room_with_wall(2.0));
  Trajectory straight = test::straight_trajectory({0, 0, 1}, {1, 0, 0}, 3.0);
  straight.start = Time(Duration(5000000));

  EXPECT_EQ(first_unsafe_time(room.map, straight, Time{}, 0.255), Time(Duration(6750000)));
}

Trajectory resting_trajectory() {
  Trajectory trajectory = test::straight_trajectory({0, 0, 1}, {0, 0, 0}, 2.0);
  trajectory.yaw.control_points.assign(8, 0.0);
  return trajectory;
}

TEST(WithinLimits, RestHoldsThem) {
  EXPECT_TRUE(within_limits(resting_trajectory()));
}

TEST(WithinLimits, MotionAtTheEndBreaksThem) {
  EXPECT_FALSE(within_limits(test::straight_trajectory({0, 0, 1}, {0.5, 0, 0}, 2.0)));

  Trajectory turning = resting_trajectory();
  turning.yaw.control_points.back() = 0.01;
  EXPECT_FALSE(within_limits(turning));
}

TEST(WithinLimits, EveryLimitIsLookedAt) {
  Trajectory leap = resting_trajectory();
  leap.position.control_points[8].x() += 0.01;  // 0.07 m/s, 2 m/s2 at most
  Trajectory twist = resting_trajectory();
  twist.yaw.control_points[4] += 0.01;
  ASSERT_FALSE(within_limits(leap)) << "more than 1 m/s2";
  leap.limits = {0.08, 2.1, 0.1, 0.1};
  twist.limits = {0.1, 0.1, 0.08, 2.1};
  ASSERT_TRUE(within_limits(leap));
  ASSERT_TRUE(within_limits(twist));

  leap.limits.speed_mps = 0.04;
  EXPECT_FALSE(within_limits(leap));
  leap.limits = {0.08, 1.9, 0.1, 0.1};
  EXPECT_FALSE(within_limits(leap));
  twist.limits.yaw_rate_radps = 0.04;
  EXPECT_FALSE(within_limits(twist));
  twist.limits = {0.1, 0.1, 0.08, 1.9};
  EXPECT_FALSE(within_limits(twist));
}

Trajectory planned_across(const PlanRoom& room) {
  PlanRequest request = request_along({{-4, 0, 1}, {3, 0, 1}});
  request.goal_yaw_rad = 2.0;
  return room.plan(request).value();
}

// The tests lean on this check: it has to find what is wrong.
TEST(TrajectoryChecks, FindEveryFault) {
  const PlanRoom room(open_room());
  const Trajectory good = planned_across(room);
  const test::TrajectoryRequirements required{
      good.sample(good.start), good.start, good.limits, 0.28};
  ASSERT_EQ(fault_in(good, *room.snapshot, required), "");

  const auto faulty = [&](const test::TrajectoryRequirements& stricter) {
    return !fault_in(good, *room.snapshot, stricter).empty();
  };
  test::TrajectoryRequirements other = required;
  other.start.velocity_mps.z() = 0.001;
  EXPECT_TRUE(faulty(other));
  other = required;
  other.start.yaw_rad += 0.001;
  EXPECT_TRUE(faulty(other));
  other = required;
  other.limits.speed_mps = 1.4;
  EXPECT_TRUE(faulty(other));
  other = required;
  other.limits.acceleration_mps2 = 0.9;
  EXPECT_TRUE(faulty(other));
  other = required;
  other.limits.yaw_rate_radps = 0.8;
  EXPECT_TRUE(faulty(other));

  Trajectory without_end = good;
  without_end.position.control_points.pop_back();
  without_end.position.control_points.pop_back();
  EXPECT_NE(fault_in(without_end, *room.snapshot, required), "");
  SnapshotBuilder builder = open_room();
  const Vector3d half_way_m = good.sample(good.start + good.duration() / 2).position_m;
  builder.set(builder.geometry().index_of(half_way_m + Vector3d(0, 0.28, 0)),
              VoxelState::kUncertain);
  EXPECT_NE(fault_in(good, *builder.build(), required), "");
}

TEST(PlanBrake, StopsAsSoonAsTheLimitsAllow) {
  const PlanRoom room(open_room());
  const Trajectory flown = planned_across(room);
  const Time from = flown.start + duration_from_seconds(2.2);

  const Result<Trajectory, PlanError> brake = room.brake(flown, from);

  ASSERT_TRUE(brake.has_value()) << to_string(brake.error());
  EXPECT_EQ(fault_in(*brake, *room.snapshot, brake_requirements(flown, from, room.config)), "");
  EXPECT_EQ(brake->mode, FlightMode::kBrake);
  const TrajectoryPoint start = flown.sample(from);
  const double speed_mps = start.velocity_mps.norm();
  ASSERT_GT(speed_mps, 1.2);
  EXPECT_LT((end_of(*brake) - start.position_m).norm(), 0.5 * speed_mps * speed_mps + 0.35);
}

// On a circle flown as fast as its limits allow, all acceleration goes into the turn.
TEST(PlanBrake, StopsAsSoonInABend) {
  const PlanRoom room(open_room());
  Trajectory flown = planned_across(room);
  const double speed_mps = 1.4;
  const double radius_m = 1.02 * speed_mps * speed_mps / flown.limits.acceleration_mps2;
  flown.position.control_points.clear();
  for (int i = 0; i < 60; ++i) {
    const double angle_rad = i * flown.position.knot_s * speed_mps / radius_m;
    flown.position.control_points.emplace_back(
        radius_m * std::cos(angle_rad), radius_m * std::sin(angle_rad), 1.0);
  }

  const Time from = flown.start + duration_from_seconds(1.0);
  const Result<Trajectory, PlanError> brake = room.brake(flown, from);

  ASSERT_TRUE(brake.has_value()) << to_string(brake.error());
  EXPECT_EQ(fault_in(*brake, *room.snapshot, brake_requirements(flown, from, room.config)), "");
  EXPECT_LT(brake->position.duration_s(), speed_mps / flown.limits.acceleration_mps2 + 0.7);
}

TEST(PlanBrake, StopsBeforeWhatHasAppearedOnThePath) {
  const Trajectory flown = planned_across(PlanRoom(open_room()));
  const PlanRoom room(room_with_wall(1.0));
  const Time from = flown.start + duration_from_seconds(2.2);

  const Result<Trajectory, PlanError> brake = room.brake(flown, from);

  ASSERT_TRUE(brake.has_value()) << to_string(brake.error());
  EXPECT_EQ(fault_in(*brake, *room.snapshot, brake_requirements(flown, from, room.config)), "");
}

TEST(PlanBrake, SwervesWhenStraightOnIsTooShort) {
  const Trajectory flown = planned_across(PlanRoom(open_room()));
  const Time from = flown.start + duration_from_seconds(2.5);
  const Vector3d here_m = flown.sample(from).position_m;
  SnapshotBuilder builder = open_room();
  builder.set_cylinder({here_m.x() + 1.3, here_m.y() + 0.3}, 0.15, VoxelState::kOccupied);
  const PlanRoom room(std::move(builder));

  const Result<Trajectory, PlanError> brake = room.brake(flown, from);

  ASSERT_TRUE(brake.has_value()) << to_string(brake.error());
  EXPECT_EQ(fault_in(*brake, *room.snapshot, brake_requirements(flown, from, room.config)), "");
  EXPECT_GT(std::abs(end_of(*brake).y()), 0.02);
}

TEST(PlanBrake, WhatCannotBeAvoidedIsNotFlownInto) {
  const Trajectory flown = planned_across(PlanRoom(open_room()));
  const Time from = flown.start + duration_from_seconds(2.2);
  const PlanRoom room(room_with_wall(flown.sample(from).position_m.x() + 0.5));

  const Result<Trajectory, PlanError> brake = room.brake(flown, from);

  ASSERT_FALSE(brake.has_value());
  EXPECT_EQ(brake.error(), PlanError::kUnsafe);
}

TEST(PlanBrake, AtRestStaysWhereItIs) {
  const PlanRoom room(open_room());
  const Trajectory flown = planned_across(room);
  const Time from = flown.end() + duration_from_seconds(3.0);

  const Result<Trajectory, PlanError> brake = room.brake(flown, from);

  ASSERT_TRUE(brake.has_value());
  EXPECT_LT((end_of(*brake) - end_of(flown)).norm(), 1e-9);
}

}  // namespace
}  // namespace understory
