// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/plan/route_search.hpp"

#include <gtest/gtest.h>

#include "support/snapshot_builder.hpp"

namespace understory {
namespace {

using test::brute_force_clearance_m;
using test::SnapshotBuilder;

const Box3d kBox(Vector3d(-6.0, -6.0, 0.0), Vector3d(6.0, 6.0, 2.0));
constexpr double kClearanceM = 0.32;
constexpr double kEndlessM = 1e9;

TEST(RouteSearch, StraightRouteInFreeSpaceHasItsLength) {
  SnapshotBuilder builder(0.10, kBox);
  ClearanceMap map;
  map.update(builder.fill(VoxelState::kFree).build());
  RouteSearch routes(builder.geometry(), kClearanceM);
  const RouteLattice::Node from = routes.lattice().nearest({-4, 0, 1});
  const RouteLattice::Node to = routes.lattice().nearest({4, 0, 1});

  routes.run(map, routes.lattice().point_of(from), {to}, kEndlessM);

  ASSERT_TRUE(routes.length_m(to).has_value());
  EXPECT_NEAR(*routes.length_m(to), 8.0, 1e-6);
  EXPECT_EQ(routes.route_m(to).front(), routes.lattice().point_of(from));
  EXPECT_EQ(routes.route_m(to).back(), routes.lattice().point_of(to));
}

TEST(RouteSearch, TargetsBeyondTheLimitOrBehindWallsAreNotReached) {
  SnapshotBuilder builder(0.10, kBox);
  ClearanceMap map;
  map.update(builder.fill(VoxelState::kFree)
                 .set_box({Vector3d(2, -6, 0), Vector3d(2.2, 6, 2)}, VoxelState::kOccupied)
                 .build());
  RouteSearch routes(builder.geometry(), kClearanceM);
  const RouteLattice::Node far = routes.lattice().nearest({-4, 0, 1});
  const RouteLattice::Node behind = routes.lattice().nearest({4, 0, 1});

  routes.run(map, {0, 0, 1}, {far, behind}, 3.0);
  EXPECT_FALSE(routes.length_m(far).has_value());
  routes.run(map, {0, 0, 1}, {far, behind}, kEndlessM);

  EXPECT_TRUE(routes.length_m(far).has_value());
  EXPECT_FALSE(routes.length_m(behind).has_value());
  EXPECT_TRUE(routes.route_m(behind).empty());
}

TEST(RouteSearch, LeadsAroundBarriersAndNotIntoThem) {
  SnapshotBuilder builder(0.10, kBox);
  ClearanceMap map;
  map.update(builder.fill(VoxelState::kFree).build());
  RouteSearch routes(builder.geometry(), kClearanceM);
  const RouteLattice::Node beyond = routes.lattice().nearest({4, 0, 1});
  const RouteLattice::Node inside = routes.lattice().nearest({0, 0.5, 1});
  const Barrier barrier{Vector3d(0.0, 0.0, 1.0), 1.5};
  routes.avoid({barrier});

  routes.run(map, {-4, 0, 1}, {beyond, inside}, kEndlessM);

  EXPECT_FALSE(routes.length_m(inside).has_value());
  ASSERT_TRUE(routes.length_m(beyond).has_value());
  for (const Vector3d& at_m : routes.route_m(beyond)) {
    EXPECT_GE((at_m - barrier.position_m).norm(), barrier.radius_m);
  }
  routes.avoid({});
  routes.run(map, {-4, 0, 1}, {beyond, inside}, kEndlessM);
  EXPECT_TRUE(routes.length_m(inside).has_value());
}

TEST(RouteSearch, RoutesKeepTheirClearanceInRandomForests) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Rng rng(seed);
    test::RandomForest forest;
    SnapshotBuilder builder = random_forest(forest, rng);
    ClearanceMap map;
    const MapSnapshotPtr snapshot = builder.build();
    map.update(snapshot);
    RouteSearch routes(builder.geometry(), kClearanceM);
    const RouteLattice::Node to = routes.lattice().nearest({6.5, 6.5, 1});

    routes.run(map, {-6.5, -6.5, 1}, {to}, kEndlessM);

    const std::vector<Vector3d> route = routes.route_m(to);
    for (std::size_t i = 2; i < route.size(); ++i) {
      EXPECT_GT(brute_force_clearance_m(*snapshot, route[i], 1.0), kClearanceM) << "seed " << seed;
      EXPECT_GT(brute_force_clearance_m(*snapshot, 0.5 * (route[i] + route[i - 1]), 1.0), 0.24)
          << "seed " << seed;
    }
  }
}

// Searched together up to a limit, which leaves out what leads to none of them in time.
TEST(RouteSearch, LimitChangesNoRouteThatIsShorter) {
  constexpr double kLimitM = 7.0;
  std::size_t reached = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Rng rng(seed);
    test::RandomForest forest;
    SnapshotBuilder builder = random_forest(forest, rng);
    ClearanceMap map;
    map.update(builder.build());
    RouteSearch limited(builder.geometry(), kClearanceM);
    RouteSearch endless(builder.geometry(), kClearanceM);
    std::vector<RouteLattice::Node> targets;
    for (int i = 0; i < 12; ++i) {
      targets.push_back(limited.lattice().nearest(
          {rng.uniform(-6.5, 6.5), rng.uniform(-6.5, 6.5), rng.uniform(0.2, 1.8)}));
    }
    const Vector3d start(rng.uniform(-6.5, 6.5), rng.uniform(-6.5, 6.5), 1.0);

    limited.run(map, start, targets, kLimitM);
    endless.run(map, start, targets, kEndlessM);

    for (const RouteLattice::Node& target : targets) {
      const bool is_near = endless.length_m(target).value_or(kEndlessM) <= kLimitM;
      reached += is_near ? 1U : 0U;
      ASSERT_EQ(limited.length_m(target).has_value(), is_near) << "seed " << seed;
      if (is_near) {
        EXPECT_EQ(*limited.length_m(target), *endless.length_m(target)) << "seed " << seed;
        EXPECT_EQ(limited.route_m(target), endless.route_m(target)) << "seed " << seed;
      }
    }
  }
  EXPECT_GT(reached, 50U);
}

TEST(RouteSearch, LengthIsAtMostEightPercentAboveTheStraightLineInTheOpen) {
  SnapshotBuilder builder(0.10, kBox);
  ClearanceMap map;
  map.update(builder.fill(VoxelState::kFree).build());
  RouteSearch routes(builder.geometry(), kClearanceM);
  std::vector<RouteLattice::Node> targets;
  for (int step = 0; step < 63; ++step) {
    const double angle_rad = 0.1 * step;
    targets.push_back(
        routes.lattice().nearest({5.0 * std::cos(angle_rad), 5.0 * std::sin(angle_rad), 0.95}));
  }
  const Vector3d start = routes.lattice().point_of(routes.lattice().nearest({0, 0, 0.95}));

  routes.run(map, start, targets, kEndlessM);

  for (const RouteLattice::Node& target : targets) {
    const double straight_m = (routes.lattice().point_of(target) - start).norm();
    ASSERT_TRUE(routes.length_m(target).has_value());
    EXPECT_GE(*routes.length_m(target), 0.985 * straight_m);
    EXPECT_LE(*routes.length_m(target), 1.085 * straight_m);
  }
}

TEST(RouteSearch, StartTooCloseToSomethingStillFindsAWayOut) {
  SnapshotBuilder builder(0.10, kBox);
  ClearanceMap map;
  map.update(
      builder.fill(VoxelState::kFree).set_cylinder({0.0, 0.0}, 0.2, VoxelState::kOccupied).build());
  RouteSearch routes(builder.geometry(), kClearanceM);
  const RouteLattice::Node to = routes.lattice().nearest({4, 0, 1});

  routes.run(map, {0.42, 0.0, 1.0}, {to}, kEndlessM);

  EXPECT_TRUE(routes.length_m(to).has_value());
}

}  // namespace
}  // namespace understory
