// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Places that are barred though the map has them free: someone stands there, or may. Metres, world
// frame. Values; nothing can fail.
#pragma once

#include <algorithm>
#include <vector>

#include "understory/base/geometry.hpp"

namespace understory {

struct Barrier {
  Vector3d position_m = Vector3d::Zero();
  double radius_m = 0.0;
};
using Barriers = std::vector<Barrier>;

// Does the straight line between the two lead through one?
[[nodiscard]] inline bool is_barred(const Barriers& barriers,
                                    const Vector3d& from_m,
                                    const Vector3d& to_m) {
  const Vector3d leg_m = to_m - from_m;
  return std::any_of(barriers.begin(), barriers.end(), [&](const Barrier& barrier) {
    const Vector3d offset_m = barrier.position_m - from_m;
    const double along = offset_m.dot(leg_m) / std::max(leg_m.squaredNorm(), 1e-12);
    const Vector3d nearest_m = std::clamp(along, 0.0, 1.0) * leg_m;
    return (offset_m - nearest_m).norm() < barrier.radius_m;
  });
}

}  // namespace understory
