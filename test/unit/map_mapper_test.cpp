// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "support/synthetic_scene.hpp"
#include "understory/map/mapper.hpp"

namespace understory {
namespace {

const Box3d kRoom(Vector3d(-2.0, -3.0, 0.0), Vector3d(6.0, 3.0, 2.0));

Pose looking_along_x(const Vector3d& eye_m) {
  return level_pose(eye_m, 0.0) * body_from_optical(CameraConfig{});
}

DepthImage wall_at(const CameraModel& camera, float depth_m) {
  DepthImage image{camera.width_px, camera.height_px, {}};
  image.z_m.assign(static_cast<std::size_t>(camera.width_px * camera.height_px), depth_m);
  return image;
}

TEST(Mapper, WallAheadIsHitAndSpaceBeforeItCleared) {
  const CameraModel camera(test::camera_config(160, 120));
  Mapper mapper(MapConfig{}, kRoom);

  const auto counts = mapper.integrate(
      camera, wall_at(camera, 2.03F).view(), looking_along_x({0.05, 0.05, 1.05}), Time{});
  const MapSnapshotPtr map = mapper.publish();

  ASSERT_TRUE(counts.has_value());
  EXPECT_GT(counts->hit_voxels, 100U);
  for (double x = 0.05; x < 1.95; x += 0.1) {
    EXPECT_EQ(map->state(map->geometry.index_of({x, 0.05, 1.05})), VoxelState::kFree) << x;
  }
  EXPECT_EQ(map->state(map->geometry.index_of({2.08, 0.05, 1.05})), VoxelState::kUncertain);
  EXPECT_EQ(map->state(map->geometry.index_of({2.18, 0.05, 1.05})), VoxelState::kUnknown);
}

}  // namespace
}  // namespace understory
