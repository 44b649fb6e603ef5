// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// How far it is to the nearest voxel that is not known free (unknown, uncertain, occupied, outside
// the box). Metres, world frame. Kept per map tile and brought up to date from the tiles that
// changed; distances are exact Euclidean between voxel centres up to max_distance_m(), beyond
// which they saturate (Felzenszwalb and Huttenlocher 2012, windowed). Used by one thread: a read
// computes the tile it falls into when a change has made that stale, so that tiles nobody asks for
// cost nothing; the answers do not depend on when that happens.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "understory/map/map_snapshot.hpp"

namespace understory {

struct DistanceAndGradient {
  double distance_m;
  Vector3d gradient;  // per metre, zero where the distance saturates
};

class ClearanceMap {
 public:
  static constexpr int kReachVoxels = 8;

  ClearanceMap() = default;

  // Recomputes what the change from the snapshot of the previous call can have moved.
  void update(const MapSnapshotPtr& snapshot);

  [[nodiscard]] const MapSnapshot& snapshot() const { return *snapshot_; }
  [[nodiscard]] const GridGeometry& geometry() const { return snapshot_->geometry; }
  [[nodiscard]] double max_distance_m() const { return kReachVoxels * geometry().resolution_m(); }

  // Between voxel centres, in squared voxels, saturating at kReachVoxels^2; 0: the voxel itself is
  // not free (or outside the box).
  [[nodiscard]] int squared_distance_voxels(const VoxelIndex& voxel) const {
    if (!geometry().contains(voxel)) {
      return 0;
    }
    return tile_of(geometry().slot_of(voxel))[offset_in_tile(voxel)];
  }

  // Trilinear between voxel centres, half a voxel taken off so that it approximates the distance to
  // the nearest non-free voxel's face. For costs; decisions on safety use clearance_at_least.
  [[nodiscard]] double distance_m(const Vector3d& point_m) const;
  [[nodiscard]] DistanceAndGradient distance_and_gradient(const Vector3d& point_m) const;

  // The distance from the point to any voxel that is not free is at least this (0 in such a voxel);
  // one look-up, up to two voxel diagonals below the truth.
  [[nodiscard]] double distance_lower_bound_m(const Vector3d& point_m) const;

  // Exact: the closed ball around the point touches no voxel that is not free.
  // radius_m < max_distance_m() - 2 voxels.
  [[nodiscard]] bool clearance_at_least(const Vector3d& point_m, double radius_m) const;

 private:
  using DistanceTile = std::array<std::uint8_t, kVoxelsPerTile>;
  using DistanceTilePtr = std::shared_ptr<const DistanceTile>;

  // The eight voxel centres around a point and where the point lies between them.
  struct Cell {
    std::array<float, 8> distance_voxels{};  // x fastest, then y, then z
    Vector3d fraction = Vector3d::Zero();
  };

  void mark_stale(TileSlot slot, const VoxelBox& changed_in_tile);
  [[nodiscard]] const DistanceTile& tile_of(TileSlot slot) const {
    const DistanceTile* tile = tiles_[slot].get();
    return tile != nullptr ? *tile : fresh_tile(slot);
  }
  const DistanceTile& fresh_tile(TileSlot slot) const;
  [[nodiscard]] DistanceTilePtr computed_tile(TileSlot slot) const;
  [[nodiscard]] Cell cell_at(const Vector3d& point_m) const;
  [[nodiscard]] bool ball_is_free(const Vector3d& point_m, double radius_m) const;

  MapSnapshotPtr snapshot_;
  DistanceTilePtr blocked_tile_;  // 0 throughout
  DistanceTilePtr open_tile_;     // saturated throughout
  // A cache: null where stale.
  mutable std::vector<DistanceTilePtr> tiles_;
};

}  // namespace understory
