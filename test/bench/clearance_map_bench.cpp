// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <benchmark/benchmark.h>

#include "support/snapshot_builder.hpp"
#include "understory/plan/clearance_map.hpp"

namespace understory {
namespace {

// Every tile of a forest, computed from nothing; the time per tile is what is reported.
void clearance_of_every_tile(benchmark::State& state) {
  Rng rng(1);
  test::RandomForest forest;
  forest.trunks_per_m2 = 0.2;
  const MapSnapshotPtr map = test::random_forest(forest, rng).build();
  std::int64_t tiles = 0;
  for (auto _ : state) {
    ClearanceMap clearance;
    clearance.update(map);
    int sum = 0;
    for (TileSlot slot = 0; slot < map->tiles.size(); ++slot) {
      sum += clearance.squared_distance_voxels(map->geometry.voxels_of_slot(slot).min);
      ++tiles;
    }
    benchmark::DoNotOptimize(sum);
  }
  state.SetItemsProcessed(tiles);
}
BENCHMARK(clearance_of_every_tile)->Name("ClearanceMap_Update/every_tile_dense");

// What a cloud changes: a ball of unknown becomes free somewhere, then a flight reads around it.
void clearance_after_a_change(benchmark::State& state) {
  Rng rng(1);
  test::SnapshotBuilder builder = test::random_forest({}, rng);
  builder.set_ball({0.0, 0.0, 1.0}, 1.5, VoxelState::kUnknown);
  const MapSnapshotPtr before = builder.build();
  const MapSnapshotPtr after = builder.set_ball({0.0, 0.0, 1.0}, 1.2, VoxelState::kFree).build();
  ClearanceMap clearance;
  clearance.update(before);
  bool changed = false;
  for (auto _ : state) {
    changed = !changed;
    clearance.update(changed ? after : before);
    int sum = 0;
    for (TileSlot slot = 0; slot < after->tiles.size(); ++slot) {
      sum += clearance.squared_distance_voxels(after->geometry.voxels_of_slot(slot).min);
    }
    benchmark::DoNotOptimize(sum);
  }
}
BENCHMARK(clearance_after_a_change)->Name("ClearanceMap_Update/change_of_1_m");

void clearance_queries(benchmark::State& state) {
  Rng rng(1);
  const MapSnapshotPtr map = test::random_forest({}, rng).build();
  ClearanceMap clearance;
  clearance.update(map);
  std::vector<Vector3d> points(4096);
  for (Vector3d& point : points) {
    point = Vector3d(rng.uniform(-7.0, 7.0), rng.uniform(-7.0, 7.0), rng.uniform(0.3, 1.7));
  }
  std::size_t i = 0;
  for (auto _ : state) {
    const Vector3d& point = points[++i % points.size()];
    if (state.range(0) == 0) {
      benchmark::DoNotOptimize(clearance.clearance_at_least(point, 0.28));
    } else {
      benchmark::DoNotOptimize(clearance.distance_and_gradient(point));
    }
  }
}
BENCHMARK(clearance_queries)->Name("ClearanceMap_ClearanceAtLeast/dense")->Arg(0);
BENCHMARK(clearance_queries)->Name("ClearanceMap_DistanceAndGradient/dense")->Arg(1);

}  // namespace
}  // namespace understory
