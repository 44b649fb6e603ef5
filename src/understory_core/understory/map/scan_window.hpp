// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What one cloud says about the voxels within its reach: one bit per voxel for "a return lies in
// it" and one for "a ray passed it". Covers the part of the map's box that the cloud can touch.
// Reused from cloud to cloud to spare the allocation. Used by one thread; nothing here can fail.
#pragma once

#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "understory/map/grid_geometry.hpp"
#include "understory/map/tile.hpp"

namespace understory {

using BitRows = std::array<std::uint16_t, kRowsPerTile>;  // laid out as Tile::free_rows

struct TileMarks {
  BitRows hits{};
  BitRows misses{};  // may overlap hits, which win
};

class ScanWindow {
 public:
  // Forgets all marks. `reach_m` may lie anywhere and be of any size; only its common part with the
  // box counts.
  void reset(const GridGeometry& geometry, const Box3d& reach_m);

  [[nodiscard]] bool empty() const { return voxels_.empty(); }
  [[nodiscard]] const VoxelBox& voxels() const { return voxels_; }

  // Window tiles, x fastest; tile t of the window is map tile tile_min() + t.
  [[nodiscard]] const Vector3i& tile_min() const { return tile_min_; }
  [[nodiscard]] const Vector3i& tile_count() const { return tile_count_; }
  [[nodiscard]] TileMarks& marks_of_tile(const Vector3i& tile) {
    return marks_[index_of_tile(tile - tile_min_)];
  }
  [[nodiscard]] const TileMarks& marks_of_tile(const Vector3i& tile) const {
    return marks_[index_of_tile(tile - tile_min_)];
  }

  // Of voxels inside the window.
  void mark_hit(const VoxelIndex& voxel) { mark(marks_of_voxel(voxel).hits, voxel); }
  void mark_miss(const VoxelIndex& voxel) { mark(marks_of_voxel(voxel).misses, voxel); }

 private:
  [[nodiscard]] std::size_t index_of_tile(const Vector3i& local) const {
    return (static_cast<std::size_t>(local.z()) * static_cast<std::size_t>(tile_count_.y()) +
            static_cast<std::size_t>(local.y())) *
               static_cast<std::size_t>(tile_count_.x()) +
           static_cast<std::size_t>(local.x());
  }
  [[nodiscard]] TileMarks& marks_of_voxel(const VoxelIndex& voxel) {
    assert(voxels_.contains(voxel));
    return marks_of_tile(
        {voxel.x() >> kTileShift, voxel.y() >> kTileShift, voxel.z() >> kTileShift});
  }
  static void mark(BitRows& rows, const VoxelIndex& voxel) {
    std::uint16_t& row = rows[row_in_tile(voxel.y(), voxel.z())];
    row = static_cast<std::uint16_t>(row | (1U << (static_cast<unsigned>(voxel.x()) & 15U)));
  }

  VoxelBox voxels_;
  Vector3i tile_min_ = Vector3i::Zero();
  Vector3i tile_count_ = Vector3i::Zero();
  std::vector<TileMarks> marks_;
};

}  // namespace understory
