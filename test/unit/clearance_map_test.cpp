// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/plan/clearance_map.hpp"

#include <gtest/gtest.h>

#include "support/snapshot_builder.hpp"

namespace understory {
namespace {

constexpr int kSaturated = ClearanceMap::kReachVoxels * ClearanceMap::kReachVoxels;

int brute_force_square(const MapSnapshot& map, const VoxelIndex& voxel) {
  int nearest = kSaturated;
  constexpr int kReach = ClearanceMap::kReachVoxels;
  for (int dz = -kReach; dz <= kReach; ++dz) {
    for (int dy = -kReach; dy <= kReach; ++dy) {
      for (int dx = -kReach; dx <= kReach; ++dx) {
        const VoxelIndex offset(dx, dy, dz);
        if (offset.squaredNorm() < nearest && !map.is_free(voxel + offset)) {
          nearest = offset.squaredNorm();
        }
      }
    }
  }
  return nearest;
}

// Sparse single voxels, so that distances of all sizes occur, in a box that no tile fits.
test::SnapshotBuilder random_map(Rng& rng) {
  test::SnapshotBuilder builder(0.1, Box3d(Vector3d(-2.1, -0.7, 0.3), Vector3d(1.9, 2.6, 2.2)));
  builder.fill(VoxelState::kFree);
  const VoxelBox box = builder.geometry().voxels();
  const auto draw = [&](int axis) {
    return box.min[axis] +
           static_cast<int>(rng.below(static_cast<std::uint64_t>(box.size()[axis])));
  };
  const std::uint64_t count = rng.below(40);
  for (std::uint64_t i = 0; i < count; ++i) {
    const int x = draw(0);
    const int y = draw(1);
    const auto state = static_cast<VoxelState>(rng.below(4));
    builder.set({x, y, draw(2)}, state);
  }
  return builder;
}

void expect_exact(const ClearanceMap& clearance, const MapSnapshot& map, Rng& rng) {
  const VoxelBox box = map.geometry.voxels();
  for (int i = 0; i < 500; ++i) {
    VoxelIndex voxel;
    for (int axis = 0; axis < 3; ++axis) {
      const int choices = box.size()[axis] + 4;
      voxel[axis] =
          box.min[axis] - 2 + static_cast<int>(rng.below(static_cast<std::uint64_t>(choices)));
    }
    ASSERT_EQ(clearance.squared_distance_voxels(voxel), brute_force_square(map, voxel))
        << voxel.transpose();
  }
}

TEST(ClearanceMap, SquaredDistancesAreExactOnRandomMaps) {
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    SCOPED_TRACE(seed);
    Rng rng(seed);
    const MapSnapshotPtr map = random_map(rng).build();

    ClearanceMap clearance;
    clearance.update(map);

    expect_exact(clearance, *map, rng);
  }
}

TEST(ClearanceMap, SquaredDistancesStayExactWhileTheMapChanges) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    SCOPED_TRACE(seed);
    Rng rng(seed);
    test::SnapshotBuilder builder = random_map(rng);
    ClearanceMap clearance;
    clearance.update(builder.build());

    for (int step = 0; step < 10; ++step) {
      const Vector3d center(rng.uniform(-2.1, 1.9), rng.uniform(-0.7, 2.6), rng.uniform(0.3, 2.2));
      builder.set_ball(center, rng.uniform(0.05, 0.4), static_cast<VoxelState>(rng.below(4)));
      const MapSnapshotPtr map = builder.build();
      clearance.update(map);

      expect_exact(clearance, *map, rng);
    }
  }
}

TEST(ClearanceMap, BallTestAgreesWithTheDistanceToEveryVoxel) {
  int touching = 0;
  int clear = 0;
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE(seed);
    Rng rng(seed);
    const MapSnapshotPtr map = random_map(rng).build();
    ClearanceMap clearance;
    clearance.update(map);

    for (int i = 0; i < 300; ++i) {
      const Vector3d point(rng.uniform(-2.3, 2.1), rng.uniform(-0.9, 2.8), rng.uniform(0.1, 2.4));
      const double radius = rng.uniform(0.0, 0.59);
      const double exact = test::brute_force_clearance_m(*map, point, 0.7);
      if (std::abs(exact - radius) < 1e-9) {
        continue;
      }
      ASSERT_EQ(clearance.clearance_at_least(point, radius), exact > radius)
          << point.transpose() << " radius " << radius << " exact " << exact;
      ++(exact > radius ? clear : touching);
    }
  }
  EXPECT_GT(touching, 1000);
  EXPECT_GT(clear, 1000);
}

TEST(ClearanceMap, BallThatOnlyTouchesAVoxelIsNotClear) {
  test::SnapshotBuilder builder(0.5, Box3d(Vector3d::Zero(), Vector3d::Constant(20.0)));
  builder.fill(VoxelState::kFree).set({20, 20, 20}, VoxelState::kOccupied);
  ClearanceMap clearance;
  clearance.update(builder.build());

  EXPECT_FALSE(clearance.clearance_at_least({9.0, 10.25, 10.25}, 1.0));
  EXPECT_TRUE(clearance.clearance_at_least({9.0, 10.25, 10.25}, 0.999999));
  EXPECT_FALSE(clearance.clearance_at_least({11.5, 10.25, 10.25}, 1.0));
}

TEST(ClearanceMap, DistanceOnTheAxisOfAWallIsTheDistanceToItsFace) {
  test::SnapshotBuilder builder(0.1, Box3d(Vector3d::Constant(-2.0), Vector3d::Constant(2.0)));
  builder.fill(VoxelState::kFree)
      .set_box({Vector3d(1.0, -2.0, -2.0), Vector3d(2.0, 2.0, 2.0)}, VoxelState::kUnknown);
  ClearanceMap clearance;
  clearance.update(builder.build());

  for (const double x : {0.31, 0.5, 0.72, 0.94}) {
    const DistanceAndGradient found = clearance.distance_and_gradient({x, 0.0, 0.0});
    EXPECT_NEAR(found.distance_m, 1.0 - x, 1e-6);
    EXPECT_NEAR(found.gradient.x(), -1.0, 1e-5);
  }
  const DistanceAndGradient far = clearance.distance_and_gradient({-0.5, 0.0, 0.0});
  EXPECT_NEAR(far.distance_m, clearance.max_distance_m() - 0.05, 1e-6);
  EXPECT_EQ(far.gradient, Vector3d(Vector3d::Zero()));
}

TEST(ClearanceMap, GradientIsTheDerivativeOfTheDistance) {
  Rng rng(5);
  const MapSnapshotPtr map = random_map(rng).build();
  ClearanceMap clearance;
  clearance.update(map);
  constexpr double kStep = 1e-5;

  int compared = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vector3d point(rng.uniform(-2.0, 1.8), rng.uniform(-0.6, 2.5), rng.uniform(0.4, 2.1));
    // The derivative jumps where one cell ends and the next begins.
    const Vector3d in_cell = point * 10.0 - Vector3d::Constant(0.5);
    if (((in_cell.array() - in_cell.array().round()).abs() < 1e-3).any()) {
      continue;
    }
    const DistanceAndGradient found = clearance.distance_and_gradient(point);
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3d step = Vector3d::Unit(axis) * kStep;
      const double slope =
          (clearance.distance_m(point + step) - clearance.distance_m(point - step)) / (2.0 * kStep);
      ASSERT_NEAR(found.gradient[axis], slope, 1e-6);
    }
    ++compared;
  }
  EXPECT_GT(compared, 1000);
}

TEST(ClearanceMap, NothingIsClearOutsideTheBox) {
  test::SnapshotBuilder builder(0.1, Box3d(Vector3d::Zero(), Vector3d::Constant(3.0)));
  builder.fill(VoxelState::kFree);
  ClearanceMap clearance;
  clearance.update(builder.build());

  EXPECT_EQ(clearance.squared_distance_voxels({-1, 5, 5}), 0);
  EXPECT_EQ(clearance.squared_distance_voxels({0, 15, 15}), 1);
  EXPECT_FALSE(clearance.clearance_at_least({-0.5, 1.5, 1.5}, 0.1));
  EXPECT_TRUE(clearance.clearance_at_least({0.21, 1.5, 1.5}, 0.2));
  EXPECT_FALSE(clearance.clearance_at_least({0.19, 1.5, 1.5}, 0.2));
}

}  // namespace
}  // namespace understory
