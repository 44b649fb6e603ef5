// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/map/map_snapshot.hpp"

namespace understory {

std::vector<TileSlot> tiles_changed_between(const MapSnapshot* older, const MapSnapshot& newer) {
  std::vector<TileSlot> changed;
  for (TileSlot slot = 0; slot < newer.tiles.size(); ++slot) {
    const Tile* before = older == nullptr ? nullptr : older->tiles[slot].get();
    if (newer.tiles[slot].get() != before) {
      changed.push_back(slot);
    }
  }
  return changed;
}

}  // namespace understory
