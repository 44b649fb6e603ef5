// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// The map that a vehicle flies by when it has a team: its own observations and those that team
// mates told of, fused. Per vehicle and tile the newest layer counts, and a fused tile depends on
// the layers alone: in whatever order they came, lost and repeated, the same layers make the same
// map on all vehicles. Every layer has one vote per voxel: as many that say free as say occupied
// leave it uncertain, more of one kind decide. World frame. Used by one thread; nothing fails.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "understory/map/map_snapshot.hpp"
#include "understory/team/layer_tile.hpp"
#include "understory/team/team_config.hpp"

namespace understory::team {

class FusedMap {
 public:
  FusedMap(const TeamConfig& team, const GridGeometry& geometry, const SensorModel& sensor_model);

  // The newest map of what this vehicle itself has seen, of the same geometry. Returns the fused
  // one with the same stamp; its changed_tiles are those since the previous call.
  [[nodiscard]] MapSnapshotPtr update_own(const MapSnapshot& own);

  // What a team mate told. False: it is known already, or superseded; or no such vehicle or tile.
  bool accept(std::uint8_t vehicle, TileSlot slot, std::uint64_t version, const LayerTile& layer);

  // What this vehicle itself has seen, null if nothing; and where that changed with the last
  // update.
  [[nodiscard]] const LayerTilePtr& own_layer(TileSlot slot) const;
  [[nodiscard]] const std::vector<TileSlot>& own_changes() const { return own_changes_; }

  // Of the fused map as last returned: equal maps have equal digests.
  [[nodiscard]] std::uint64_t digest() const;

 private:
  struct Layer {
    std::uint64_t version = 0;
    LayerTilePtr content;  // null: nothing known
  };

  void update_own_layer(TileSlot slot, const Tile* tile);
  void mark_stale(TileSlot slot);
  // Whether the fused tile is another one now.
  bool fuse(TileSlot slot);

  std::size_t own_id_;
  MapSnapshot fused_;
  std::uint64_t own_revision_ = 0;
  bool has_own_ = false;
  std::vector<std::vector<Layer>> layers_;  // of each vehicle, by slot
  std::vector<TileSlot> own_changes_;
  std::vector<TileSlot> stale_slots_;  // to be fused anew
  std::vector<bool> is_stale_;
};

[[nodiscard]] std::uint64_t digest_of(const MapSnapshot& map);

}  // namespace understory::team
