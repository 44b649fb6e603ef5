// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Looking at whole maps in tests.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "understory/base/rng.hpp"
#include "understory/map/map_snapshot.hpp"

namespace understory::test {

template <class Visit>
void for_each_voxel(const VoxelBox& box, Visit visit) {
  for (int z = box.min.z(); z < box.end.z(); ++z) {
    for (int y = box.min.y(); y < box.end.y(); ++y) {
      for (int x = box.min.x(); x < box.end.x(); ++x) {
        visit(VoxelIndex(x, y, z));
      }
    }
  }
}

[[nodiscard]] inline int log_odds_at(const MapSnapshot& map, const VoxelIndex& voxel) {
  const Tile* tile = map.tile_at(voxel);
  return tile == nullptr ? static_cast<int>(kUnknownLogOdds)
                         : tile->log_odds_at(offset_in_tile(voxel));
}

// Voxels, outside the box included, whose free or known bit contradicts their log-odds or that are
// known outside the box.
[[nodiscard]] inline std::size_t inconsistent_voxels(const MapSnapshot& map) {
  std::size_t wrong = 0;
  for (TileSlot slot = 0; slot < map.tiles.size(); ++slot) {
    if (!map.tiles[slot]) {
      continue;
    }
    const Tile& tile = *map.tiles[slot];
    const VoxelIndex min = map.geometry.tile_of_slot(slot) * kTileVoxels;
    const VoxelIndex end = min.array() + kTileVoxels;
    for_each_voxel(VoxelBox{min, end}, [&](const VoxelIndex& voxel) {
      const int log_odds = tile.log_odds_at(offset_in_tile(voxel));
      const bool known = log_odds != static_cast<int>(kUnknownLogOdds);
      const bool bits_agree =
          tile.is_known(voxel) == known && tile.is_free(voxel) == (known && log_odds < 0);
      wrong += bits_agree && (!known || map.geometry.contains(voxel)) ? 0U : 1U;
    });
  }
  return wrong;
}

[[nodiscard]] inline bool same_content(const MapSnapshot& a, const MapSnapshot& b) {
  bool same = a.geometry == b.geometry;
  for_each_voxel(a.geometry.voxels(), [&](const VoxelIndex& voxel) {
    same = same && log_odds_at(a, voxel) == log_odds_at(b, voxel);
  });
  return same;
}

// Any log-odds between the clamps, or unknown, at every voxel of the box; smooth enough for OctoMap
// to prune here and there.
[[nodiscard]] MapSnapshot random_map(const Box3d& box_m, double resolution_m, std::uint64_t seed);

}  // namespace understory::test
