// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/teammates_in_view.hpp"

#include <cassert>
#include <cmath>
#include <cstddef>
#include <limits>

#include "understory/sense/sphere_pixels.hpp"

namespace understory {
namespace {

// Where the ray, whose z is 1, enters the sphere from outside; infinite if it does not.
double entry_depth_m(const Vector3d& ray, const Vector3d& center_m, double radius_m) {
  const double ray_squared = ray.squaredNorm();
  const double along = ray.dot(center_m);
  const double beyond = center_m.squaredNorm() - radius_m * radius_m;
  const double discriminant = along * along - ray_squared * beyond;
  if (along <= 0.0 || beyond <= 0.0 || discriminant < 0.0) {
    return std::numeric_limits<double>::infinity();
  }
  return (along - std::sqrt(discriminant)) / ray_squared;
}

}  // namespace

DepthImage add_teammates(DepthImage image,
                         const CameraModel& camera,
                         const Pose& world_from_optical,
                         const std::vector<Vector3d>& centers_m,
                         double radius_m) {
  assert(image.width_px == camera.width_px && image.height_px == camera.height_px);
  const Pose optical_from_world = world_from_optical.inverse();
  for (const Vector3d& center_m : centers_m) {
    const Vector3d center_optical = optical_from_world * center_m;
    const PixelRectangle pixels = pixels_of_sphere(camera, center_optical, radius_m);
    for (int v = pixels.v_begin; v < pixels.v_end; ++v) {
      float* row =
          image.z_m.data() + static_cast<std::size_t>(v) * static_cast<std::size_t>(image.width_px);
      for (int u = pixels.u_begin; u < pixels.u_end; ++u) {
        const Vector3d ray((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1.0);
        const double depth_m = entry_depth_m(ray, center_optical, radius_m);
        // False where the image has NaN.
        if (depth_m * ray.norm() <= camera.max_range_m && depth_m < static_cast<double>(row[u])) {
          row[u] = static_cast<float>(depth_m);
        }
      }
    }
  }
  return image;
}

}  // namespace understory
