// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/team/teammate_mask.hpp"

#include <cmath>
#include <limits>
#include <optional>

#include <gtest/gtest.h>

#include "support/map_checks.hpp"
#include "support/small_images.hpp"
#include "support/synthetic_scene.hpp"
#include "understory/map/mapper.hpp"
#include "understory/sim/teammates_in_view.hpp"

namespace understory {
namespace {

using test::count_changed;
using test::filled;
using test::looking_east_from;
using test::round_camera;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr std::size_t kMiddleRow = std::size_t{40} * 101;  // of the round camera
constexpr double kBody_m = 0.3;                            // radius of a vehicle
constexpr double kMask_m = 0.6;

TEST(TeammateMask, MasksWhatLiesWithinTheRadiusAndNothingElse) {
  const CameraModel camera = round_camera();
  DepthImage image = filled(camera, 3.0F);  // behind the team mate at 2 m
  image.z_m[kMiddleRow + 50] = 1.41F;       // all in its direction
  image.z_m[kMiddleRow + 51] = 1.39F;
  image.z_m[kMiddleRow + 52] = 2.59F;
  image.z_m[kMiddleRow + 53] = 2.61F;
  image.z_m[kMiddleRow + 54] = kInfinity;
  image.z_m[kMiddleRow + 55] = kNan;
  image.z_m[kMiddleRow + 79] = 2.0F;  // 0.58 m beside it
  image.z_m[kMiddleRow + 81] = 2.0F;  // 0.62 m
  DepthImage expected = image;
  for (const std::size_t u : {50U, 52U, 79U}) {
    expected.z_m[kMiddleRow + u] = kNan;
  }

  const DepthImage masked =
      team::mask_teammates(image, camera, Pose::Identity(), {{0, 0, 2}}, kMask_m);

  EXPECT_EQ(count_changed(masked, expected), 0);
}

TEST(TeammateMask, PlaceThatIsNoNumberMasksNothing) {
  const CameraModel camera = round_camera();
  const DepthImage image = filled(camera, 2.0F);

  const DepthImage masked =
      team::mask_teammates(image, camera, Pose::Identity(), {{0, std::nan(""), 2}}, kMask_m);

  EXPECT_EQ(count_changed(masked, image), 0);
}

// A camera flies along x at a height of 1 m; a trunk stands at (3, 1.4), its team mate hovers at
// (3, 0.4), so that 0.5 m are left between their surfaces.
struct Encounter {
  Encounter() : camera(test::camera_config(160, 120)) {
    scene.trunks = {{Vector2d(3.0, 1.4), 0.2}};
  }

  [[nodiscard]] Mapper mapped(bool has_teammate, const std::optional<Vector3d>& error_m) const {
    Mapper mapper(MapConfig{}, Box3d(Vector3d(-1, -3, 0), Vector3d(7, 3, 2)));
    for (int frame = 0; frame < 20; ++frame) {
      const Pose pose = looking_east_from({0.05 * frame, 0.05, 1.0});
      DepthImage image = test::render(scene, camera, pose);
      if (has_teammate) {
        image = add_teammates(std::move(image), camera, pose, {teammate_m}, kBody_m);
      }
      if (error_m) {
        image =
            team::mask_teammates(std::move(image), camera, pose, {teammate_m + *error_m}, kMask_m);
      }
      EXPECT_TRUE(mapper.integrate(camera, image.view(), pose, Time{}).has_value());
    }
    return mapper;
  }

  CameraModel camera;
  test::SyntheticScene scene;
  Vector3d teammate_m{3.0, 0.4, 1.0};
};

// Known and not free, within the distance of the point, above the ground.
int obstacles_near(const MapSnapshot& map, const Vector3d& point_m, double distance_m) {
  int obstacles = 0;
  test::for_each_voxel(map.geometry.voxels(), [&](const VoxelIndex& voxel) {
    const Vector3d center_m = map.geometry.center_of(voxel);
    const bool is_near = (center_m - point_m).norm() <= distance_m && center_m.z() > 0.2;
    obstacles += is_near && map.is_known(voxel) && !map.is_free(voxel) ? 1 : 0;
  });
  return obstacles;
}

int trunk_voxels(const MapSnapshot& map) {
  int occupied = 0;
  test::for_each_voxel(map.geometry.voxels(), [&](const VoxelIndex& voxel) {
    const Vector3d center_m = map.geometry.center_of(voxel);
    const bool is_trunk = (center_m - Vector3d(3.0, 1.4, center_m.z())).norm() <= 0.3;
    occupied += is_trunk && center_m.z() > 0.2 && map.state(voxel) == VoxelState::kOccupied;
  });
  return occupied;
}

TEST(TeammateMask, TeammateWhosePositionIsWrongByTwentyCentimetresLeavesNoObstacle) {
  const Encounter encounter;
  const MapSnapshotPtr unmasked = encounter.mapped(true, std::nullopt).publish();
  ASSERT_GT(obstacles_near(*unmasked, encounter.teammate_m, 0.45), 20);

  for (const Vector3d& direction : {Vector3d(0, 0, 0),
                                    Vector3d(1, 0, 0),
                                    Vector3d(-1, 0, 0),
                                    Vector3d(0, 1, 0),
                                    Vector3d(0, -1, 0),
                                    Vector3d(0, 0, 1),
                                    Vector3d(0, 0, -1),
                                    Vector3d(-0.6, -0.8, 0)}) {
    const MapSnapshotPtr map = encounter.mapped(true, 0.2 * direction).publish();

    EXPECT_EQ(obstacles_near(*map, encounter.teammate_m, 0.45), 0) << direction.transpose();
  }
}

TEST(TeammateMask, TrunkBesideTheTeammateIsMappedAsIfNobodyWasThere) {
  const Encounter encounter;
  const MapSnapshotPtr alone = encounter.mapped(false, std::nullopt).publish();

  const MapSnapshotPtr masked = encounter.mapped(true, Vector3d(0, 0, 0)).publish();

  ASSERT_GT(trunk_voxels(*alone), 20);
  EXPECT_EQ(trunk_voxels(*masked), trunk_voxels(*alone));
}

TEST(TeammateMask, NoSpaceIsTakenForFreeWhereOnlyTheTeammateWasSeen) {
  const Encounter encounter;
  const MapSnapshotPtr without = encounter.mapped(false, std::nullopt).publish();

  const MapSnapshotPtr masked = encounter.mapped(true, Vector3d(0, 0, 0)).publish();

  const VoxelIndex inside = masked->geometry.index_of(encounter.teammate_m);
  EXPECT_TRUE(without->is_free(inside));
  EXPECT_FALSE(masked->is_known(inside));
  test::for_each_voxel(masked->geometry.voxels(), [&](const VoxelIndex& voxel) {
    EXPECT_TRUE(!masked->is_free(voxel) || without->is_free(voxel)) << voxel.transpose();
  });
}

}  // namespace
}  // namespace understory
