// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Which voxels are frontier: free, with an unknown 6-neighbour inside the box. Kept as bit rows per
// tile and recomputed only where the map changed. Used by one thread; cannot fail.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "understory/map/map_snapshot.hpp"

namespace understory {

class FrontierField {
 public:
  struct Change {
    std::vector<VoxelIndex> added;
    std::vector<VoxelIndex> removed;
    std::vector<TileSlot> tiles;  // whose free or known voxels changed, ascending
  };

  explicit FrontierField(const GridGeometry& geometry);

  // What changed since the previous call.
  Change update(const MapSnapshotPtr& snapshot);

  [[nodiscard]] bool contains(const VoxelIndex& voxel) const;

 private:
  using Rows = std::array<std::uint16_t, kRowsPerTile>;

  void refresh_tile(const MapSnapshot& snapshot, TileSlot slot, Change& change);

  MapSnapshotPtr previous_;
  std::vector<std::unique_ptr<Rows>> rows_;  // null: no frontier
};

}  // namespace understory
