// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/plan/coarse_routes.hpp"

#include <limits>

#include <gtest/gtest.h>

#include "support/snapshot_builder.hpp"

namespace understory {
namespace {

using test::SnapshotBuilder;

const Box3d kBox(Vector3d(-12.0, -12.0, 0.0), Vector3d(12.0, 12.0, 2.0));
const Vector3d kWest(-6.0, 0.0, 1.0);
const Vector3d kEast(6.0, 0.0, 1.0);
constexpr double kAnyLength = std::numeric_limits<double>::infinity();

// A wall across the box with a gap of this width in its south.
std::optional<double> length_through(double gap_m, double max_length_m = kAnyLength) {
  SnapshotBuilder builder(0.10, kBox);
  builder.fill(VoxelState::kFree);
  builder.set_box({Vector3d(-0.1, -8.0 + gap_m, 0.0), Vector3d(0.1, 12.0, 2.0)},
                  VoxelState::kOccupied);
  builder.set_box({Vector3d(-0.1, -12.0, 0.0), Vector3d(0.1, -8.0, 2.0)}, VoxelState::kOccupied);
  ClearanceMap map;
  map.update(builder.build());
  CoarseRoutes routes(builder.geometry(), 0.3);
  return routes.lengths_m(map, kWest, {routes.entry_of(map, kEast)}, max_length_m).front();
}

TEST(CoarseRoutes, GoThroughTheGapInAWall) {
  const double through_the_gap_m = 2.0 * std::hypot(6.0, 7.0);

  const std::optional<double> length_m = length_through(2.0);

  ASSERT_TRUE(length_m.has_value());
  EXPECT_GT(*length_m, through_the_gap_m - 1.0);
  EXPECT_LT(*length_m, 1.1 * through_the_gap_m);
}

TEST(CoarseRoutes, FindNoWayThroughWhatTheBallDoesNotFit) {
  EXPECT_FALSE(length_through(0.5).has_value());
}

TEST(CoarseRoutes, FindNoWayThatIsLongerThanAskedFor) {
  EXPECT_FALSE(length_through(2.0, 17.0).has_value());
  EXPECT_TRUE(length_through(2.0, 21.0).has_value());
}

TEST(CoarseRoutes, EnterAtTheNearestFreeNode) {
  SnapshotBuilder builder(0.10, kBox);
  builder.fill(VoxelState::kFree);
  builder.set_box({Vector3d(2.0, -0.2, 0.0), Vector3d(2.4, 0.2, 2.0)}, VoxelState::kOccupied);
  ClearanceMap map;
  map.update(builder.build());
  CoarseRoutes routes(builder.geometry(), 0.3);
  const RouteLattice::Node nowhere(-1, -1, -1);
  const RouteLattice::Node inside_the_trunk = routes.entry_of(map, {2.2, 0.0, 1.0});
  EXPECT_NE(inside_the_trunk, nowhere);

  const std::vector<std::optional<double>> lengths_m =
      routes.lengths_m(map, Vector3d(0.0, 0.0, 1.0), {inside_the_trunk, nowhere}, kAnyLength);

  ASSERT_TRUE(lengths_m[0].has_value());
  EXPECT_NEAR(*lengths_m[0], 2.2, 1.0);
  EXPECT_FALSE(lengths_m[1].has_value());
}

}  // namespace
}  // namespace understory
