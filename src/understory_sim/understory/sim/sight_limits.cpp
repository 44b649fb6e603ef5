// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/sight_limits.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace understory {
namespace {

constexpr double kSteepestRad = 1.5;

double slope_of(double elevation_rad) {
  return std::tan(std::clamp(elevation_rad, -kSteepestRad, kSteepestRad));
}

}  // namespace

RiseInterval visible_rise(const CameraConfig& camera, double horizontal_m) {
  const double ahead_m = horizontal_m - camera.mount_forward_m;
  if (ahead_m <= 0.0 || ahead_m > camera.max_range_m) {
    return {1.0, -1.0};
  }
  const double half_fov_rad = 0.5 * camera.vertical_fov_rad;
  const double range_rise_m =
      std::sqrt(camera.max_range_m * camera.max_range_m - ahead_m * ahead_m);
  const double low_m = ahead_m * slope_of(-camera.mount_pitch_rad - half_fov_rad);
  const double high_m = ahead_m * slope_of(-camera.mount_pitch_rad + half_fov_rad);
  return {camera.mount_up_m + std::max(low_m, -range_rise_m),
          camera.mount_up_m + std::min(high_m, range_rise_m)};
}

std::vector<ViewingOffset> viewing_offsets(const CameraConfig& camera,
                                           double resolution_m,
                                           int stride,
                                           double widest_band_m) {
  const double step_m = resolution_m * stride;
  const double reach_m = camera.max_range_m + std::max(0.0, camera.mount_forward_m);
  const int reach = static_cast<int>(reach_m / step_m) + 1;
  std::vector<ViewingOffset> offsets;
  for (int y = -reach; y <= reach; ++y) {
    for (int x = -reach; x <= reach; ++x) {
      const double distance_m = step_m * std::hypot(x, y);
      const RiseInterval rise = visible_rise(camera, distance_m);
      if ((x != 0 || y != 0) && !rise.empty()) {
        offsets.push_back({x * stride, y * stride, distance_m, rise});
      }
    }
  }
  const auto rank = [&](const ViewingOffset& offset) {
    const double band_m = offset.rise.high_m - offset.rise.low_m;
    return std::make_tuple(
        -std::min(band_m, widest_band_m), offset.distance_m, offset.dy, offset.dx);
  };
  std::sort(offsets.begin(), offsets.end(), [&](const ViewingOffset& a, const ViewingOffset& b) {
    return rank(a) < rank(b);
  });
  return offsets;
}

}  // namespace understory
