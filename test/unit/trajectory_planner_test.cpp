// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/plan/trajectory_planner.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "support/plan_room.hpp"

namespace understory {
namespace {

using test::end_of;
using test::expect_flyable;
using test::fault_in;
using test::open_room;
using test::PlanRoom;
using test::request_along;
using test::requirements_of;
using test::room_with_gap;
using test::room_with_wall;
using test::SnapshotBuilder;

double lowest_speed_mps(const Trajectory& trajectory, double from_s, double to_s) {
  double lowest_mps = std::numeric_limits<double>::infinity();
  const Time last = trajectory.start + duration_from_seconds(to_s);
  for (Time time = trajectory.start + duration_from_seconds(from_s); time <= last;
       time += Duration(10000)) {
    lowest_mps = std::min(lowest_mps, trajectory.sample(time).velocity_mps.norm());
  }
  return lowest_mps;
}

TEST(TrajectoryPlanner, OpenRoomIsCrossedNearlyAsFastAsTheLimitsAllow) {
  const PlanRoom room(open_room());
  const PlanRequest request = request_along({{-3, -2, 1}, {3, 1, 1}});

  const Result<Trajectory, PlanError> planned = room.plan(request);

  expect_flyable(room, request, planned);
  EXPECT_LT((end_of(*planned) - Vector3d(3, 1, 1)).norm(), 1e-6);
  const double length_m = Vector3d(6, 3, 0).norm();
  const double fastest_s = length_m / request.limits.speed_mps +
                           request.limits.speed_mps / request.limits.acceleration_mps2;
  EXPECT_LT(to_seconds(planned->duration()), 1.25 * fastest_s);
}

TEST(TrajectoryPlanner, CarriesStartTimeModeLimitsAndMapStamp) {
  const PlanRoom room(open_room());
  PlanRequest request = request_along({{-3, 0, 1}, {0, 0, 1}});
  request.mode = FlightMode::kCollector;
  request.limits.speed_mps = 3.0;

  const Result<Trajectory, PlanError> planned = room.plan(request);

  ASSERT_TRUE(planned.has_value());
  EXPECT_EQ(planned->start, request.start_time);
  EXPECT_EQ(planned->mode, FlightMode::kCollector);
  EXPECT_EQ(planned->limits.speed_mps, 3.0);
  EXPECT_EQ(planned->depth_stamp, room.snapshot->stamp);
}

TEST(TrajectoryPlanner, CorridorIsFlownNearItsMiddle) {
  SnapshotBuilder builder = open_room();
  builder.set_box({Vector3d(-4, 0.5, 0), Vector3d(4, 6, 2)}, VoxelState::kOccupied);
  builder.set_box({Vector3d(-4, -6, 0), Vector3d(4, -0.5, 2)}, VoxelState::kOccupied);
  const PlanRoom room(std::move(builder));
  // The route hugs one wall as closely as it may.
  const PlanRequest request = request_along({{-5, 0, 1}, {-3.5, 0.2, 1}, {3.5, 0.2, 1}, {5, 0, 1}});

  const Result<Trajectory, PlanError> planned = room.plan(request);

  expect_flyable(room, request, planned);
  const Time half_way = planned->start + planned->duration() / 2;
  EXPECT_LT(std::abs(planned->sample(half_way).position_m.y()), 0.15);
}

TEST(TrajectoryPlanner, GapThatIsWideEnoughIsFlownThrough) {
  const PlanRoom room(room_with_gap(0.8));
  const PlanRequest request = request_along({{-3, 1, 1}, {-0.8, 0, 1}, {0.8, 0, 1}, {3, -1, 1}});

  const Result<Trajectory, PlanError> planned = room.plan(request);

  expect_flyable(room, request, planned);
  EXPECT_LT((end_of(*planned) - Vector3d(3, -1, 1)).norm(), 1e-6);
}

TEST(TrajectoryPlanner, GapThatIsTooNarrowIsRefused) {
  const PlanRoom room(room_with_gap(0.4));

  const Result<Trajectory, PlanError> planned =
      room.plan(request_along({{-3, 0, 1}, {0, 0, 1}, {3, 0, 1}}));

  ASSERT_FALSE(planned.has_value());
  EXPECT_EQ(planned.error(), PlanError::kUnsafe);
}

TEST(TrajectoryPlanner, RouteThroughUnknownSpaceIsRefused) {
  SnapshotBuilder builder = open_room();
  builder.set_box({Vector3d(-0.5, -6, 0), Vector3d(0.5, 6, 2)}, VoxelState::kUnknown);
  const PlanRoom room(std::move(builder));

  const Result<Trajectory, PlanError> planned = room.plan(request_along({{-3, 0, 1}, {3, 0, 1}}));

  ASSERT_FALSE(planned.has_value());
  EXPECT_EQ(planned.error(), PlanError::kUnsafe);
}

TEST(TrajectoryPlanner, SingleUncertainVoxelOnTheRouteIsFlownAround) {
  SnapshotBuilder builder = open_room();
  builder.set(builder.geometry().index_of({0.05, 0.05, 1.05}), VoxelState::kUncertain);
  const PlanRoom room(std::move(builder));
  const PlanRequest request = request_along({{-3, 0, 1}, {3, 0, 1}});

  const Result<Trajectory, PlanError> planned = room.plan(request);

  expect_flyable(room, request, planned);
}

TEST(TrajectoryPlanner, BlockedGoalIsReportedAsSuch) {
  const PlanRoom room(room_with_wall(2.0));

  const Result<Trajectory, PlanError> planned = room.plan(request_along({{-3, 0, 1}, {1.8, 0, 1}}));

  ASSERT_FALSE(planned.has_value());
  EXPECT_EQ(planned.error(), PlanError::kGoalBlocked);
}

TEST(TrajectoryPlanner, BlockedStartIsReportedAsSuch) {
  const PlanRoom room(room_with_wall(2.0));

  const Result<Trajectory, PlanError> planned = room.plan(request_along({{2.5, 0, 1}, {-3, 0, 1}}));

  ASSERT_FALSE(planned.has_value());
  EXPECT_EQ(planned.error(), PlanError::kStartBlocked);
}

TEST(TrajectoryPlanner, StartThatIsCloserThanTheMarginFindsItsWayOut) {
  const PlanRoom room(room_with_wall(2.0));
  const PlanRequest request = request_along({{1.77, 0, 1}, {-2, 0, 1}});

  const Result<Trajectory, PlanError> planned = room.plan(request);

  ASSERT_TRUE(planned.has_value()) << to_string(planned.error());
  test::TrajectoryRequirements required = requirements_of(request, room.config);
  required.radius_m = 0.20;
  EXPECT_EQ(fault_in(*planned, *room.snapshot, required), "");
  EXPECT_LT((end_of(*planned) - Vector3d(-2, 0, 1)).norm(), 1e-6);
}

TEST(TrajectoryPlanner, RequestWithoutRouteOrWithNotANumberIsRefused) {
  const PlanRoom room(open_room());
  PlanRequest empty = request_along({{0, 0, 1}});
  empty.route_m.clear();
  PlanRequest odd_goal = request_along({{0, 0, 1}, {1, 0, 1}});
  odd_goal.route_m.back().x() = std::numeric_limits<double>::quiet_NaN();
  PlanRequest odd_start = request_along({{0, 0, 1}, {1, 0, 1}});
  odd_start.start.velocity_mps.y() = std::numeric_limits<double>::infinity();

  for (const PlanRequest& request : {empty, odd_goal, odd_start}) {
    const Result<Trajectory, PlanError> planned = room.plan(request);
    ASSERT_FALSE(planned.has_value());
    EXPECT_EQ(planned.error(), PlanError::kNoRoute);
  }
}

TEST(TrajectoryPlanner, MotionTowardsAWallIsTurnedAroundInTime) {
  const PlanRoom room(room_with_wall(3.0));
  PlanRequest request = request_along({{0, 0, 1}, {-4, 0, 1}});
  request.start.velocity_mps = {1.4, 0.0, 0.0};

  const Result<Trajectory, PlanError> planned = room.plan(request);

  expect_flyable(room, request, planned);
  EXPECT_LT((end_of(*planned) - Vector3d(-4, 0, 1)).norm(), 1e-6);
}

TEST(TrajectoryPlanner, MotionThatCannotBeStoppedBeforeAWallIsRefused) {
  const PlanRoom room(room_with_wall(1.0));
  PlanRequest request = request_along({{0, 0, 1}, {-4, 0, 1}});
  request.start.velocity_mps = {1.4, 0.0, 0.0};

  EXPECT_FALSE(room.plan(request).has_value());
}

TEST(TrajectoryPlanner, MotionAlongTheRouteIsKept) {
  const PlanRoom room(open_room());
  PlanRequest request = request_along({{-4, 0, 1}, {3, 0, 1}});
  request.start.velocity_mps = {1.4, 0.0, 0.0};

  const Result<Trajectory, PlanError> planned = room.plan(request);

  expect_flyable(room, request, planned);
  EXPECT_GT(lowest_speed_mps(*planned, 0.0, 3.0), 1.1);
}

TEST(TrajectoryPlanner, YawRateAndAccelerationOfTheStartAreContinued) {
  const PlanRoom room(open_room());
  for (const double yaw_rate_radps : {-0.9, -0.3, 0.5, 0.9}) {
    PlanRequest request = request_along({{-3, 0, 1}, {3, 0, 1}});
    request.start.yaw_rad = 2.5;
    request.start.yaw_rate_radps = yaw_rate_radps;
    request.start.yaw_acceleration_radps2 = -yaw_rate_radps;
    request.goal_yaw_rad = -2.0;

    const Result<Trajectory, PlanError> planned = room.plan(request);

    expect_flyable(room, request, planned);
    const double end_rad = planned->sample(planned->end()).yaw_rad;
    EXPECT_NEAR(angle_difference(end_rad, -2.0), 0.0, 1e-6) << yaw_rate_radps;
  }
}

TEST(TrajectoryPlanner, TurnOfHalfACircleOnTheSpotMovesNothingElse) {
  const PlanRoom room(open_room());
  PlanRequest request = request_along({{1, 1, 1}});
  request.start.yaw_rad = 0.5;
  request.goal_yaw_rad = 0.5 + kPi;

  const Result<Trajectory, PlanError> planned = room.plan(request);

  expect_flyable(room, request, planned);
  for (Time time = planned->start; time < planned->end(); time += Duration(10000)) {
    ASSERT_LT((planned->sample(time).position_m - Vector3d(1, 1, 1)).norm(), 1e-9);
  }
  EXPECT_NEAR(std::abs(planned->sample(planned->end()).yaw_rad - 0.5), kPi, 1e-6);
  const double fastest_s = kPi / request.limits.yaw_rate_radps +
                           request.limits.yaw_rate_radps / request.limits.yaw_acceleration_radps2;
  EXPECT_LT(to_seconds(planned->duration()), fastest_s + 0.5);
}

TEST(TrajectoryPlanner, GoalThatIsTheStartIsAShortRest) {
  const PlanRoom room(open_room());
  const PlanRequest request = request_along({{1, 1, 1}, {1, 1, 1}});

  const Result<Trajectory, PlanError> planned = room.plan(request);

  expect_flyable(room, request, planned);
  EXPECT_LT(to_seconds(planned->duration()), 1.0);
}

TEST(TrajectoryPlanner, GoalThatIsTheStartIsComeBackToFromMotion) {
  const PlanRoom room(open_room());
  PlanRequest request = request_along({{1, 1, 1}, {1, 1, 1}});
  request.start.velocity_mps = {0.0, -1.2, 0.1};

  const Result<Trajectory, PlanError> planned = room.plan(request);

  expect_flyable(room, request, planned);
  EXPECT_LT((end_of(*planned) - Vector3d(1, 1, 1)).norm(), 1e-6);
}

TEST(TrajectoryPlanner, RouteBeyondTheHorizonIsFlownInPieces) {
  const PlanRoom room(open_room());
  const PlanRequest request = request_along({{-5, -5, 1}, {-5, 5, 1}, {5, 5, 1}});

  const Result<Trajectory, PlanError> planned = room.plan(request);

  expect_flyable(room, request, planned);
  const double reached_m = (end_of(*planned) - Vector3d(-5, -5, 1)).norm();
  EXPECT_LE(reached_m, room.config.horizon_m + 0.01);
  EXPECT_GT(reached_m, 0.8 * room.config.horizon_m);
}

TEST(TrajectoryPlanner, StartFasterThanTheLimitsIsSlowedDown) {
  const PlanRoom room(open_room());
  PlanRequest request = request_along({{-5, 0, 1}, {2, 0, 1}});
  request.start.velocity_mps = {2.6, 0.0, 0.0};

  const Result<Trajectory, PlanError> planned = room.plan(request);

  expect_flyable(room, request, planned);
  EXPECT_LT(planned->sample(planned->start + duration_from_seconds(2.5)).velocity_mps.norm(), 1.51);
}

// The optimiser alone once came back with 77 s for such a start.
TEST(TrajectoryPlanner, FastFlightTheOtherWayTakesNoLongerThanStoppingAndBeginningAnew) {
  const PlanRoom scene(open_room());
  for (int degrees = 90; degrees <= 270; degrees += 15) {
    const double direction_rad = degrees * kPi / 180.0;
    PlanRequest request = request_along({{0.0, 0.0, 1.0}, {5.0, 0.0, 1.0}});
    request.start.velocity_mps =
        2.5 * Vector3d(std::cos(direction_rad), std::sin(direction_rad), 0.0);
    request.limits.speed_mps = 1.5;
    request.limits.acceleration_mps2 = 1.0;

    const Result<Trajectory, PlanError> planned = scene.plan(request);

    expect_flyable(scene, request, planned);
    const double stop_s = 2.5 / 1.0;
    const double back_and_on_s = (5.0 + 0.5 * 2.5 * stop_s) / 1.5 + 1.5 / 1.0;
    EXPECT_LT(planned->position.duration_s(), 1.3 * (stop_s + back_and_on_s) + 2.0) << degrees;
  }
}

TEST(TrajectoryPlanner, SameRequestGivesTheSameTrajectory) {
  const PlanRoom room(room_with_gap(0.8));
  const PlanRequest request = request_along({{-3, 1, 1}, {-0.8, 0, 1}, {0.8, 0, 1}, {3, -1, 1}});

  const Result<Trajectory, PlanError> first = room.plan(request);
  const Result<Trajectory, PlanError> second = room.plan(request);

  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->position.control_points, second->position.control_points);
  EXPECT_EQ(first->yaw.control_points, second->yaw.control_points);
}

}  // namespace
}  // namespace understory
