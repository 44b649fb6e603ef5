// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/coverage_truth.hpp"

#include <algorithm>
#include <cstdlib>
#include <optional>
#include <sstream>

#include "understory/sim/sight_search.hpp"
#include "understory/sim/voxel_mask.hpp"

namespace understory {
namespace {

// A start need not lie on the grid of places: the places around it count as reached.
constexpr int kStartReach = 2;

struct World {
  const ForestTruth& truth;
  const GridGeometry& geometry;
  double vehicle_radius_m;
  bool columns;  // the same at every height: one layer stands for all
};

VoxelBox places_box(const World& world) {
  VoxelBox box = world.geometry.voxels();
  if (world.columns) {
    box.end.z() = box.min.z() + 1;
  }
  return box;
}

bool vehicle_fits(const World& world, const VoxelIndex& voxel) {
  const Vector3d center_m = world.geometry.center_of(voxel);
  const double radius_m = world.vehicle_radius_m;
  if (world.columns) {
    return world.truth.trunks().distance_m(center_m.head<2>(), radius_m) >= radius_m;
  }
  return center_m.z() >= radius_m &&
         world.truth.distance_to_nearest_surface_m(center_m, radius_m) >= radius_m;
}

// The place in a column that is nearest to the start's height.
std::optional<VoxelIndex> place_in_column(const World& world, const VoxelIndex& start) {
  const VoxelBox box = places_box(world);
  std::optional<VoxelIndex> nearest;
  for (VoxelIndex voxel(start.x(), start.y(), box.min.z()); box.contains(voxel); ++voxel.z()) {
    const bool nearer = !nearest.has_value() ||
                        std::abs(voxel.z() - start.z()) < std::abs(nearest->z() - start.z());
    if (nearer && vehicle_fits(world, voxel)) {
      nearest = voxel;
    }
  }
  return nearest;
}

std::vector<VoxelIndex> places_at(const World& world, const Vector3d& start_m) {
  const VoxelIndex start = world.geometry.index_of(start_m);
  std::vector<VoxelIndex> places;
  for (int dy = -kStartReach; dy <= kStartReach; ++dy) {
    for (int dx = -kStartReach; dx <= kStartReach; ++dx) {
      const std::optional<VoxelIndex> place = place_in_column(world, start + VoxelIndex(dx, dy, 0));
      if (place.has_value()) {
        places.push_back(*place);
      }
    }
  }
  if (places.empty()) {
    std::ostringstream text;
    text << "start (" << start_m.x() << ", " << start_m.y() << "): no room for a vehicle of radius "
         << world.vehicle_radius_m << " m inside the box";
    throw ForestError(text.str());
  }
  return places;
}

VoxelMask reachable_places(const World& world, const std::vector<Vector3d>& starts_m) {
  std::vector<VoxelIndex> seeds;
  for (const Vector3d& start_m : starts_m) {
    const std::vector<VoxelIndex> places = places_at(world, start_m);
    seeds.insert(seeds.end(), places.begin(), places.end());
  }
  return flooded(places_box(world), seeds, [&](const VoxelIndex& voxel) {
    return vehicle_fits(world, voxel);
  });
}

}  // namespace

CoverageTruth::CoverageTruth(const ForestTruth& truth,
                             const GridGeometry& geometry,
                             const std::vector<Vector3d>& starts_m,
                             const CameraConfig& camera,
                             double vehicle_radius_m)
    : geometry_(geometry), rows_(geometry.slot_count(), Rows{}) {
  const Box3d box_m = geometry.box_m();
  const Forest& forest = truth.forest();
  const World world{truth,
                    geometry_,
                    vehicle_radius_m,
                    forest.meshes.empty() && forest.trunk_height_m >= box_m.max().z()};
  const VoxelMask reachable = reachable_places(world, starts_m);
  const VoxelMask free = free_voxels(forest, geometry_, places_box(world));
  const SightProblem problem{truth,
                             geometry_,
                             camera,
                             free,
                             reachable,
                             std::max(box_m.min().z(), vehicle_radius_m),
                             box_m.max().z()};
  const auto add = [&](const VoxelIndex& voxel) {
    const auto bit = static_cast<unsigned>(voxel.x()) % kTileVoxels;
    std::uint16_t& row = rows_[geometry_.slot_of(voxel)][row_in_tile(voxel.y(), voxel.z())];
    row = static_cast<std::uint16_t>(row | 1U << bit);
    ++voxel_count_;
  };
  if (world.columns) {
    find_visible_in_columns(problem, add);
  } else {
    find_visible_by_rays(problem, add);
  }
  if (voxel_count_ == 0) {
    throw ForestError("nothing of the box can be seen from where the vehicle can be");
  }
}

bool CoverageTruth::contains(const VoxelIndex& voxel) const {
  if (!geometry_.contains(voxel)) {
    return false;
  }
  const auto bit = static_cast<unsigned>(voxel.x()) % kTileVoxels;
  return (rows_[geometry_.slot_of(voxel)][row_in_tile(voxel.y(), voxel.z())] >> bit & 1U) != 0;
}

}  // namespace understory
