// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// An immutable picture of the map at one instant: a table of shared tiles. Copying it copies
// pointers. Readers may hold it on any thread for as long as they like; two snapshots of one map
// differ exactly in the tiles whose pointers differ. A null tile is unknown throughout.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "understory/base/time.hpp"
#include "understory/map/grid_geometry.hpp"
#include "understory/map/sensor_model.hpp"
#include "understory/map/tile.hpp"

namespace understory {

using TilePtr = std::shared_ptr<const Tile>;

struct MapSnapshot {
  GridGeometry geometry;
  SensorModel sensor_model;
  std::uint64_t revision = 0;           // grows by one with every publication
  Time stamp{};                         // exposure of the newest cloud in it
  std::vector<TilePtr> tiles;           // geometry.slot_count() of them
  std::vector<TileSlot> changed_tiles;  // since the previous revision, ascending
  std::vector<Vector3d> intruders_m{};  // seen since then amid what was free: they move

  [[nodiscard]] const Tile* tile_at(const VoxelIndex& voxel) const {
    return geometry.contains(voxel) ? tiles[geometry.slot_of(voxel)].get() : nullptr;
  }
  // Outside the box nothing is free and nothing is known.
  [[nodiscard]] bool is_free(const VoxelIndex& voxel) const {
    const Tile* tile = tile_at(voxel);
    return tile != nullptr && tile->is_free(voxel);
  }
  [[nodiscard]] bool is_known(const VoxelIndex& voxel) const {
    const Tile* tile = tile_at(voxel);
    return tile != nullptr && tile->is_known(voxel);
  }
  [[nodiscard]] VoxelState state(const VoxelIndex& voxel) const {
    const Tile* tile = tile_at(voxel);
    return tile == nullptr ? VoxelState::kUnknown
                           : sensor_model.state_of(tile->log_odds[offset_in_tile(voxel)]);
  }
};

using MapSnapshotPtr = std::shared_ptr<const MapSnapshot>;

// Slots whose tiles differ, ascending. A null `older` stands for a map that was all unknown.
[[nodiscard]] std::vector<TileSlot> tiles_changed_between(const MapSnapshot* older,
                                                          const MapSnapshot& newer);

}  // namespace understory
