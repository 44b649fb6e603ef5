// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "support/map_checks.hpp"
#include "support/synthetic_scene.hpp"
#include "understory/map/mapper.hpp"

namespace understory {
namespace {

constexpr std::size_t kPixels = std::size_t{160} * 120;
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();
Box3d room() {
  return {Vector3d(-2.0, -3.0, 0.0), Vector3d(6.0, 3.0, 2.0)};
}
Vector3d eye() {
  return {0.05, 0.05, 1.05};
}

CameraModel camera() {
  return CameraModel(test::camera_config(160, 120));
}

Pose looking_along_x(const Vector3d& eye_m) {
  return level_pose(eye_m, 0.0) * body_from_optical(CameraConfig{});
}

DepthImage wall_at(float depth_m) {
  DepthImage image{camera().width_px, camera().height_px, {}};
  image.z_m.assign(kPixels, depth_m);
  return image;
}

float& pixel(DepthImage& image, int u, int v) {
  return image.z_m[static_cast<std::size_t>(v) * static_cast<std::size_t>(image.width_px) +
                   static_cast<std::size_t>(u)];
}

struct Outcome {
  IntegrateCounts counts;
  MapSnapshotPtr map;

  [[nodiscard]] VoxelState state_at(double x_m, double y_m, double z_m) const {
    return map->state(map->geometry.index_of({x_m, y_m, z_m}));
  }
};

Outcome after_one_image(const DepthImage& image, const Vector3d& eye_m = eye()) {
  Mapper mapper(MapConfig{}, room());
  const auto counts = mapper.integrate(camera(), image.view(), looking_along_x(eye_m), Time{});
  return {counts.value(), mapper.publish()};
}

Outcome after_one_cloud(const std::vector<float>& points,
                        double max_range_m = 4.5,
                        const Vector3d& eye_m = eye()) {
  Mapper mapper(MapConfig{}, room());
  const auto counts = mapper.integrate_rays(
      {points.data(), 3, points.size() / 3}, level_pose(eye_m, 0.0), max_range_m, Time{});
  return {counts.value(), mapper.publish()};
}

TEST(Mapper, WallAheadIsHitAndSpaceBeforeItCleared) {
  const Outcome after = after_one_image(wall_at(2.03F));

  EXPECT_GT(after.counts.hit_voxels, 100U);
  for (int i = 0; i < 20; ++i) {
    const double x = 0.05 + 0.1 * i;
    EXPECT_EQ(after.state_at(x, 0.05, 1.05), VoxelState::kFree) << x;
  }
  EXPECT_EQ(after.state_at(2.08, 0.05, 1.05), VoxelState::kUncertain);
  EXPECT_EQ(after.state_at(2.18, 0.05, 1.05), VoxelState::kUnknown);
}

TEST(Mapper, RepeatedReturnsMakeAVoxelOccupiedUpToTheClamp) {
  Mapper mapper(MapConfig{}, room());
  const DepthImage wall = wall_at(2.03F);

  for (int frame = 0; frame < 20; ++frame) {
    (void)mapper.integrate(camera(), wall.view(), looking_along_x(eye()), Time{});
  }
  const MapSnapshotPtr map = mapper.publish();

  EXPECT_EQ(map->state(map->geometry.index_of({2.08, 0.05, 1.05})), VoxelState::kOccupied);
  EXPECT_EQ(test::log_odds_at(*map, map->geometry.index_of({2.08, 0.05, 1.05})),
            map->sensor_model.max);
  EXPECT_EQ(test::log_odds_at(*map, map->geometry.index_of({1.05, 0.05, 1.05})),
            map->sensor_model.min);
}

TEST(Mapper, VoxelWithManyPixelsChangesOncePerImage) {
  const Outcome after = after_one_image(wall_at(0.53F));  // some 18 x 18 pixels per voxel

  const VoxelIndex hit = after.map->geometry.index_of({0.58, 0.05, 1.05});
  const VoxelIndex passed = after.map->geometry.index_of({0.35, 0.05, 1.05});
  EXPECT_EQ(test::log_odds_at(*after.map, hit), after.map->sensor_model.hit);
  EXPECT_EQ(test::log_odds_at(*after.map, passed), after.map->sensor_model.miss);
}

TEST(Mapper, ReturnWinsOverRaysThatPassTheSameVoxel) {
  // Half of the image sees a pole in the middle of a voxel, the other half past it.
  DepthImage image = wall_at(3.0F);
  for (int v = 0; v < image.height_px; ++v) {
    for (int u = 0; u <= image.width_px / 2; u += 2) {
      pixel(image, u, v) = 1.0F;
    }
  }

  const Outcome after = after_one_image(image);

  const VoxelIndex pole = after.map->geometry.index_of({1.05, 0.05, 1.05});
  EXPECT_EQ(test::log_odds_at(*after.map, pole), after.map->sensor_model.hit);
}

TEST(Mapper, NoReturnClearsUpToTheRangeAlongTheRayAndMarksNothing) {
  const Outcome after = after_one_image(wall_at(kInfinity));

  EXPECT_EQ(after.counts.hit_voxels, 0U);
  EXPECT_EQ(after.state_at(4.45, 0.05, 1.05), VoxelState::kFree);
  EXPECT_EQ(after.state_at(4.65, 0.05, 1.05), VoxelState::kUnknown);
  // At the image's side the range is reached long before x = 4.5 m.
  EXPECT_EQ(after.state_at(3.65, 2.45, 1.05), VoxelState::kFree);
  EXPECT_EQ(after.state_at(4.05, 2.45, 1.05), VoxelState::kUnknown);
}

TEST(Mapper, ReturnBeyondTheRangeCountsAsNoReturn) {
  const Outcome beyond = after_one_image(wall_at(4.6F));
  const Outcome no_return = after_one_image(wall_at(kInfinity));

  EXPECT_TRUE(test::same_content(*beyond.map, *no_return.map));
}

TEST(Mapper, PixelsWithoutMeasurementSayNothing) {
  for (const float nothing : {kNan, 0.0F, -1.0F, -kInfinity}) {
    const Outcome after = after_one_image(wall_at(nothing));

    EXPECT_EQ(after.counts.skipped_points, kPixels) << nothing;
    EXPECT_TRUE(after.map->changed_tiles.empty()) << nothing;
  }
}

TEST(Mapper, HoleOfNanPixelsLeavesWhatLiesBehindItUnknown) {
  DepthImage image = wall_at(3.0F);
  for (int v = 50; v < 70; ++v) {
    for (int u = 70; u < 90; ++u) {
      pixel(image, u, v) = kNan;
    }
  }

  const Outcome after = after_one_image(image);

  EXPECT_EQ(after.counts.skipped_points, 400U);
  EXPECT_EQ(after.state_at(2.05, 0.05, 1.05), VoxelState::kUnknown);
  EXPECT_EQ(after.state_at(2.05, 0.85, 1.05), VoxelState::kFree);
}

TEST(Mapper, ReturnOutsideTheBoxMarksNothingButTheRayClearsUpToIt) {
  const Outcome after = after_one_image(wall_at(2.0F), {4.55, 0.05, 1.05});  // wall at x = 6.55

  EXPECT_EQ(after.counts.hit_voxels, 0U);
  EXPECT_EQ(after.state_at(5.95, 0.05, 1.05), VoxelState::kFree);
  EXPECT_EQ(test::inconsistent_voxels(*after.map), 0U);
}

TEST(Mapper, CameraOutsideTheBoxStillClearsAndMarksInside) {
  const Outcome after = after_one_image(wall_at(3.0F), {-4.05, 0.05, 1.05});

  EXPECT_EQ(after.state_at(-1.55, 0.05, 1.05), VoxelState::kFree);
  EXPECT_EQ(after.state_at(-1.05, 0.05, 1.05), VoxelState::kUncertain);
}

TEST(Mapper, CamerasOwnVoxelIsFree) {
  const Outcome after = after_one_image(wall_at(1.0F), {0.091, 0.091, 1.091});

  EXPECT_EQ(after.state_at(0.091, 0.091, 1.091), VoxelState::kFree);
}

TEST(Mapper, StridedCloudGivesTheSameMapAsAPlainImage) {
  const DepthImage wall = wall_at(2.03F);
  std::vector<float> cloud(wall.z_m.size() * 4, kNan);
  for (std::size_t i = 0; i < wall.z_m.size(); ++i) {
    cloud[4 * i + 2] = wall.z_m[i];
  }
  Mapper mapper(MapConfig{}, room());

  (void)mapper.integrate(camera(),
                         DepthView{cloud.data() + 2, 4, wall.width_px, wall.height_px},
                         looking_along_x(eye()),
                         Time{});

  EXPECT_TRUE(test::same_content(*mapper.publish(), *after_one_image(wall).map));
}

TEST(Mapper, ImageTooCoarseForItsVoxelsIsIntegratedRayByRay) {
  const CameraModel coarse(test::camera_config(16, 12));
  DepthImage image{16, 12, std::vector<float>(192, 3.03F)};
  Mapper by_image(MapConfig{}, room());
  Mapper by_rays(MapConfig{}, room());
  const std::vector<float> points = test::to_points(image, coarse, 2.0);

  (void)by_image.integrate(coarse, image.view(), looking_along_x(eye()), Time{});
  (void)by_rays.integrate_rays(
      {points.data(), 3, points.size() / 3}, looking_along_x(eye()), 4.5, Time{});

  EXPECT_TRUE(test::same_content(*by_image.publish(), *by_rays.publish()));
}

TEST(Mapper, BadPoseOrImageIsAnErrorAndChangesNothing) {
  Mapper mapper(MapConfig{}, room());
  const DepthImage wall = wall_at(2.0F);
  Pose nan_pose = looking_along_x(eye());
  nan_pose.translation().y() = std::nan("");
  Pose no_rotation = looking_along_x(eye());
  no_rotation.linear().setZero();
  const CameraModel other_camera(test::camera_config(640, 480));
  const std::vector<float> point{1.0F, 0.0F, 0.0F};

  const auto nan_result = mapper.integrate(camera(), wall.view(), nan_pose, Time{});
  const auto zero_result = mapper.integrate(camera(), wall.view(), no_rotation, Time{});
  const auto size_result =
      mapper.integrate(other_camera, wall.view(), looking_along_x(eye()), Time{});
  const auto null_result =
      mapper.integrate(camera(), {nullptr, 1, 160, 120}, looking_along_x(eye()), Time{});
  const auto rays_result = mapper.integrate_rays({point.data(), 3, 1}, nan_pose, 4.5, Time{});

  EXPECT_EQ(nan_result.error(), IntegrateError::kBadPose);
  EXPECT_EQ(zero_result.error(), IntegrateError::kBadPose);
  EXPECT_EQ(size_result.error(), IntegrateError::kImageSizeMismatch);
  EXPECT_EQ(null_result.error(), IntegrateError::kImageSizeMismatch);
  EXPECT_EQ(rays_result.error(), IntegrateError::kBadPose);
  EXPECT_TRUE(mapper.publish()->changed_tiles.empty());
}

TEST(Mapper, PosesFarFromTheBoxChangeNothing) {
  for (const double far_m : {1e3, 1e9, 1e18, 1e300, -1e307}) {
    const Vector3d eye_m(far_m, -far_m, far_m);

    EXPECT_TRUE(after_one_image(wall_at(kInfinity), eye_m).map->changed_tiles.empty()) << far_m;
    EXPECT_TRUE(after_one_cloud({1.0F, 0.0F, 0.0F}, 4.5, eye_m).map->changed_tiles.empty());
  }
}

TEST(MapperRays, RayClearsUpToItsReturnAndMarksIt) {
  const Outcome after = after_one_cloud({2.03F, 0.0F, 0.0F});

  EXPECT_EQ(after.counts.hit_voxels, 1U);
  EXPECT_EQ(after.counts.missed_voxels, 20U);
  EXPECT_EQ(after.state_at(1.95, 0.05, 1.05), VoxelState::kFree);
  EXPECT_EQ(after.state_at(2.08, 0.05, 1.05), VoxelState::kUncertain);
  EXPECT_EQ(after.state_at(2.18, 0.05, 1.05), VoxelState::kUnknown);
}

TEST(MapperRays, PointBeyondTheRangeClearsUpToTheRange) {
  for (const float far_m : {5.0F, 1e30F, kInfinity}) {
    const Outcome after = after_one_cloud({0.0F, far_m, 0.0F}, 2.0);

    EXPECT_EQ(after.counts.hit_voxels, 0U);
    EXPECT_EQ(after.counts.missed_voxels, 20U) << far_m;
    EXPECT_EQ(after.state_at(0.05, 1.95, 1.05), VoxelState::kFree);
    EXPECT_EQ(after.state_at(0.05, 2.15, 1.05), VoxelState::kUnknown);
  }
}

TEST(MapperRays, PointsWithoutDirectionAreSkippedAndCounted) {
  const Outcome after = after_one_cloud(
      {kNan, 1.0F, 1.0F, 0.0F, 0.0F, 0.0F, kInfinity, kInfinity, 0.0F, kInfinity, kNan, 0.0F});

  EXPECT_EQ(after.counts.skipped_points, 4U);
  EXPECT_TRUE(after.map->changed_tiles.empty());
}

TEST(MapperRays, EmptyCloudChangesNothing) {
  const Outcome after = after_one_cloud({});

  EXPECT_EQ(after.counts.hit_voxels + after.counts.missed_voxels, 0U);
  EXPECT_TRUE(after.map->changed_tiles.empty());
}

TEST(MapperRays, RayFromOutsideTheBoxEntersIt) {
  const Outcome after = after_one_cloud({3.0F, 0.0F, 0.0F}, 4.5, {-4.05, 0.05, 1.05});

  EXPECT_EQ(after.state_at(-1.95, 0.05, 1.05), VoxelState::kFree);
  EXPECT_EQ(after.state_at(-1.15, 0.05, 1.05), VoxelState::kFree);
  EXPECT_EQ(after.state_at(-1.05, 0.05, 1.05), VoxelState::kUncertain);
}

TEST(MapperRays, UnlimitedRangeClearsToTheFaceOfTheBox) {
  const Outcome after =
      after_one_cloud({kInfinity, 0.0F, 0.0F}, std::numeric_limits<double>::max());

  EXPECT_EQ(after.counts.missed_voxels, 60U);
  EXPECT_EQ(after.state_at(5.95, 0.05, 1.05), VoxelState::kFree);
}

}  // namespace
}  // namespace understory
