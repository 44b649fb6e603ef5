// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/map/intruders.hpp"

#include <algorithm>
#include <cstddef>

namespace understory {
namespace {

constexpr int kLeastVoxels = 3;      // fewer are noise
constexpr double kTogether_m = 0.6;  // what is nearer than this to a thing's middle is part of it

struct Thing {
  Vector3d sum_m = Vector3d::Zero();
  int voxels = 0;

  [[nodiscard]] Vector3d middle_m() const { return sum_m / voxels; }
};

// Surfaces are never sharp in a map: next to what is not free nothing is a surprise.
bool is_amid_free_space(const MapSnapshot& map, const VoxelIndex& voxel) {
  for (int z = -1; z <= 1; ++z) {
    for (int y = -1; y <= 1; ++y) {
      for (int x = -1; x <= 1; ++x) {
        if (!map.is_free(voxel + VoxelIndex(x, y, z))) {
          return false;
        }
      }
    }
  }
  return true;
}

void add(const Vector3d& place_m, std::vector<Thing>& things) {
  const auto found = std::find_if(things.begin(), things.end(), [&](const Thing& thing) {
    return (thing.middle_m() - place_m).norm() < kTogether_m;
  });
  Thing& thing = found == things.end() ? things.emplace_back() : *found;
  thing.sum_m += place_m;
  ++thing.voxels;
}

void add_of_tile(const MapSnapshot& before,
                 const Vector3i& tile_index,
                 const BitRows& hits,
                 std::vector<Thing>& things) {
  const Tile* tile = before.tiles[before.geometry.slot_of_tile(tile_index)].get();
  if (tile == nullptr) {
    return;
  }
  for (std::size_t row = 0; row < kRowsPerTile; ++row) {
    const unsigned free_hits = hits[row] & static_cast<unsigned>(tile->free_rows[row]);
    for (unsigned left = free_hits; left != 0; left &= left - 1) {
      const int x = __builtin_ctz(left);
      const VoxelIndex voxel =
          kTileVoxels * tile_index +
          VoxelIndex(x, static_cast<int>(row % 16U), static_cast<int>(row / 16U));
      const bool is_sure = tile->log_odds_at(row * kTileVoxels + static_cast<std::size_t>(x)) <=
                           before.sensor_model.min / 2;
      if (is_sure && is_amid_free_space(before, voxel)) {
        add(before.geometry.center_of(voxel), things);
      }
    }
  }
}

}  // namespace

std::vector<Vector3d> intruders_in(const ScanWindow& cloud, const MapSnapshot& before) {
  std::vector<Thing> things;
  const Vector3i end = cloud.tile_min() + cloud.tile_count();
  for (int z = cloud.tile_min().z(); !cloud.empty() && z < end.z(); ++z) {
    for (int y = cloud.tile_min().y(); y < end.y(); ++y) {
      for (int x = cloud.tile_min().x(); x < end.x(); ++x) {
        const Vector3i tile(x, y, z);
        add_of_tile(before, tile, cloud.marks_of_tile(tile).hits, things);
      }
    }
  }
  std::vector<Vector3d> middles_m;
  for (const Thing& thing : things) {
    if (thing.voxels >= kLeastVoxels) {
      middles_m.push_back(thing.middle_m());
    }
  }
  return middles_m;
}

}  // namespace understory
