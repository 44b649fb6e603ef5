// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/map/grid_geometry.hpp"

#include <algorithm>
#include <cmath>

#include "understory/base/config.hpp"

namespace understory {
namespace {

// Box faces given as decimal fractions must not gain a voxel through rounding.
constexpr double kBorderSlack = 1e-6;
constexpr double kMaxVoxelsAlongAxis = 1e6;
constexpr std::size_t kMaxTiles = 1U << 22U;

}  // namespace

GridGeometry::GridGeometry(double resolution_m, const Box3d& box_m)
    : resolution_m_(resolution_m), inverse_resolution_(1.0 / resolution_m) {
  if (!(resolution_m > 0.0) || box_m.isEmpty() || !box_m.min().allFinite() ||
      !box_m.max().allFinite()) {
    throw ConfigError("map box: needs a positive resolution and a finite, non-empty box");
  }
  const Vector3d low = box_m.min() * inverse_resolution_;
  const Vector3d high = box_m.max() * inverse_resolution_;
  if (low.cwiseAbs().maxCoeff() > kMaxVoxelsAlongAxis ||
      high.cwiseAbs().maxCoeff() > kMaxVoxelsAlongAxis) {
    throw ConfigError("map box: more than 1e6 voxels from the origin; use a coarser resolution");
  }
  for (int axis = 0; axis < 3; ++axis) {
    voxels_.min[axis] = static_cast<int>(std::floor(low[axis] + kBorderSlack));
    voxels_.end[axis] = static_cast<int>(std::ceil(high[axis] - kBorderSlack));
    tile_min_[axis] = voxels_.min[axis] >> kTileShift;
    tile_count_[axis] = ((voxels_.end[axis] - 1) >> kTileShift) - tile_min_[axis] + 1;
  }
  if (voxels_.empty() || slot_count() > kMaxTiles) {
    throw ConfigError("map box: thinner than a voxel, or more than 4 million tiles");
  }
}

Box3d GridGeometry::box_m() const {
  return {voxels_.min.cast<double>() * resolution_m_, voxels_.end.cast<double>() * resolution_m_};
}

VoxelBox GridGeometry::voxels_touched_by(const Box3d& region_m) const {
  if (region_m.min().hasNaN() || region_m.max().hasNaN()) {
    return {};
  }
  VoxelBox touched;
  for (int axis = 0; axis < 3; ++axis) {
    // Clamped before the conversion: 1e300 m must not overflow an int.
    const double box_min = voxels_.min[axis];
    const double box_end = voxels_.end[axis];
    const double low = std::floor(region_m.min()[axis] * inverse_resolution_);
    const double high = std::floor(region_m.max()[axis] * inverse_resolution_) + 1.0;
    touched.min[axis] = static_cast<int>(std::clamp(low, box_min, box_end));
    touched.end[axis] = static_cast<int>(std::clamp(high, box_min, box_end));
  }
  return touched.empty() ? VoxelBox{} : touched;
}

Vector3i GridGeometry::tile_of_slot(TileSlot slot) const {
  const auto nx = static_cast<std::size_t>(tile_count_.x());
  const auto ny = static_cast<std::size_t>(tile_count_.y());
  return tile_min_ + Vector3i(static_cast<int>(slot % nx),
                              static_cast<int>(slot / nx % ny),
                              static_cast<int>(slot / (nx * ny)));
}

VoxelBox GridGeometry::voxels_of_slot(TileSlot slot) const {
  const VoxelIndex min = tile_of_slot(slot) * kTileVoxels;
  const VoxelIndex end = min.array() + kTileVoxels;
  return VoxelBox{min, end}.clipped_to(voxels_);
}

bool GridGeometry::operator==(const GridGeometry& other) const {
  return resolution_m_ == other.resolution_m_ && voxels_.min == other.voxels_.min &&
         voxels_.end == other.voxels_.end;
}

}  // namespace understory
