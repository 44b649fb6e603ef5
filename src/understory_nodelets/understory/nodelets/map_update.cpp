// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/nodelets/map_update.hpp"

#include <algorithm>
#include <memory>
#include <numeric>

#include "understory/nodelets/conversions.hpp"

namespace understory {
namespace {

boost::array<std::int32_t, 3> to_array(const VoxelIndex& voxel) {
  return {{voxel.x(), voxel.y(), voxel.z()}};
}

understory_msgs::MapTile to_msg(TileSlot slot, const Tile& tile) {
  understory_msgs::MapTile msg;
  msg.slot = static_cast<std::uint32_t>(slot);
  std::copy(tile.log_odds.begin(), tile.log_odds.end(), msg.log_odds.begin());
  return msg;
}

TilePtr from_msg(const understory_msgs::MapTile& msg) {
  auto tile = std::make_shared<Tile>();
  for (std::size_t offset = 0; offset < kVoxelsPerTile; ++offset) {
    if (msg.log_odds[offset] != kUnknownLogOdds) {
      tile->set(offset, msg.log_odds[offset]);
    }
  }
  return tile;
}

}  // namespace

understory_msgs::MapUpdate to_msg(const MapUpdate& update) {
  if (!update.map) {
    return update.arrived;
  }
  const MapSnapshot& map = *update.map;
  understory_msgs::MapUpdate msg;
  msg.header = update.header;
  msg.resolution_m = map.geometry.resolution_m();
  msg.voxel_min = to_array(map.geometry.voxels().min);
  msg.voxel_end = to_array(map.geometry.voxels().end);
  msg.revision = map.revision;
  msg.is_whole = static_cast<std::uint8_t>(update.is_whole);
  std::vector<TileSlot> slots = map.changed_tiles;
  if (update.is_whole) {
    slots.resize(map.tiles.size());
    std::iota(slots.begin(), slots.end(), TileSlot{0});
  }
  for (const TileSlot slot : slots) {
    if (map.tiles[slot]) {
      msg.tiles.push_back(to_msg(slot, *map.tiles[slot]));
    }
  }
  return msg;
}

MapReceiver::MapReceiver(const MapConfig& config, const Box3d& box_m)
    : unknown_{
          GridGeometry(config.resolution_m, box_m), SensorModel(config.sensor), 0, {}, {}, {}} {
  unknown_.tiles.resize(unknown_.geometry.slot_count());
}

bool MapReceiver::fits(const understory_msgs::MapUpdate& msg) const {
  const GridGeometry& geometry = unknown_.geometry;
  const bool has_slots =
      std::all_of(msg.tiles.begin(), msg.tiles.end(), [&](const understory_msgs::MapTile& tile) {
        return tile.slot < geometry.slot_count();
      });
  return msg.resolution_m == geometry.resolution_m() &&
         msg.voxel_min == to_array(geometry.voxels().min) &&
         msg.voxel_end == to_array(geometry.voxels().end) && has_slots;
}

MapSnapshotPtr MapReceiver::accept(const MapUpdate& update) {
  if (update.map) {
    if (!(update.map->geometry == unknown_.geometry)) {
      return nullptr;
    }
    newest_ = update.map;
    return newest_;
  }
  const understory_msgs::MapUpdate& msg = update.arrived;
  const bool follows = newest_ && msg.revision == newest_->revision + 1;
  if (!fits(msg) || (msg.is_whole == 0 && !follows)) {
    return nullptr;
  }
  auto map = std::make_shared<MapSnapshot>(msg.is_whole != 0 ? unknown_ : *newest_);
  map->revision = msg.revision;
  map->stamp = to_time(msg.header.stamp);
  map->changed_tiles.clear();
  for (const understory_msgs::MapTile& tile : msg.tiles) {
    map->tiles[tile.slot] = from_msg(tile);
    map->changed_tiles.push_back(tile.slot);
  }
  std::sort(map->changed_tiles.begin(), map->changed_tiles.end());
  newest_ = std::move(map);
  return newest_;
}

}  // namespace understory
