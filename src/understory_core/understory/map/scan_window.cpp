// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/map/scan_window.hpp"

namespace understory {

void ScanWindow::reset(const GridGeometry& geometry, const Box3d& reach_m) {
  voxels_ = geometry.voxels_touched_by(reach_m);
  if (voxels_.empty()) {
    tile_count_ = Vector3i::Zero();
    marks_.clear();
    return;
  }
  for (int axis = 0; axis < 3; ++axis) {
    tile_min_[axis] = voxels_.min[axis] >> kTileShift;
    tile_count_[axis] = ((voxels_.end[axis] - 1) >> kTileShift) - tile_min_[axis] + 1;
  }
  marks_.assign(index_of_tile(tile_count_ - Vector3i::Ones()) + 1, TileMarks{});
}

}  // namespace understory
