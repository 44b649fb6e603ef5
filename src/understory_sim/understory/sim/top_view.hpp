// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What figures of a map seen from above are drawn from: one number per column of voxels. World
// frame, metres. Values; nothing can fail.
#pragma once

#include <cstddef>
#include <vector>

#include "understory/map/map_snapshot.hpp"
#include "understory/sim/coverage_truth.hpp"

namespace understory {

struct TopView {
  Vector2d corner_m = Vector2d::Zero();  // of column (0, 0), lowest x and y
  double resolution_m = 0.0;
  int width = 0;              // columns along x
  int height = 0;             // columns along y
  std::vector<float> values;  // x fastest

  [[nodiscard]] float at(int x, int y) const {
    return values[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(x)];
  }
};

// Share of each column's voxels that the map does not know, 0 .. 1.
[[nodiscard]] TopView unknown_share(const MapSnapshot& map);

// Share of each column's voxels that are occupied in the map, 0 .. 1.
[[nodiscard]] TopView occupied_share(const MapSnapshot& map);

// Share of each column's voxels that could have been known free and are not, 0 .. 1.
[[nodiscard]] TopView missed_share(const CoverageTruth& truth, const MapSnapshot& map);

}  // namespace understory
