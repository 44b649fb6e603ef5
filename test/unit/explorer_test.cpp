// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Decisions in maps made by hand that a vehicle flies through exactly as told. The map changes only
// where a test changes it: looking at something shows nothing unless it says so.
#include "understory/explorer.hpp"

#include <vector>

#include <gtest/gtest.h>

#include "support/snapshot_builder.hpp"

namespace understory {
namespace {

using test::SnapshotBuilder;

// A hall along x; what is not carved is unknown.
const Box3d kHall(Vector3d(-8.0, -1.0, 0.0), Vector3d(8.0, 1.0, 2.0));

Box3d hall_between(double x_min_m, double x_max_m) {
  return {Vector3d(x_min_m, -1.0, 0.0), Vector3d(x_max_m, 1.0, 2.0)};
}

SnapshotBuilder hall_known_between(double x_min_m, double x_max_m) {
  SnapshotBuilder builder(0.1, kHall);
  builder.set_box(hall_between(x_min_m, x_max_m), VoxelState::kFree);
  return builder;
}

ExplorerConfig quick_to_give_up() {
  ExplorerConfig config;
  config.retry.set_aside_s = 4.0;
  config.retry.max_tries = 2;
  config.retry.patience_s = 5.0;
  return config;
}

struct Flight {
  explicit Flight(SnapshotBuilder map,
                  const ExplorerConfig& config = quick_to_give_up(),
                  const PlanConfig& pilots = {})
      : builder(std::move(map)),
        explorer(config, builder.geometry()),
        pilot(pilots, duration_from_seconds(config.replan.lead_s)) {
    pilot.take_position({0.0, 0.0, 1.0}, 0.0, Time{});
    update_map();
  }

  void update_map() {
    const MapSnapshotPtr snapshot = builder.build();
    pilot.update_map(snapshot);
    explorer.observe(snapshot);
  }
  ExploreStep step() {
    now += Duration(100000);
    return explorer.step(pilot, now);
  }
  // Until nothing is left or, at the latest, so many steps of 0.1 s later.
  bool fly_until_nothing_is_left(int steps) {
    for (int i = 0; i < steps; ++i) {
      if (step().status == ExploreStatus::kNothingLeft) {
        return true;
      }
    }
    return false;
  }
  void fly_until_there_is_a_target(int steps) {
    for (int i = 0; i < steps && !explorer.target(); ++i) {
      step();
    }
  }
  [[nodiscard]] double target_x_m() const {
    return explorer.target()->candidate.cluster->mean_m.x();
  }

  SnapshotBuilder builder;
  Explorer explorer;
  Pilot pilot;
  Time now{};
};

TEST(Explorer, FirstStepFliesToAViewOfTheUnknown) {
  Flight flight(hall_known_between(-2.5, 4.0));

  const ExploreStep step = flight.step();

  EXPECT_TRUE(step.decided);
  EXPECT_EQ(step.status, ExploreStatus::kFlying);
  ASSERT_TRUE(step.published);
  ASSERT_TRUE(flight.explorer.target().has_value());
  const Viewpoint& view = flight.explorer.target()->candidate.viewpoint;
  EXPECT_LT((step.published->sample(step.published->end()).position_m - view.position_m).norm(),
            0.01);
}

TEST(Explorer, NothingIsLeftInARoomThatIsKnownThroughout) {
  Flight flight(hall_known_between(-8.0, 8.0));

  const ExploreStep step = flight.step();

  EXPECT_EQ(step.status, ExploreStatus::kNothingLeft);
  EXPECT_FALSE(step.published);
  EXPECT_EQ(flight.explorer.counters().set_aside, 0U);
}

TEST(Explorer, NothingIsLeftAsSoonAsAllHasBeenSeenAndNotBefore) {
  Flight flight(hall_known_between(-2.5, 4.0));
  for (int i = 0; i < 20; ++i) {
    ASSERT_EQ(flight.step().status, ExploreStatus::kFlying);
  }

  flight.builder.set_box(hall_between(-8.0, 8.0), VoxelState::kFree);
  flight.update_map();

  EXPECT_EQ(flight.step().status, ExploreStatus::kNothingLeft);
  EXPECT_EQ(flight.explorer.counters().set_aside, 0U);
  EXPECT_EQ(flight.explorer.counters().given_up, 0U);
}

TEST(Explorer, TargetThatShowsNothingIsSetAsideForAnotherAndTriedAgainLater) {
  Flight flight(hall_known_between(-4.0, 4.0));
  std::vector<bool> ends;  // which end of the hall is the target, whenever that changes

  for (int i = 0; i < 3000 && flight.step().status != ExploreStatus::kNothingLeft; ++i) {
    if (flight.explorer.target()) {
      const bool is_east = flight.target_x_m() > 0.0;
      if (ends.empty() || ends.back() != is_east) {
        ends.push_back(is_east);
      }
    }
  }

  ASSERT_FALSE(ends.empty());
  const bool first = ends.front();
  EXPECT_EQ(ends, (std::vector<bool>{first, !first, first, !first}));
}

TEST(Explorer, ViewThatShowedNothingIsNotTakenAgain) {
  Flight flight(hall_known_between(-8.0, 3.0));  // one end only
  bool nothing_left = false;

  for (int i = 0; i < 2000 && !nothing_left; ++i) {
    nothing_left = flight.step().status == ExploreStatus::kNothingLeft;
    if (flight.explorer.target()) {
      const Viewpoint& view = flight.explorer.target()->candidate.viewpoint;
      ASSERT_FALSE(flight.explorer.set_aside().is_banned(view)) << to_seconds(flight.now) << " s";
    }
  }

  EXPECT_TRUE(nothing_left);
  EXPECT_EQ(flight.explorer.counters().set_aside, 2U);
  EXPECT_EQ(flight.explorer.counters().given_up, 1U);
}

TEST(Explorer, UnchangingMapComesToAnEndAfterABoundedNumberOfTries) {
  Flight flight(hall_known_between(-4.0, 4.0));
  const std::size_t max_tries = 2;

  EXPECT_TRUE(flight.fly_until_nothing_is_left(3000));

  const std::size_t clusters = flight.explorer.clusters().size();
  EXPECT_GE(clusters, 2U);
  EXPECT_LE(flight.explorer.counters().set_aside, clusters * max_tries);
  EXPECT_TRUE(flight.pilot.is_at_rest(flight.now));
}

TEST(Explorer, NothingLeftStaysSoUntilTheMapChanges) {
  Flight flight(hall_known_between(-8.0, 3.0));
  ASSERT_TRUE(flight.fly_until_nothing_is_left(2000));

  flight.builder.set_box(hall_between(3.0, 6.0), VoxelState::kFree);
  flight.update_map();
  flight.fly_until_there_is_a_target(20);

  ASSERT_TRUE(flight.explorer.target().has_value()) << "a new border of the unknown, 3 m on";
  EXPECT_GT(flight.target_x_m(), 5.5);
}

TEST(Explorer, BorderBehindAWallIsLeftAloneUntilThereIsAWay) {
  SnapshotBuilder builder = hall_known_between(-8.0, 5.0);
  const Box3d wall_m = hall_between(1.5, 1.8);
  builder.set_box(wall_m, VoxelState::kOccupied);
  Flight flight(std::move(builder));

  EXPECT_EQ(flight.step().status, ExploreStatus::kNothingLeft);
  EXPECT_FALSE(flight.explorer.clusters().empty());
  EXPECT_EQ(flight.explorer.counters().set_aside, 0U);
  EXPECT_EQ(flight.pilot.counters().plans, 0U);

  flight.builder.set_box(wall_m, VoxelState::kFree);
  flight.update_map();
  flight.fly_until_there_is_a_target(20);

  ASSERT_TRUE(flight.explorer.target().has_value());
  EXPECT_GT(flight.target_x_m(), 4.5);
}

TEST(Explorer, PlansThatAlwaysFailAreRetriedABoundedNumberOfTimes) {
  PlanConfig too_wide;  // there are routes, but this vehicle does not fit through them
  too_wide.vehicle_radius_m = 0.5;
  SnapshotBuilder builder = hall_known_between(-4.0, 4.0);
  builder.set_box({Vector3d(-8, 0.5, 0), Vector3d(8, 1, 2)}, VoxelState::kOccupied);
  builder.set_box({Vector3d(-8, -1, 0), Vector3d(8, -0.5, 2)}, VoxelState::kOccupied);
  const ExplorerConfig config = quick_to_give_up();
  Flight flight(std::move(builder), config, too_wide);

  EXPECT_TRUE(flight.fly_until_nothing_is_left(600));

  const std::size_t clusters = flight.explorer.clusters().size();
  const PilotCounters& counters = flight.pilot.counters();
  EXPECT_GE(clusters, 1U);
  EXPECT_GE(counters.plans, clusters) << "every one was tried";
  EXPECT_EQ(counters.failed_plans, counters.plans);
  EXPECT_LE(counters.plans, 2 * clusters);
  EXPECT_EQ(flight.explorer.counters().given_up, clusters);
}

TEST(Explorer, ObstacleOnTheWayIsAnsweredAtOnceAndSafely) {
  Flight flight(hall_known_between(-3.0, 7.0));
  while (flight.pilot.follower().sample(flight.now).velocity_mps.norm() < 1.2 &&
         flight.now < Time(std::chrono::seconds(10))) {
    flight.step();
  }
  const TrajectoryPoint here = flight.pilot.follower().sample(flight.now);
  ASSERT_GT(here.velocity_mps.norm(), 1.2);
  const double ahead_m = here.velocity_mps.x() > 0.0 ? 2.3 : -2.6;
  flight.builder.set_box(
      hall_between(here.position_m.x() + ahead_m, here.position_m.x() + ahead_m + 0.3),
      VoxelState::kOccupied);
  flight.update_map();
  ASSERT_TRUE(flight.pilot.unsafe_from(flight.now).has_value());

  const ExploreStep step = flight.step();

  ASSERT_TRUE(step.published);
  EXPECT_EQ(step.status, ExploreStatus::kFlying);
  EXPECT_FALSE(flight.pilot.unsafe_from(flight.now).has_value());
}

TEST(Explorer, RefusesARepulsionWhoseInnerRadiusIsTheOuterOne) {
  ExplorerConfig config;
  config.team.coordination.inner_radius_m = config.team.coordination.outer_radius_m;
  const GridGeometry geometry(0.1, Box3d(Vector3d(0, 0, 0), Vector3d(4, 4, 2)));

  EXPECT_THROW(Explorer(config, geometry), ConfigError);
}

}  // namespace
}  // namespace understory
