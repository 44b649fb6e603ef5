// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <limits>
#include <set>

#include <gtest/gtest.h>

#include "support/map_checks.hpp"
#include "understory/base/config.hpp"
#include "understory/map/grid_geometry.hpp"

namespace understory {
namespace {

// Neither at zero nor a multiple of tiles in size.
Box3d odd_box() {
  return {Vector3d(-3.7, -0.4, -0.2), Vector3d(1.9, 2.5, 2.0)};
}

TEST(GridGeometry, BoxAtNegativeCoordinatesKeepsItsFaces) {
  const GridGeometry geometry(0.1, odd_box());

  EXPECT_EQ(geometry.voxels().min, VoxelIndex(-37, -4, -2));
  EXPECT_EQ(geometry.voxels().end, VoxelIndex(19, 25, 20));
  EXPECT_TRUE(geometry.box_m().isApprox(odd_box(), 1e-9));
  EXPECT_EQ(geometry.tile_min(), Vector3i(-3, -1, -1));
  EXPECT_EQ(geometry.tile_count(), Vector3i(5, 3, 3));
}

TEST(GridGeometry, PointBelowZeroLiesInTheVoxelBelow) {
  const GridGeometry geometry(0.1, odd_box());

  EXPECT_EQ(geometry.index_of({-0.01, 0.01, -0.11}), VoxelIndex(-1, 0, -2));
  EXPECT_TRUE(geometry.center_of({-1, 0, -2}).isApprox(Vector3d(-0.05, 0.05, -0.15), 1e-12));
}

TEST(GridGeometry, SlotsAndTilesAreInversesAndCoverTheBoxOnce) {
  const GridGeometry geometry(0.1, odd_box());

  std::set<TileSlot> seen;
  int voxels = 0;
  for (TileSlot slot = 0; slot < geometry.slot_count(); ++slot) {
    seen.insert(geometry.slot_of_tile(geometry.tile_of_slot(slot)));
    voxels += geometry.voxels_of_slot(slot).size().prod();
    test::for_each_voxel(geometry.voxels_of_slot(slot), [&](const VoxelIndex& voxel) {
      ASSERT_EQ(geometry.slot_of(voxel), slot);
    });
  }

  EXPECT_EQ(seen.size(), geometry.slot_count());
  EXPECT_EQ(voxels, geometry.voxels().size().prod());
}

TEST(GridGeometry, RegionTouchesExactlyItsVoxelsInsideTheBox) {
  const GridGeometry geometry(0.1, odd_box());

  const VoxelBox touched =
      geometry.voxels_touched_by({Vector3d(-0.11, -9.0, 1.55), Vector3d(0.22, 0.05, 9.0)});

  EXPECT_EQ(touched.min, VoxelIndex(-2, -4, 15));
  EXPECT_EQ(touched.end, VoxelIndex(3, 1, 20));
}

TEST(GridGeometry, RegionOfAbsurdExtentTouchesTheBoxOrNothing) {
  const GridGeometry geometry(0.1, odd_box());
  const double infinity = std::numeric_limits<double>::infinity();
  const double nan = std::numeric_limits<double>::quiet_NaN();

  const VoxelBox everything = geometry.voxels_touched_by(
      {Vector3d::Constant(-infinity), Vector3d::Constant(std::numeric_limits<double>::max())});
  const VoxelBox far_off =
      geometry.voxels_touched_by({Vector3d::Constant(1e300), Vector3d::Constant(2e300)});
  const VoxelBox undefined =
      geometry.voxels_touched_by({Vector3d::Constant(nan), Vector3d::Constant(1.0)});

  EXPECT_EQ(everything.min, geometry.voxels().min);
  EXPECT_EQ(everything.end, geometry.voxels().end);
  EXPECT_TRUE(far_off.empty());
  EXPECT_TRUE(undefined.empty());
}

TEST(GridGeometry, AbsurdBoxIsAConfigurationError) {
  const double nan = std::numeric_limits<double>::quiet_NaN();

  EXPECT_THROW(GridGeometry(0.0, odd_box()), ConfigError);
  EXPECT_THROW(GridGeometry(nan, odd_box()), ConfigError);
  EXPECT_THROW(GridGeometry(0.1, Box3d()), ConfigError);
  EXPECT_THROW(GridGeometry(0.1, Box3d(Vector3d::Zero(), Vector3d(1.0, nan, 1.0))), ConfigError);
  EXPECT_THROW(GridGeometry(0.1, Box3d(Vector3d::Zero(), Vector3d(1e9, 1.0, 1.0))), ConfigError);
  EXPECT_THROW(GridGeometry(0.02, Box3d(Vector3d::Zero(), Vector3d(2e3, 2e3, 1e2))), ConfigError);
}

}  // namespace
}  // namespace understory
