// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/team/tile_blocks.hpp"

namespace understory::team {

TileBlocks::TileBlocks(const GridGeometry& geometry) : blocks_(geometry.slot_count()) {
  const Vector3i count = (geometry.tile_count() + Vector3i::Ones()) / 2;
  slots_.resize(static_cast<std::size_t>(count.prod()));
  for (TileSlot slot = 0; slot < blocks_.size(); ++slot) {
    const Vector3i at = (geometry.tile_of_slot(slot) - geometry.tile_min()) / 2;
    const int block = (at.z() * count.y() + at.y()) * count.x() + at.x();
    blocks_[slot] = static_cast<BlockIndex>(block);
    slots_[blocks_[slot]].push_back(slot);
  }
}

}  // namespace understory::team
