// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/frontier/frontier_field.hpp"

#include <algorithm>
#include <array>

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

// Row-wise access to what is unknown in a tile and beside it.
class UnknownRows {
 public:
  UnknownRows(const MapSnapshot& snapshot, const Vector3i& tile)
      : box_(snapshot.geometry.voxels()), own_z_(tile.z()), own_y_(tile.y()) {
    const auto column = [&](int dx, int dy, int dz) {
      const Vector3i place = tile + Vector3i(dx, dy, dz);
      const bool is_there = snapshot.geometry.has_tile(place);
      const Tile* content =
          is_there ? snapshot.tiles[snapshot.geometry.slot_of_tile(place)].get() : nullptr;
      return Column{content, is_there ? row_mask(snapshot.geometry, place.x()) : std::uint16_t{0}};
    };
    own_ = column(0, 0, 0);
    left_ = column(-1, 0, 0);
    right_ = column(1, 0, 0);
    beside_y_ = {column(0, -1, 0), column(0, 1, 0)};
    beside_z_ = {column(0, 0, -1), column(0, 0, 1)};
  }

  // Unknown voxels of the box in a row of the tile, y or z being at most one beyond it.
  [[nodiscard]] std::uint32_t own(int y, int z) const {
    if (y < box_.min.y() || y >= box_.end.y() || z < box_.min.z() || z >= box_.end.z()) {
      return 0;
    }
    const int dy = (y >> kTileShift) - own_y_;
    const int dz = (z >> kTileShift) - own_z_;
    const Column& column = dy != 0   ? beside_y_[dy < 0 ? 0 : 1]
                           : dz != 0 ? beside_z_[dz < 0 ? 0 : 1]
                                     : own_;
    return unknown(column, y, z);
  }
  // The same of the tiles before and behind along x; y and z within the tile.
  [[nodiscard]] std::uint32_t left(int y, int z) const { return unknown(left_, y, z); }
  [[nodiscard]] std::uint32_t right(int y, int z) const { return unknown(right_, y, z); }

 private:
  struct Column {
    const Tile* tile = nullptr;  // null: unknown throughout
    std::uint16_t mask = 0;      // what of it lies inside the box
  };

  [[nodiscard]] static std::uint32_t unknown(const Column& column, int y, int z) {
    const std::uint32_t known =
        column.tile == nullptr ? 0U : column.tile->known_rows[row_in_tile(y, z)];
    return column.mask & ~known;
  }

  VoxelBox box_;
  int own_z_;
  int own_y_;
  Column own_;
  Column left_;
  Column right_;
  std::array<Column, 2> beside_y_;
  std::array<Column, 2> beside_z_;
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
  const UnknownRows unknown(snapshot, coordinates);
  for (int z = box.min.z(); z < box.end.z(); ++z) {
    for (int y = box.min.y(); y < box.end.y(); ++y) {
      const std::size_t row = row_in_tile(y, z);
      const std::uint32_t free = tile->free_rows[row];
      const std::uint32_t before = rows_[slot] ? (*rows_[slot])[row] : 0U;
      std::uint32_t now = 0;
      if (free != 0) {
        const std::uint32_t own = unknown.own(y, z);
        const std::uint32_t left = (own << 1U) | (unknown.left(y, z) >> 15U);
        const std::uint32_t right = (own >> 1U) | ((unknown.right(y, z) & 1U) << 15U);
        now = free & (left | right | unknown.own(y - 1, z) | unknown.own(y + 1, z) |
                      unknown.own(y, z - 1) | unknown.own(y, z + 1));
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
