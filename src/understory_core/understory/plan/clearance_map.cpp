// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/plan/clearance_map.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>

#include "understory/plan/distance_transform.hpp"

namespace understory {
namespace {

static_assert(ClearanceMap::kReachVoxels == kHaloVoxels);

using FreeRows = std::array<std::uint16_t, kRowsPerTile>;

constexpr std::size_t kDistances = kSaturatedSquare + 1;

constexpr std::array<float, kDistances> square_roots() {
  std::array<float, kDistances> roots{};
  for (std::size_t i = 1; i < roots.size(); ++i) {
    double root = 8.0;
    for (int newton = 0; newton < 10; ++newton) {
      root = 0.5 * (root + static_cast<double>(i) / root);
    }
    roots[i] = static_cast<float>(root);
  }
  return roots;
}
constexpr std::array<float, kDistances> kSquareRoot = square_roots();

// Where two tiles differ in what is free, in voxels of the tile; empty: nowhere.
VoxelBox free_bits_changed(const Tile* older, const Tile* newer) {
  constexpr FreeRows kNothingFree{};
  const FreeRows& before = older == nullptr ? kNothingFree : older->free_rows;
  const FreeRows& after = newer == nullptr ? kNothingFree : newer->free_rows;
  if (std::memcmp(before.data(), after.data(), sizeof(FreeRows)) == 0) {
    return {};
  }
  VoxelBox changed{VoxelIndex::Constant(kTileVoxels), VoxelIndex::Zero()};
  unsigned columns = 0;
  for (std::size_t row = 0; row < kRowsPerTile; ++row) {
    const unsigned difference = static_cast<unsigned>(before[row]) ^ after[row];
    if (difference != 0) {
      columns |= difference;
      const VoxelIndex voxel(0, static_cast<int>(row & 15U), static_cast<int>(row >> 4U));
      changed.min = changed.min.cwiseMin(voxel);
      changed.end = changed.end.cwiseMax(voxel + VoxelIndex::Ones());
    }
  }
  changed.min.x() = __builtin_ctz(columns);
  changed.end.x() = 32 - __builtin_clz(columns);
  return changed;
}

// Free bits of a tile's rows that lie inside the box.
class BoxedRows {
 public:
  BoxedRows(const MapSnapshot& snapshot, const Vector3i& tile) {
    if (!snapshot.geometry.has_tile(tile)) {
      return;
    }
    const TileSlot slot = snapshot.geometry.slot_of_tile(tile);
    const Tile* content = snapshot.tiles[slot].get();
    if (content == nullptr) {
      return;
    }
    rows_ = &content->free_rows;
    inside_ = snapshot.geometry.voxels_of_slot(slot);
    inside_.min -= tile * kTileVoxels;
    inside_.end -= tile * kTileVoxels;
    x_mask_ = ((1U << static_cast<unsigned>(inside_.end.x())) - 1U) &
              ~((1U << static_cast<unsigned>(inside_.min.x())) - 1U);
  }
  [[nodiscard]] bool empty() const { return rows_ == nullptr; }
  [[nodiscard]] unsigned row(int y, int z) const {
    const bool inside =
        y >= inside_.min.y() && y < inside_.end.y() && z >= inside_.min.z() && z < inside_.end.z();
    return inside ? (*rows_)[row_in_tile(y, z)] & x_mask_ : 0U;
  }

 private:
  const FreeRows* rows_ = nullptr;
  VoxelBox inside_;
  unsigned x_mask_ = 0;
};

// The half-open range of the block's coordinate that a neighbour at -1, 0 or 1 covers.
struct BlockRange {
  int begin;
  int end;
  int tile_shift;  // block coordinate minus this is the coordinate in the neighbour's tile
};
constexpr BlockRange block_range(int neighbour) {
  const int shift = kHaloVoxels + neighbour * kTileVoxels;
  return {std::max(0, shift), std::min(kBlockVoxels, shift + kTileVoxels), shift};
}

FreeBlock free_block_around(const MapSnapshot& snapshot, const Vector3i& tile) {
  FreeBlock block{};
  for (int dz = -1; dz <= 1; ++dz) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const BoxedRows rows(snapshot, tile + Vector3i(dx, dy, dz));
        if (rows.empty()) {
          continue;
        }
        const BlockRange along_y = block_range(dy);
        const BlockRange along_z = block_range(dz);
        const int shift = block_range(dx).tile_shift;
        for (int z = along_z.begin; z < along_z.end; ++z) {
          for (int y = along_y.begin; y < along_y.end; ++y) {
            const unsigned bits = rows.row(y - along_y.tile_shift, z - along_z.tile_shift);
            block[static_cast<std::size_t>(z) * kBlockVoxels + static_cast<std::size_t>(y)] |=
                shift >= 0 ? bits << static_cast<unsigned>(shift)
                           : bits >> static_cast<unsigned>(-shift);
          }
        }
      }
    }
  }
  return block;
}

constexpr double kHalfDiagonal = 0.8660254037844386;  // of a voxel, in voxels

double square(double x) {
  return x * x;
}

// Distance from a coordinate, in voxels, to voxel i's interval on that axis.
double distance_to_interval(double coordinate, int i) {
  return std::max({0.0, i - coordinate, coordinate - (i + 1)});
}

}  // namespace

void ClearanceMap::update(const MapSnapshotPtr& snapshot) {
  assert(snapshot != nullptr);
  const bool same_map = snapshot_ != nullptr && snapshot_->geometry == snapshot->geometry;
  if (!same_map) {
    auto blocked = std::make_shared<DistanceTile>();
    blocked->fill(0);
    auto open = std::make_shared<DistanceTile>();
    open->fill(kSaturatedSquare);
    blocked_tile_ = std::move(blocked);
    open_tile_ = std::move(open);
    tiles_.assign(snapshot->geometry.slot_count(), nullptr);
    snapshot_ = snapshot;
    return;
  }
  const MapSnapshotPtr older = std::exchange(snapshot_, snapshot);
  for (const TileSlot slot : tiles_changed_between(older.get(), *snapshot)) {
    const VoxelBox changed =
        free_bits_changed(older->tiles[slot].get(), snapshot->tiles[slot].get());
    if (!changed.empty()) {
      mark_stale(slot, changed);
    }
  }
}

void ClearanceMap::mark_stale(TileSlot slot, const VoxelBox& changed_in_tile) {
  // What is kReachVoxels away is saturated with or without the change.
  constexpr int kMoves = kReachVoxels - 1;
  const Vector3i tile = geometry().tile_of_slot(slot);
  const auto floor_tile = [](int voxel) { return voxel >> kTileShift; };
  const Vector3i first = (changed_in_tile.min.array() - kMoves).matrix().unaryExpr(floor_tile);
  const Vector3i last = (changed_in_tile.end.array() - 1 + kMoves).matrix().unaryExpr(floor_tile);
  for (int dz = first.z(); dz <= last.z(); ++dz) {
    for (int dy = first.y(); dy <= last.y(); ++dy) {
      for (int dx = first.x(); dx <= last.x(); ++dx) {
        const Vector3i neighbour = tile + Vector3i(dx, dy, dz);
        if (geometry().has_tile(neighbour)) {
          tiles_[geometry().slot_of_tile(neighbour)] = nullptr;
        }
      }
    }
  }
}

const ClearanceMap::DistanceTile& ClearanceMap::fresh_tile(TileSlot slot) const {
  tiles_[slot] = computed_tile(slot);
  return *tiles_[slot];
}

ClearanceMap::DistanceTilePtr ClearanceMap::computed_tile(TileSlot slot) const {
  const Tile* center = snapshot_->tiles[slot].get();
  const auto is_zero = [](std::uint16_t row) { return row == 0; };
  if (center == nullptr ||
      std::all_of(center->free_rows.begin(), center->free_rows.end(), is_zero)) {
    return blocked_tile_;
  }
  const FreeBlock block = free_block_around(*snapshot_, geometry().tile_of_slot(slot));
  if (std::all_of(block.begin(), block.end(), [](std::uint32_t row) { return row == ~0U; })) {
    return open_tile_;
  }
  return std::make_shared<const DistanceTile>(squared_distances(block));
}

ClearanceMap::Cell ClearanceMap::cell_at(const Vector3d& point_m) const {
  const Vector3d scaled = point_m / geometry().resolution_m() - Vector3d::Constant(0.5);
  const VoxelIndex low(static_cast<int>(std::floor(scaled.x())),
                       static_cast<int>(std::floor(scaled.y())),
                       static_cast<int>(std::floor(scaled.z())));
  const VoxelIndex high = low + VoxelIndex::Ones();
  Cell cell;
  cell.fraction = scaled - low.cast<double>();
  constexpr int kLast = kTileVoxels - 1;
  const bool within_one_tile = (low.x() & kLast) != kLast && (low.y() & kLast) != kLast &&
                               (low.z() & kLast) != kLast && geometry().contains(low) &&
                               geometry().contains(high);
  if (within_one_tile) {
    const std::uint8_t* corner = &tile_of(geometry().slot_of(low))[offset_in_tile(low)];
    constexpr std::array<std::size_t, 8> kOffsets{0, 1, 16, 17, 256, 257, 272, 273};
    for (std::size_t i = 0; i < 8; ++i) {
      cell.distance_voxels[i] = kSquareRoot[corner[kOffsets[i]]];
    }
    return cell;
  }
  for (std::size_t i = 0; i < 8; ++i) {
    const VoxelIndex voxel((i & 1U) != 0 ? high.x() : low.x(),
                           (i & 2U) != 0 ? high.y() : low.y(),
                           (i & 4U) != 0 ? high.z() : low.z());
    cell.distance_voxels[i] = kSquareRoot[static_cast<std::size_t>(squared_distance_voxels(voxel))];
  }
  return cell;
}

double ClearanceMap::distance_m(const Vector3d& point_m) const {
  return distance_and_gradient(point_m).distance_m;
}

DistanceAndGradient ClearanceMap::distance_and_gradient(const Vector3d& point_m) const {
  const Cell cell = cell_at(point_m);
  const std::array<float, 8>& d = cell.distance_voxels;
  const Vector3d& f = cell.fraction;
  std::array<double, 4> along_x{};
  std::array<double, 4> slope_x{};
  for (std::size_t i = 0; i < 4; ++i) {
    slope_x[i] = static_cast<double>(d[2 * i + 1] - d[2 * i]);
    along_x[i] = static_cast<double>(d[2 * i]) + slope_x[i] * f.x();
  }
  const double low_y = along_x[1] - along_x[0];
  const double high_y = along_x[3] - along_x[2];
  const double low = along_x[0] + low_y * f.y();
  const double high = along_x[2] + high_y * f.y();
  const double slope_low = slope_x[0] + (slope_x[1] - slope_x[0]) * f.y();
  const double slope_high = slope_x[2] + (slope_x[3] - slope_x[2]) * f.y();
  const double distance = low + (high - low) * f.z();
  return {
      (distance - 0.5) * geometry().resolution_m(),
      {slope_low + (slope_high - slope_low) * f.z(), low_y + (high_y - low_y) * f.z(), high - low}};
}

double ClearanceMap::distance_lower_bound_m(const Vector3d& point_m) const {
  const VoxelIndex voxel = geometry().index_of(point_m);
  const auto square_voxels = static_cast<std::size_t>(squared_distance_voxels(voxel));
  const double off_center_m = (point_m - geometry().center_of(voxel)).norm();
  const double center_distance_voxels = static_cast<double>(kSquareRoot[square_voxels]);
  return std::max(
      0.0, (center_distance_voxels - kHalfDiagonal) * geometry().resolution_m() - off_center_m);
}

bool ClearanceMap::clearance_at_least(const Vector3d& point_m, double radius_m) const {
  assert(radius_m < max_distance_m() - 2.0 * geometry().resolution_m());
  const VoxelIndex voxel = geometry().index_of(point_m);
  const int square_voxels = squared_distance_voxels(voxel);
  if (square_voxels == 0) {
    return false;
  }
  // From the point to the nearest blocked voxel's box it is at least, and at most, this far; the
  // slack keeps rounding out of the decision.
  constexpr double kSlack = 1e-5;
  const double scale = 1.0 / geometry().resolution_m();
  const double off_center = (point_m - geometry().center_of(voxel)).norm() * scale;
  const double center_distance =
      static_cast<double>(kSquareRoot[static_cast<std::size_t>(square_voxels)]);
  const double radius = radius_m * scale;
  if (center_distance - off_center - kHalfDiagonal > radius + kSlack) {
    return true;
  }
  if (square_voxels < kSaturatedSquare && center_distance + off_center - 0.5 < radius - kSlack) {
    return false;
  }
  return ball_is_free(point_m, radius_m);
}

bool ClearanceMap::ball_is_free(const Vector3d& point_m, double radius_m) const {
  const double scale = 1.0 / geometry().resolution_m();
  const Vector3d center = point_m * scale;
  const double radius = radius_m * scale;
  // Closed ball, closed boxes: a box that begins where the ball ends is touched.
  const auto first_touched = [](double low) { return static_cast<int>(std::ceil(low)) - 1; };
  const auto last_touched = [](double high) { return static_cast<int>(std::floor(high)); };
  for (int z = first_touched(center.z() - radius); z <= last_touched(center.z() + radius); ++z) {
    const double left_after_z = square(radius) - square(distance_to_interval(center.z(), z));
    for (int y = first_touched(center.y() - radius); y <= last_touched(center.y() + radius); ++y) {
      const double left = left_after_z - square(distance_to_interval(center.y(), y));
      if (left < 0.0) {
        continue;
      }
      const double reach = std::sqrt(left);
      const int last = last_touched(center.x() + reach);
      for (int x = first_touched(center.x() - reach); x <= last;) {
        // As much of the row as lies in one tile.
        const int end = std::min(last + 1, (x | (kTileVoxels - 1)) + 1);
        const Tile* tile = snapshot_->tile_at({x, y, z});
        if (tile == nullptr || !geometry().contains({end - 1, y, z})) {
          return false;
        }
        const unsigned wanted = ((1U << static_cast<unsigned>(end - x)) - 1U)
                                << (static_cast<unsigned>(x) & 15U);
        if ((tile->free_rows[row_in_tile(y, z)] & wanted) != wanted) {
          return false;
        }
        x = end;
      }
    }
  }
  return true;
}

}  // namespace understory
