// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/frontier/trail_label.hpp"

#include <array>
#include <cmath>
#include <cstdint>

#include "understory/frontier/clustering.hpp"

namespace understory {
namespace {

const std::array<Vector3i, 6>& face_neighbours() {
  static const std::array<Vector3i, 6> kOffsets{Vector3i(1, 0, 0),
                                                Vector3i(-1, 0, 0),
                                                Vector3i(0, 1, 0),
                                                Vector3i(0, -1, 0),
                                                Vector3i(0, 0, 1),
                                                Vector3i(0, 0, -1)};
  return kOffsets;
}

// The unknown component that a cluster borders, as far as it is small.
class UnknownIsland {
 public:
  UnknownIsland(const MapSnapshot& snapshot, const Cluster& cluster, std::size_t max_voxels)
      : snapshot_(snapshot) {
    VoxelBox bounds{cluster.voxels.front(), cluster.voxels.front()};
    for (const VoxelIndex& voxel : cluster.voxels) {
      bounds.min = bounds.min.cwiseMin(voxel);
      bounds.end = bounds.end.cwiseMax(voxel);
    }
    // No small component reaches further than the edge of a cube of twice its volume per axis.
    const int reach = 2 + static_cast<int>(2.0 * std::cbrt(static_cast<double>(max_voxels)));
    window_ = VoxelBox{bounds.min.array() - reach, bounds.end.array() + reach + 1}.clipped_to(
        snapshot.geometry.voxels());
    const Vector3i size = window_.size();
    seen_.resize(static_cast<std::size_t>(size.x()) * static_cast<std::size_t>(size.y()) *
                 static_cast<std::size_t>(size.z()));
    is_small_ = flood(cluster, max_voxels);
  }

  [[nodiscard]] bool is_small() const { return is_small_; }
  [[nodiscard]] std::size_t voxel_count() const { return voxel_count_; }
  [[nodiscard]] bool contains(const VoxelIndex& voxel) const {
    return is_small_ && window_.contains(voxel) && seen_[offset(voxel)] != 0;
  }

 private:
  [[nodiscard]] std::size_t offset(const VoxelIndex& voxel) const {
    const Vector3i local = voxel - window_.min;
    const Vector3i size = window_.size();
    return (static_cast<std::size_t>(local.z()) * static_cast<std::size_t>(size.y()) +
            static_cast<std::size_t>(local.y())) *
               static_cast<std::size_t>(size.x()) +
           static_cast<std::size_t>(local.x());
  }

  // False when a neighbour lies outside the window: then the component is not small.
  bool spread(const VoxelIndex& from, std::vector<VoxelIndex>& open) {
    for (const Vector3i& step : face_neighbours()) {
      const VoxelIndex next = from + step;
      if (!snapshot_.geometry.contains(next) || snapshot_.is_known(next)) {
        continue;
      }
      if (!window_.contains(next)) {
        return false;
      }
      std::uint8_t& seen = seen_[offset(next)];
      if (seen == 0) {
        seen = 1;
        open.push_back(next);
      }
    }
    return true;
  }

  bool flood(const Cluster& cluster, std::size_t max_voxels) {
    std::vector<VoxelIndex> open;
    for (const VoxelIndex& voxel : cluster.voxels) {
      if (!spread(voxel, open)) {
        return false;
      }
    }
    // Depth first: in the open it runs straight out of the window.
    while (!open.empty()) {
      const VoxelIndex voxel = open.back();
      open.pop_back();
      ++voxel_count_;
      if (voxel_count_ + open.size() > max_voxels || !spread(voxel, open)) {
        return false;
      }
    }
    return true;
  }

  const MapSnapshot& snapshot_;
  VoxelBox window_;
  std::vector<std::uint8_t> seen_;
  bool is_small_ = false;
  std::size_t voxel_count_ = 0;
};

}  // namespace

Surroundings surroundings_of(const MapSnapshot& snapshot,
                             const Cluster& cluster,
                             const TrailConfig& config) {
  const GridGeometry& geometry = snapshot.geometry;
  const double voxel_m3 = std::pow(geometry.resolution_m(), 3);
  const UnknownIsland island(
      snapshot, cluster, static_cast<std::size_t>(config.max_component_m3 / voxel_m3));
  if (!island.is_small()) {
    return {};
  }
  std::vector<Vector2d> columns;
  columns.reserve(cluster.voxels.size());
  for (const VoxelIndex& voxel : cluster.voxels) {
    columns.push_back(voxel.head<2>().cast<double>());
  }
  const std::vector<Vector2d> hull = convex_hull(std::move(columns));
  const double ring_voxels = config.ring_m / geometry.resolution_m();
  const VoxelIndex low = geometry.index_of(cluster.bounds_m.min());
  const VoxelIndex high = geometry.index_of(cluster.bounds_m.max());
  const auto reach = static_cast<int>(std::ceil(ring_voxels));
  int in_ring = 0;
  int foreign_unknown = 0;
  for (int y = low.y() - reach; y <= high.y() + reach; ++y) {
    for (int x = low.x() - reach; x <= high.x() + reach; ++x) {
      const double distance = distance_to_convex_polygon(hull, Vector2d(x, y));
      if (distance <= 0.0 || distance > ring_voxels) {
        continue;
      }
      for (int z = low.z(); z <= high.z(); ++z) {
        const VoxelIndex voxel(x, y, z);
        if (!geometry.contains(voxel)) {
          continue;
        }
        ++in_ring;
        foreign_unknown += !snapshot.is_known(voxel) && !island.contains(voxel) ? 1 : 0;
      }
    }
  }
  return {foreign_unknown <= config.max_unknown_share * in_ring,
          static_cast<double>(island.voxel_count()) * voxel_m3};
}

}  // namespace understory
