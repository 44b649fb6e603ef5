// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// The voxels that a perfect mission would know to be free: no trunk or mesh enters them, and their
// centre is in view (range, vertical field of view, nothing in between) from the centre of a voxel
// where the vehicle fits and that it can reach from a start without leaving the box. World frame,
// metres. With meshes, or trunks that end inside the box, viewing places are every second voxel and
// only what free voxels connect with the vehicle counts. Built once, takes a second; immutable
// then, any thread. Throws ForestError when the vehicle does not fit at a start
// or can see nothing.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "understory/map/grid_geometry.hpp"
#include "understory/map/tile.hpp"
#include "understory/sense/camera_model.hpp"
#include "understory/sim/forest_truth.hpp"

namespace understory {

class CoverageTruth {
 public:
  using Rows = std::array<std::uint16_t, kRowsPerTile>;  // bits as in Tile::free_rows

  CoverageTruth(const ForestTruth& truth,
                const GridGeometry& geometry,
                const std::vector<Vector3d>& starts_m,
                const CameraConfig& camera,
                double vehicle_radius_m);

  [[nodiscard]] const GridGeometry& geometry() const { return geometry_; }
  [[nodiscard]] const Rows& rows(TileSlot slot) const { return rows_[slot]; }
  [[nodiscard]] std::size_t voxel_count() const { return voxel_count_; }
  [[nodiscard]] bool contains(const VoxelIndex& voxel) const;  // false outside the box

 private:
  GridGeometry geometry_;
  std::vector<Rows> rows_;
  std::size_t voxel_count_ = 0;
};

}  // namespace understory
