// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sense/sphere_pixels.hpp"

#include <algorithm>
#include <cmath>

namespace understory {
namespace {

struct ImageAxis {
  double focal_px;
  double center_px;
  int count;
};

struct PixelRange {
  int begin = 0;
  int end = 0;
};

// Of an angle off the optical axis, at most one past the border.
int pixel_of(double angle_rad, const ImageAxis& axis) {
  constexpr double kNearlyRight_rad = 0.5 * kPi - 1e-6;
  const double angle = std::clamp(angle_rad, -kNearlyRight_rad, kNearlyRight_rad);
  const double pixel = axis.center_px + axis.focal_px * std::tan(angle);
  return static_cast<int>(std::clamp(pixel, -1.0, static_cast<double>(axis.count)));
}

// The outermost rays lie in the two planes through the image's other axis that touch the sphere.
PixelRange range_of(double across_m, double depth_m, double radius_m, const ImageAxis& axis) {
  const double distance_m = std::hypot(across_m, depth_m);
  if (distance_m <= radius_m) {
    return {0, axis.count};
  }
  const double middle_rad = std::atan2(across_m, depth_m);
  const double half_rad = std::asin(radius_m / distance_m);
  // One pixel more on each side makes up for rounding.
  const int first = pixel_of(middle_rad - half_rad, axis) - 1;
  const int last = pixel_of(middle_rad + half_rad, axis) + 1;
  return {std::max(first, 0), std::min(last + 1, axis.count)};
}

}  // namespace

PixelRectangle pixels_of_sphere(const CameraModel& camera,
                                const Vector3d& center_optical_m,
                                double radius_m) {
  if (!center_optical_m.allFinite() || !(center_optical_m.z() + radius_m > 0.0)) {
    return {};
  }
  const Vector3d& center = center_optical_m;
  const PixelRange columns =
      range_of(center.x(), center.z(), radius_m, {camera.fx, camera.cx, camera.width_px});
  const PixelRange rows =
      range_of(center.y(), center.z(), radius_m, {camera.fy, camera.cy, camera.height_px});
  return {columns.begin, columns.end, rows.begin, rows.end};
}

}  // namespace understory
