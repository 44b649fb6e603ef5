// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "support/snapshot_builder.hpp"

#include <algorithm>
#include <cmath>

namespace understory::test {
namespace {

std::int8_t log_odds_of(const SensorModel& model, VoxelState state) {
  for (int value = -128; value < 128; ++value) {
    const auto log_odds = static_cast<std::int8_t>(value);
    if (model.state_of(log_odds) == state) {
      return log_odds;
    }
  }
  return kUnknownLogOdds;
}

}  // namespace

SnapshotBuilder::SnapshotBuilder(double resolution_m, const Box3d& box_m)
    : current_{
          GridGeometry(resolution_m, box_m), SensorModel(SensorModelConfig{}), 0, Time{}, {}, {}} {
  current_.tiles.resize(current_.geometry.slot_count());
  tiles_.resize(current_.geometry.slot_count());
  touched_.resize(current_.geometry.slot_count(), false);
  for (std::size_t state = 0; state < log_odds_.size(); ++state) {
    log_odds_[state] = log_odds_of(current_.sensor_model, static_cast<VoxelState>(state));
  }
}

SnapshotBuilder& SnapshotBuilder::set(const VoxelIndex& voxel, VoxelState state) {
  if (!geometry().contains(voxel)) {
    return *this;
  }
  const TileSlot slot = geometry().slot_of(voxel);
  Tile& tile = tiles_[slot];
  touched_[slot] = true;
  tile.log_odds[offset_in_tile(voxel)] = log_odds_[static_cast<std::size_t>(state)];
  const std::size_t row = row_in_tile(voxel.y(), voxel.z());
  const unsigned bit = 1U << (static_cast<unsigned>(voxel.x()) & 15U);
  const auto with = [bit](std::uint16_t bits, bool on) {
    return static_cast<std::uint16_t>(on ? bits | bit : bits & ~bit);
  };
  tile.free_rows[row] = with(tile.free_rows[row], state == VoxelState::kFree);
  tile.known_rows[row] = with(tile.known_rows[row], state != VoxelState::kUnknown);
  return *this;
}

void SnapshotBuilder::set_where(const VoxelBox& voxels,
                                const std::function<bool(const Vector3d& center_m)>& inside,
                                VoxelState state) {
  const VoxelBox range = voxels.clipped_to(geometry().voxels());
  for (int z = range.min.z(); z < range.end.z(); ++z) {
    for (int y = range.min.y(); y < range.end.y(); ++y) {
      for (int x = range.min.x(); x < range.end.x(); ++x) {
        if (inside(geometry().center_of({x, y, z}))) {
          set({x, y, z}, state);
        }
      }
    }
  }
}

SnapshotBuilder& SnapshotBuilder::fill(VoxelState state) {
  set_where(
      geometry().voxels(), [](const Vector3d&) { return true; }, state);
  return *this;
}

SnapshotBuilder& SnapshotBuilder::set_box(const Box3d& box_m, VoxelState state) {
  const VoxelBox range{geometry().index_of(box_m.min()),
                       geometry().index_of(box_m.max()) + VoxelIndex::Ones()};
  set_where(
      range, [&](const Vector3d& p) { return box_m.contains(p); }, state);
  return *this;
}

SnapshotBuilder& SnapshotBuilder::set_cylinder(const Vector2d& center_m,
                                               double radius_m,
                                               VoxelState state) {
  const Vector3d reach(radius_m, radius_m, 0.0);
  const Vector3d center(center_m.x(), center_m.y(), 0.0);
  VoxelBox range{geometry().index_of(center - reach),
                 geometry().index_of(center + reach) + VoxelIndex::Ones()};
  range.min.z() = geometry().voxels().min.z();
  range.end.z() = geometry().voxels().end.z();
  set_where(
      range, [&](const Vector3d& p) { return (p.head<2>() - center_m).norm() <= radius_m; }, state);
  return *this;
}

SnapshotBuilder& SnapshotBuilder::set_ball(const Vector3d& center_m,
                                           double radius_m,
                                           VoxelState state) {
  const Vector3d reach = Vector3d::Constant(radius_m);
  const VoxelBox range{geometry().index_of(center_m - reach),
                       geometry().index_of(center_m + reach) + VoxelIndex::Ones()};
  set_where(
      range, [&](const Vector3d& p) { return (p - center_m).norm() <= radius_m; }, state);
  return *this;
}

MapSnapshotPtr SnapshotBuilder::build() {
  current_.changed_tiles.clear();
  for (TileSlot slot = 0; slot < tiles_.size(); ++slot) {
    if (touched_[slot]) {
      current_.tiles[slot] = std::make_shared<const Tile>(tiles_[slot]);
      current_.changed_tiles.push_back(slot);
      touched_[slot] = false;
    }
  }
  ++current_.revision;
  return std::make_shared<const MapSnapshot>(current_);
}

SnapshotBuilder random_forest(const RandomForest& forest, Rng& rng) {
  SnapshotBuilder builder(0.1, forest.box_m);
  builder.fill(VoxelState::kFree);
  const Vector3d size = forest.box_m.sizes();
  const auto count = [&](double per_m2) {
    return static_cast<int>(std::lround(size.x() * size.y() * per_m2));
  };
  const auto draw = [&](int axis) {
    return rng.uniform(forest.box_m.min()[axis], forest.box_m.max()[axis]);
  };
  for (int i = 0; i < count(forest.trunks_per_m2); ++i) {
    const double x = draw(0);
    const double y = draw(1);
    builder.set_cylinder({x, y}, rng.uniform(0.1, 0.3), VoxelState::kOccupied);
  }
  for (int i = 0; i < count(forest.pockets_per_m2); ++i) {
    const double x = draw(0);
    const double y = draw(1);
    const double z = draw(2);
    builder.set_ball({x, y, z}, rng.uniform(0.1, 0.5), VoxelState::kUnknown);
  }
  return builder;
}

double brute_force_clearance_m(const MapSnapshot& map, const Vector3d& point_m, double limit_m) {
  const double resolution = map.geometry.resolution_m();
  const VoxelIndex low = map.geometry.index_of(point_m - Vector3d::Constant(limit_m));
  const VoxelIndex high = map.geometry.index_of(point_m + Vector3d::Constant(limit_m));
  double nearest = limit_m;
  for (int z = low.z(); z <= high.z(); ++z) {
    for (int y = low.y(); y <= high.y(); ++y) {
      for (int x = low.x(); x <= high.x(); ++x) {
        if (!map.is_free({x, y, z})) {
          const Vector3d corner = Vector3d(x, y, z) * resolution;
          const Box3d voxel(corner, corner + Vector3d::Constant(resolution));
          nearest = std::min(nearest, voxel.exteriorDistance(point_m));
        }
      }
    }
  }
  return nearest;
}

}  // namespace understory::test
