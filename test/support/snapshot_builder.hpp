// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Maps made by hand for tests: start from all free or all unknown, carve shapes, take snapshots
// that share what did not change, as the mapper's do. World frame, metres. A voxel belongs to a
// shape when its centre does.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "understory/base/rng.hpp"
#include "understory/map/map_snapshot.hpp"

namespace understory::test {

class SnapshotBuilder {
 public:
  SnapshotBuilder(double resolution_m, const Box3d& box_m);

  SnapshotBuilder& fill(VoxelState state);
  SnapshotBuilder& set(const VoxelIndex& voxel, VoxelState state);
  SnapshotBuilder& set_box(const Box3d& box_m, VoxelState state);
  SnapshotBuilder& set_cylinder(const Vector2d& center_m, double radius_m, VoxelState state);
  SnapshotBuilder& set_ball(const Vector3d& center_m, double radius_m, VoxelState state);

  [[nodiscard]] const GridGeometry& geometry() const { return current_.geometry; }
  [[nodiscard]] MapSnapshotPtr build();

 private:
  void set_where(const VoxelBox& voxels,
                 const std::function<bool(const Vector3d& center_m)>& inside,
                 VoxelState state);

  MapSnapshot current_;
  std::array<std::int8_t, 4> log_odds_{};  // one that stands for each state
  std::vector<Tile> tiles_;
  std::vector<bool> touched_;
};

// Trunks of 0.1 to 0.3 m radius at the given density in a free box, a few unknown pockets.
struct RandomForest {
  Box3d box_m{Vector3d(-8.0, -8.0, 0.0), Vector3d(8.0, 8.0, 2.0)};
  double trunks_per_m2 = 0.2;
  double pockets_per_m2 = 0.02;
};
[[nodiscard]] SnapshotBuilder random_forest(const RandomForest& forest, Rng& rng);

// Distance from the point to the nearest voxel (its closed box) that is not free, by looking at
// every voxel in reach; `limit_m` when there is none within.
[[nodiscard]] double brute_force_clearance_m(const MapSnapshot& map,
                                             const Vector3d& point_m,
                                             double limit_m);

}  // namespace understory::test
