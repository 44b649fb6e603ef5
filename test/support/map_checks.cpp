// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "support/map_checks.hpp"

#include <memory>

namespace understory::test {
namespace {

constexpr int kPatchShift = 2;  // patches of 4 voxels: two levels of OctoMap's tree

std::uint64_t hash(const Vector3i& place) {
  std::uint64_t mixed = 0;
  for (int axis = 0; axis < 3; ++axis) {
    mixed = mixed * 1000003U + static_cast<std::uint32_t>(place[axis]);
  }
  return mixed;
}

}  // namespace

MapSnapshot random_map(const Box3d& box_m, double resolution_m, std::uint64_t seed) {
  MapSnapshot map{
      GridGeometry(resolution_m, box_m), SensorModel(SensorModelConfig{}), 0, {}, {}, {}};
  std::vector<std::shared_ptr<Tile>> tiles(map.geometry.slot_count());
  for_each_voxel(map.geometry.voxels(), [&](const VoxelIndex& voxel) {
    const std::uint64_t patch_id = hash(voxel.unaryExpr([](int i) { return i >> kPatchShift; }));
    Rng of_patch(seed ^ patch_id);
    const std::uint64_t kind = of_patch.below(4);
    if (kind == 0) {
      return;  // the patch stays unknown
    }
    Rng of_voxel(hash(voxel) ^ seed);
    Rng& rng = kind == 1 ? of_patch : of_voxel;  // one value throughout the patch, or any
    const int span = map.sensor_model.max - map.sensor_model.min + 1;
    const int log_odds =
        map.sensor_model.min + static_cast<int>(rng.below(static_cast<std::uint64_t>(span)));
    std::shared_ptr<Tile>& tile = tiles[map.geometry.slot_of(voxel)];
    if (!tile) {
      tile = std::make_shared<Tile>();
    }
    tile->set(offset_in_tile(voxel), static_cast<std::int8_t>(log_odds));
  });
  map.tiles.assign(tiles.begin(), tiles.end());
  return map;
}

}  // namespace understory::test
