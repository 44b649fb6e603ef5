// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cassert>
#include <cmath>

#include "understory/map/projective_integration.hpp"

namespace understory {
namespace {

// Keeps squares of ranges well inside a float's exponent; no box is that long.
constexpr double kMaxRangeVox = 1e7;
// Closer to the image plane than this, projections are too steep to mean anything; the camera's own
// voxel is treated apart.
constexpr float kNearVox = 0.01F;

}  // namespace

CameraView::CameraView(const CameraModel& camera,
                       const Pose& world_from_optical,
                       double resolution_m)
    : camera_(camera),
      resolution_m_(resolution_m),
      origin_vox_(world_from_optical.translation() / resolution_m),
      range_vox_(static_cast<float>(std::min(camera.max_range_m / resolution_m, kMaxRangeVox))),
      world_from_optical_(world_from_optical.linear().cast<float>()) {
  assert(camera.fx > 0.0 && camera.fy > 0.0);
  Eigen::Matrix3d image_from_optical;
  image_from_optical << camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0;
  const Eigen::Matrix3d optical_from_world = world_from_optical.linear().transpose();
  image_from_world_ = (image_from_optical * optical_from_world).cast<float>();

  const Eigen::Vector3f u = image_from_world_.row(0);
  const Eigen::Vector3f v = image_from_world_.row(1);
  const Eigen::Vector3f z = image_from_world_.row(2);
  const auto last_u = static_cast<float>(camera.width_px - 1);
  const auto last_v = static_cast<float>(camera.height_px - 1);
  planes_ = {Plane{z, kNearVox},
             Plane{u, 0.0F},
             Plane{last_u * z - u, 0.0F},
             Plane{v, 0.0F},
             Plane{last_v * z - v, 0.0F}};
}

Box3d CameraView::reach_m() const {
  const double range_m = static_cast<double>(range_vox_) * resolution_m_;
  const Vector3d origin_m = origin_vox_ * resolution_m_;
  Box3d cone(origin_m);
  for (const double u : {0.0, camera_.width_px - 1.0}) {
    for (const double v : {0.0, camera_.height_px - 1.0}) {
      const Vector3d ray((u - camera_.cx) / camera_.fx, (v - camera_.cy) / camera_.fy, 1.0);
      cone.extend(origin_m + world_from_optical_.cast<double>() * (ray * range_m));
    }
  }
  const Vector3d reach = Vector3d::Constant(range_m);
  return cone.intersection(Box3d(origin_m - reach, origin_m + reach));
}

bool CameraView::pixels_are_denser_than_voxels() const {
  const double diagonal_px = std::hypot(1.0 / camera_.fx, 1.0 / camera_.fy);
  return camera_.width_px > 1 && camera_.height_px > 1 &&
         static_cast<double>(range_vox_) * diagonal_px <= 1.0;
}

}  // namespace understory
