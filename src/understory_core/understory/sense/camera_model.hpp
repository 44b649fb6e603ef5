// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Pinhole depth camera without distortion. Optical frame: z forward, x right, y down. A depth is
// the z coordinate in metres; +inf is "no return within range" (it clears space), NaN "no
// measurement" (it says nothing), as REP 117 has it. Values only; nothing here can fail in flight.
#pragma once

#include <cstddef>
#include <vector>

#include "understory/base/config.hpp"
#include "understory/base/geometry.hpp"

namespace understory {

struct CameraConfig {
  int width_px = 160;
  int height_px = 120;
  double horizontal_fov_rad = 1.38056;  // 79.1 deg
  double vertical_fov_rad = 1.11003;    // 63.6 deg
  double max_range_m = 4.5;
  double rate_hz = 15.0;
  double mount_forward_m = 0.0;
  double mount_up_m = 0.0;
  double mount_pitch_rad = 0.0;

  void visit(FieldVisitor& f) {
    f.field("width_px", width_px, in_range(8, 4096), "image width");
    f.field("height_px", height_px, in_range(8, 4096), "image height");
    f.field(
        "horizontal_fov_rad", horizontal_fov_rad, in_range(0.1, 2.8), "horizontal field of view");
    f.field("vertical_fov_rad", vertical_fov_rad, in_range(0.1, 2.8), "vertical field of view");
    f.field("max_range_m",
            max_range_m,
            in_range(0.5, 100.0),
            "longest distance along a ray that counts");
    f.field("rate_hz", rate_hz, in_range(1.0, 120.0), "frames per second");
    f.field("mount_forward_m",
            mount_forward_m,
            in_range(-1.0, 1.0),
            "camera ahead of the body's origin");
    f.field("mount_up_m", mount_up_m, in_range(-1.0, 1.0), "camera above the body's origin");
    f.field(
        "mount_pitch_rad", mount_pitch_rad, in_range(-1.57, 1.57), "nose-down tilt of the camera");
  }
};

// What an image needs besides its pixels. Pixel (u, v) looks along ((u - cx) / fx, (v - cy) / fy,
// 1).
struct CameraModel {
  int width_px = 0;
  int height_px = 0;
  double fx = 0.0;
  double fy = 0.0;
  double cx = 0.0;
  double cy = 0.0;
  double max_range_m = 0.0;

  CameraModel() = default;
  explicit CameraModel(const CameraConfig& config);
};

[[nodiscard]] Pose body_from_optical(const CameraConfig& config);

// Borrowed depths of an organised image or of an organised cloud's z fields, row by row.
struct DepthView {
  const float* z_m = nullptr;
  std::size_t stride_floats = 1;  // from one pixel's z to the next one's
  int width_px = 0;
  int height_px = 0;

  [[nodiscard]] float at(int u, int v) const {
    return z_m[(static_cast<std::size_t>(v) * static_cast<std::size_t>(width_px) +
                static_cast<std::size_t>(u)) *
               stride_floats];
  }
};

struct DepthImage {
  int width_px = 0;
  int height_px = 0;
  std::vector<float> z_m;  // width_px * height_px

  [[nodiscard]] DepthView view() const { return {z_m.data(), 1, width_px, height_px}; }
};

}  // namespace understory
