// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What an organised depth image says about voxels, found without tracing rays: the voxels of the
// view frustum are projected into the image once each. World frame; lengths in voxels (_vox), seen
// from the camera. A voxel's centre counts as passed when all four pixels around its projection saw
// beyond it, so a centre inside an obstacle wider than a pixel is never cleared. Used by one
// thread; nothing here can fail.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "understory/map/map_snapshot.hpp"
#include "understory/map/scan_window.hpp"
#include "understory/sense/camera_model.hpp"

namespace understory {

// A camera at a pose, in voxel units.
class CameraView {
 public:
  // inward_normal . (point - origin) >= offset_vox holds for points in view.
  struct Plane {
    Eigen::Vector3f inward_normal;
    float offset_vox = 0.0F;
  };

  CameraView(const CameraModel& camera, const Pose& world_from_optical, double resolution_m);

  [[nodiscard]] const CameraModel& camera() const { return camera_; }
  [[nodiscard]] double resolution_m() const { return resolution_m_; }
  [[nodiscard]] const Vector3d& origin_vox() const { return origin_vox_; }
  [[nodiscard]] float range_vox() const { return range_vox_; }
  [[nodiscard]] const Eigen::Matrix3f& world_from_optical() const { return world_from_optical_; }
  // (u z, v z, z) of a point relative to the origin.
  [[nodiscard]] const Eigen::Matrix3f& image_from_world() const { return image_from_world_; }
  [[nodiscard]] const std::array<Plane, 5>& planes() const { return planes_; }

  // Bounds everything the camera can see.
  [[nodiscard]] Box3d reach_m() const;
  // Within range the nearest pixel's ray crosses every voxel, so projecting equals tracing.
  [[nodiscard]] bool pixels_are_denser_than_voxels() const;

 private:
  CameraModel camera_;
  double resolution_m_;
  Vector3d origin_vox_;
  float range_vox_;
  Eigen::Matrix3f world_from_optical_;
  Eigen::Matrix3f image_from_world_;
  std::array<Plane, 5> planes_;
};

class ProjectiveIntegration {
 public:
  // Marks the voxels in which returns lie and notes the depths for mark_misses. Returns how many
  // pixels measured nothing.
  std::size_t mark_hits(const CameraView& view, const DepthView& depth, ScanWindow& window);

  // Marks the voxels in view in front of the returns, but those that are at the free clamp already.
  void mark_misses(const CameraView& view, const MapSnapshot& map, ScanWindow& window) const;

 private:
  void note_image_row(const float* z_m, int v, double inverse_resolution);

  Tile unknown_tile_;  // stands in for tiles that are not there yet
  int width_px_ = 0;
  std::vector<float> row_z_m_;
  std::vector<float> pair_depths_vox_;  // smallest of pixels u, u + 1 of the latest row
  // Of the 2 x 2 pixels from (u, v) on the smallest depth, less a margin; 0 where one of them
  // measured nothing.
  std::vector<float> block_depths_vox_;
};

}  // namespace understory
