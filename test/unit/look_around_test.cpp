// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/plan/look_around.hpp"

#include <gtest/gtest.h>

#include "support/plan_room.hpp"
#include "understory/base/rng.hpp"

namespace understory {
namespace {

using test::expect_flyable;
using test::fault_in;
using test::open_room;
using test::PlanRoom;
using test::request_along;
using test::requirements_of;
using test::room_with_wall;

constexpr double kFieldRad = 0.69;  // half of the camera's

PlanRequest eastbound() {
  PlanRequest request = request_along({{-5, 0, 1}, {5, 0, 1}});
  request.goal_yaw_rad = 0.3;
  return request;
}

bool is_seen(const Trajectory& flown, const Vector3d& at_m, double range_m = 4.5) {
  for (Time time = flown.start; time <= flown.end(); time += Duration(66000)) {
    const TrajectoryPoint point = flown.sample(time);
    const Vector3d line_m = at_m - point.position_m;
    const double bearing_rad = std::atan2(line_m.y(), line_m.x());
    if (line_m.norm() <= range_m &&
        std::abs(angle_difference(bearing_rad, point.yaw_rad)) <= kFieldRad) {
      return true;
    }
  }
  return false;
}

bool is_worth_turning(const PlanRoom& room,
                      const std::vector<Sight>& sights,
                      const Trajectory& way) {
  const LookConfig config;
  return looking_yaw(seen_on_the_way(room.map, sights, way, config), way, config).has_value();
}

TEST(LookAround, SeesWhatLiesToEitherSideOfTheWay) {
  const PlanRoom room(open_room());
  PlanRequest request = eastbound();
  for (const double side_m : {3.5, -3.5}) {
    const Vector3d at_m(1.0, side_m, 1.0);
    request.sights = {};
    EXPECT_FALSE(is_seen(*room.plan(request), at_m, 4.0)) << "the test is about something";
    request.sights = {{at_m, 1.0}};

    const Result<Trajectory, PlanError> planned = room.plan(request);

    expect_flyable(room, request, planned);
    EXPECT_TRUE(is_seen(*planned, at_m, 4.0)) << side_m;
  }
}

TEST(LookAround, TakesNoLongerAndEndsWhereItMust) {
  const PlanRoom room(open_room());
  PlanRequest request = eastbound();
  const Result<Trajectory, PlanError> straight = room.plan(request);
  request.sights = {{{0.0, -3.0, 1.0}, 1.0}};

  const Result<Trajectory, PlanError> looking = room.plan(request);

  EXPECT_NE(looking->yaw.control_points, straight->yaw.control_points);
  EXPECT_EQ(looking->duration(), straight->duration());
  EXPECT_EQ(looking->position.control_points, straight->position.control_points);
  const TrajectoryPoint end = looking->sample(looking->end());
  EXPECT_NEAR(angle_difference(end.yaw_rad, 0.3), 0.0, 1e-9);
  EXPECT_NEAR(end.yaw_rate_radps, 0.0, 1e-9);
}

TEST(LookAround, DoesNothingWhereNothingIsToBeSeen) {
  const PlanRoom open(open_room());
  const PlanRoom walled(room_with_wall(4.0));
  const PlanRequest request = request_along({{-5, 0, 1}, {2, 0, 1}});
  const Trajectory open_way = *open.plan(request);
  const Trajectory walled_way = *walled.plan(request);
  const Sight behind_the_wall{{5.0, 0.0, 1.0}, 1.0};
  const Sight far{{-5.0, 5.9, 1.0}, 1.0};

  EXPECT_FALSE(is_worth_turning(open, {}, open_way));
  EXPECT_FALSE(is_worth_turning(walled, {behind_the_wall}, walled_way));
  EXPECT_FALSE(is_worth_turning(open, {far}, open_way));
  EXPECT_TRUE(is_worth_turning(open, {behind_the_wall}, open_way));
}

TEST(LookAround, HasNoTimeOnAShortWay) {
  const PlanRoom room(open_room());
  const Trajectory way = *room.plan(request_along({{0, 0, 1}, {0.05, 0, 1}}));

  EXPECT_FALSE(is_worth_turning(room, {{{0, 3, 1}, 1.0}}, way));
}

TEST(LookAround, CanBeSwitchedOff) {
  PlanRoom room(open_room());
  PlanRequest request = eastbound();
  const Result<Trajectory, PlanError> straight = room.plan(request);
  room.config.look.is_on = false;
  request.sights = {{{0.0, -3.0, 1.0}, 1.0}};

  EXPECT_EQ(room.plan(request)->yaw.control_points, straight->yaw.control_points);
}

TEST(LookAround, HoldsAllLimitsWhateverThereIsToSee) {
  const PlanRoom room(open_room());
  Rng rng(9);
  int turned = 0;
  for (int i = 0; i < 300; ++i) {
    const auto anywhere = [&rng] {
      return Vector3d(rng.uniform(-5.0, 5.0), rng.uniform(-5.0, 5.0), rng.uniform(0.5, 1.5));
    };
    PlanRequest request = request_along({anywhere(), anywhere()});
    request.start.yaw_rad = rng.uniform(-3.0, 3.0);
    request.start.yaw_rate_radps = rng.uniform(-0.8, 0.8);
    request.goal_yaw_rad = rng.uniform(-3.0, 3.0);
    const Result<Trajectory, PlanError> straight = room.plan(request);
    for (int sight = 0; sight < 10; ++sight) {
      request.sights.push_back({anywhere(), rng.uniform(0.1, 10.0)});
    }

    const Result<Trajectory, PlanError> planned = room.plan(request);

    ASSERT_EQ(planned.has_value(), straight.has_value()) << i;
    if (planned) {
      ASSERT_EQ(fault_in(*planned, *room.snapshot, requirements_of(request, room.config)), "") << i;
      turned += planned->yaw.control_points != straight->yaw.control_points ? 1 : 0;
    }
  }
  EXPECT_GT(turned, 50);
}

}  // namespace
}  // namespace understory
