// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/team/teammate_mask.hpp"

#include <cassert>
#include <cstddef>
#include <limits>

#include "understory/sense/sphere_pixels.hpp"

namespace understory::team {

DepthImage mask_teammates(DepthImage image,
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
        const auto depth_m = static_cast<double>(row[u]);
        const Vector3d ray((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1.0);
        // False for NaN and for "no return", which is infinitely far.
        if (depth_m > 0.0 &&
            (depth_m * ray - center_optical).squaredNorm() <= radius_m * radius_m) {
          row[u] = std::numeric_limits<float>::quiet_NaN();
        }
      }
    }
  }
  return image;
}

}  // namespace understory::team
