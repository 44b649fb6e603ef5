// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/plan/line_of_sight.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace understory {
namespace {

using Steps = std::array<double, ClearanceMap::kReachVoxels * ClearanceMap::kReachVoxels + 1>;

// In voxels, by the squared distance: nothing blocks nearer than the distance to the nearest centre
// less a voxel's diagonal.
Steps safe_steps() noexcept {
  Steps steps{};
  for (std::size_t squared = 0; squared < steps.size(); ++squared) {
    steps[squared] = std::max(std::sqrt(static_cast<double>(squared)) - 1.75, 0.9);
  }
  return steps;
}
const Steps kSafeSteps = safe_steps();

}  // namespace

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
    travelled_m += step_m * kSafeSteps[static_cast<std::size_t>(squared)];
  }
  return map.squared_distance_voxels(geometry.index_of(to_m)) > 0;
}

}  // namespace understory
