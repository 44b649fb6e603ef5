// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What is told of a map at once: blocks of 2 x 2 x 2 tiles, fewer at the far faces of the map. A
// tile alone costs more for its frame than for its content. A value.
#pragma once

#include <cstddef>
#include <vector>

#include "understory/map/grid_geometry.hpp"

namespace understory::team {

using BlockIndex = std::size_t;

class TileBlocks {
 public:
  explicit TileBlocks(const GridGeometry& geometry);

  [[nodiscard]] std::size_t count() const { return slots_.size(); }
  [[nodiscard]] BlockIndex block_of(TileSlot slot) const { return blocks_[slot]; }
  // In ascending order.
  [[nodiscard]] const std::vector<TileSlot>& slots_of(BlockIndex block) const {
    return slots_[block];
  }

 private:
  std::vector<BlockIndex> blocks_;            // by slot
  std::vector<std::vector<TileSlot>> slots_;  // by block
};

}  // namespace understory::team
