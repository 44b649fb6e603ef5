// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/frontier/frontier_field.hpp"

#include <algorithm>

namespace understory {
namespace {

// The bits of a tile's rows that lie inside the box.
std::uint16_t row_mask(const GridGeometry& geometry, int tile_x) {
  const auto bits_below = [&](int end) {
    return (1U << static_cast<unsigned>(std::clamp(end - tile_x * kTileVoxels, 0, kTileVoxels))) -
           1U;
  };
  return static_cast<std::uint16_t>(bits_below(geometry.voxels().end.x()) &
                                    ~bits_below(geometry.voxels().min.x()));
}

// Row-wise access to what is unknown, across tile borders.
class UnknownRows {
 public:
  explicit UnknownRows(const MapSnapshot& snapshot) : snapshot_(snapshot) {}

  // Unknown voxels of the box in the row of tile column tile_x at voxel coordinates y, z.
  [[nodiscard]] std::uint32_t at(int tile_x, int y, int z) const {
    const GridGeometry& geometry = snapshot_.geometry;
    const VoxelBox& box = geometry.voxels();
    const Vector3i tile(tile_x, y >> kTileShift, z >> kTileShift);
    if (y < box.min.y() || y >= box.end.y() || z < box.min.z() || z >= box.end.z() ||
        !geometry.has_tile(tile)) {
      return 0;
    }
    const std::uint32_t mask = row_mask(geometry, tile_x);
    const Tile* content = snapshot_.tiles[geometry.slot_of_tile(tile)].get();
    return content == nullptr ? mask
                              : mask & ~std::uint32_t{content->known_rows[row_in_tile(y, z)]};
  }

 private:
  const MapSnapshot& snapshot_;
};

bool same_classes(const Tile* a, const Tile* b) {
  return a == b || (a != nullptr && b != nullptr && a->known_rows == b->known_rows &&
                    a->free_rows == b->free_rows);
}

void collect(std::uint32_t bits, const VoxelIndex& row_start, std::vector<VoxelIndex>& out) {
  for (int x = 0; bits != 0; ++x, bits >>= 1U) {
    if ((bits & 1U) != 0) {
      out.emplace_back(row_start.x() + x, row_start.y(), row_start.z());
    }
  }
}

}  // namespace

FrontierField::FrontierField(const GridGeometry& geometry) : rows_(geometry.slot_count()) {}

bool FrontierField::contains(const VoxelIndex& voxel) const {
  if (previous_ == nullptr || !previous_->geometry.contains(voxel)) {
    return false;
  }
  const Rows* rows = rows_[previous_->geometry.slot_of(voxel)].get();
  if (rows == nullptr) {
    return false;
  }
  const std::uint32_t row = (*rows)[row_in_tile(voxel.y(), voxel.z())];
  return ((row >> (static_cast<std::size_t>(voxel.x()) & 15U)) & 1U) != 0;
}

void FrontierField::refresh_tile(const MapSnapshot& snapshot, TileSlot slot, Change& change) {
  const Tile* tile = snapshot.tiles[slot].get();
  if (tile == nullptr) {
    return;
  }
  const GridGeometry& geometry = snapshot.geometry;
  const Vector3i coordinates = geometry.tile_of_slot(slot);
  const VoxelBox box = geometry.voxels_of_slot(slot);
  const UnknownRows unknown(snapshot);
  for (int z = box.min.z(); z < box.end.z(); ++z) {
    for (int y = box.min.y(); y < box.end.y(); ++y) {
      const std::size_t row = row_in_tile(y, z);
      const std::uint32_t free = tile->free_rows[row];
      const std::uint32_t before = rows_[slot] ? (*rows_[slot])[row] : 0U;
      std::uint32_t now = 0;
      if (free != 0) {
        const std::uint32_t own = unknown.at(coordinates.x(), y, z);
        const std::uint32_t left = (own << 1U) | (unknown.at(coordinates.x() - 1, y, z) >> 15U);
        const std::uint32_t right =
            (own >> 1U) | ((unknown.at(coordinates.x() + 1, y, z) & 1U) << 15U);
        now =
            free & (left | right | unknown.at(coordinates.x(), y - 1, z) |
                    unknown.at(coordinates.x(), y + 1, z) | unknown.at(coordinates.x(), y, z - 1) |
                    unknown.at(coordinates.x(), y, z + 1));
      }
      if (now == before) {
        continue;
      }
      if (!rows_[slot]) {
        rows_[slot] = std::make_unique<Rows>();
      }
      (*rows_[slot])[row] = static_cast<std::uint16_t>(now);
      const VoxelIndex row_start(coordinates.x() * kTileVoxels, y, z);
      collect(now & ~before, row_start, change.added);
      collect(before & ~now, row_start, change.removed);
    }
  }
}

FrontierField::Change FrontierField::update(const MapSnapshotPtr& snapshot) {
  Change change;
  const GridGeometry& geometry = snapshot->geometry;
  std::vector<TileSlot> stale;
  for (const TileSlot slot : tiles_changed_between(previous_.get(), *snapshot)) {
    const Tile* before = previous_ ? previous_->tiles[slot].get() : nullptr;
    if (same_classes(before, snapshot->tiles[slot].get())) {
      continue;
    }
    change.tiles.push_back(slot);
    stale.push_back(slot);
    const Vector3i tile = geometry.tile_of_slot(slot);
    for (int axis = 0; axis < 3; ++axis) {
      for (const int side : {-1, 1}) {
        Vector3i neighbour = tile;
        neighbour[axis] += side;
        if (geometry.has_tile(neighbour)) {
          stale.push_back(geometry.slot_of_tile(neighbour));
        }
      }
    }
  }
  std::sort(stale.begin(), stale.end());
  stale.erase(std::unique(stale.begin(), stale.end()), stale.end());
  for (const TileSlot slot : stale) {
    refresh_tile(*snapshot, slot, change);
  }
  previous_ = snapshot;
  return change;
}

}  // namespace understory
