// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Layers of tiles and trajectories for tests of the team.
#pragma once

#include <cstdint>
#include <memory>

#include "understory/base/rng.hpp"
#include "understory/map/map_snapshot.hpp"
#include "understory/plan/trajectory.hpp"
#include "understory/team/layer_tile.hpp"

namespace understory::test {

// Any of the four states at every voxel inside the box; `slot` is of its tile.
[[nodiscard]] inline team::LayerTile random_layer(const GridGeometry& geometry,
                                                  TileSlot slot,
                                                  Rng& rng) {
  team::LayerTile layer;
  const VoxelBox voxels = geometry.voxels_of_slot(slot);
  for (int z = voxels.min.z(); z < voxels.end.z(); ++z) {
    for (int y = voxels.min.y(); y < voxels.end.y(); ++y) {
      for (int x = voxels.min.x(); x < voxels.end.x(); ++x) {
        layer.set(offset_in_tile({x, y, z}), static_cast<VoxelState>(rng.below(4)));
      }
    }
  }
  return layer;
}

// A tile of that layer as a mapper could have made it.
[[nodiscard]] inline TilePtr tile_of(const team::LayerTile& layer, const SensorModel& model) {
  auto tile = std::make_shared<Tile>();
  for (std::size_t offset = 0; offset < kVoxelsPerTile; ++offset) {
    const VoxelState state = layer.at(offset);
    if (state != VoxelState::kUnknown) {
      const int log_odds = state == VoxelState::kFree        ? -1
                           : state == VoxelState::kUncertain ? 0
                                                             : model.occupied_threshold;
      tile->set(offset, static_cast<std::int8_t>(log_odds));
    }
  }
  return tile;
}

// From one place to another, at rest at both ends, turning by a quarter.
[[nodiscard]] inline TrajectoryPtr straight_flight(std::uint64_t id,
                                                   const Vector3d& from_m,
                                                   const Vector3d& to_m,
                                                   Time start) {
  auto flight = std::make_shared<Trajectory>();
  flight->id = id;
  flight->start = start;
  flight->depth_stamp = start;
  flight->mode = FlightMode::kCollector;
  flight->position.knot_s = 0.213;
  flight->yaw.knot_s = 0.1;
  for (const double part : {0.0, 0.0, 0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0, 1.0, 1.0}) {
    flight->position.control_points.emplace_back(from_m + part * (to_m - from_m));
    flight->yaw.control_points.push_back(-0.5 * kPi * part);
  }
  return flight;
}

}  // namespace understory::test
