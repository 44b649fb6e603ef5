// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sense/camera_model.hpp"

#include <cmath>

namespace understory {

CameraModel::CameraModel(const CameraConfig& config)
    : width_px(config.width_px),
      height_px(config.height_px),
      fx(0.5 * config.width_px / std::tan(0.5 * config.horizontal_fov_rad)),
      fy(0.5 * config.height_px / std::tan(0.5 * config.vertical_fov_rad)),
      cx(0.5 * (config.width_px - 1)),
      cy(0.5 * (config.height_px - 1)),
      max_range_m(config.max_range_m) {}

Pose body_from_optical(const CameraConfig& config) {
  Eigen::Matrix3d forward_from_optical;  // columns: where the optical x, y, z axes point in FLU
  forward_from_optical << 0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0;
  Pose pose = Pose::Identity();
  pose.translation() = Vector3d(config.mount_forward_m, 0.0, config.mount_up_m);
  pose.linear() = Eigen::AngleAxisd(config.mount_pitch_rad, Vector3d::UnitY()).toRotationMatrix() *
                  forward_from_optical;
  return pose;
}

}  // namespace understory
