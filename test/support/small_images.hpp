// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Depth images whose pixels one can work out by hand. Optical frame, metres.
#pragma once

#include <cmath>
#include <cstddef>

#include "understory/sense/camera_model.hpp"

namespace understory::test {

// 101 x 81 pixels of 0.01 each: pixel (50 + i, 40 + j) looks along (i, j, 100) / 100.
[[nodiscard]] inline CameraModel round_camera() {
  CameraModel camera;
  camera.width_px = 101;
  camera.height_px = 81;
  camera.fx = 100.0;
  camera.fy = 100.0;
  camera.cx = 50.0;
  camera.cy = 40.0;
  camera.max_range_m = 4.5;
  return camera;
}

[[nodiscard]] inline DepthImage filled(const CameraModel& camera, float depth_m) {
  DepthImage image{camera.width_px, camera.height_px, {}};
  image.z_m.assign(
      static_cast<std::size_t>(camera.width_px) * static_cast<std::size_t>(camera.height_px),
      depth_m);
  return image;
}

[[nodiscard]] inline Pose looking_east_from(const Vector3d& eye_m) {
  return level_pose(eye_m, 0.0) * body_from_optical(CameraConfig{});
}

// How many pixels differ, NaN being like NaN.
[[nodiscard]] inline int count_changed(const DepthImage& a, const DepthImage& b) {
  int changed = 0;
  for (std::size_t i = 0; i < a.z_m.size(); ++i) {
    const bool both_nan = std::isnan(a.z_m[i]) && std::isnan(b.z_m[i]);
    changed += both_nan || a.z_m[i] == b.z_m[i] ? 0 : 1;
  }
  return changed;
}

}  // namespace understory::test
