// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/plan/line_of_sight.hpp"

#include <algorithm>
#include <cmath>

namespace understory {

bool line_is_free(const ClearanceMap& map, const Vector3d& from_m, const Vector3d& to_m) {
  const GridGeometry& geometry = map.geometry();
  const double length_m = (to_m - from_m).norm();
  const double step_m = geometry.resolution_m();
  const Vector3d direction = (to_m - from_m) / std::max(length_m, 1e-9);
  double travelled_m = 0.0;
  while (travelled_m < length_m) {
    const int squared =
        map.squared_distance_voxels(geometry.index_of(from_m + travelled_m * direction));
    if (squared == 0) {
      return false;
    }
    // Nothing blocks nearer than the distance to the nearest centre less a voxel's diagonal.
    const double safe_voxels = std::sqrt(static_cast<double>(squared)) - 1.75;
    travelled_m += step_m * std::max(safe_voxels, 0.9);
  }
  return map.squared_distance_voxels(geometry.index_of(to_m)) > 0;
}

}  // namespace understory
