// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Keeps the clusters of frontier voxels with their labels and viewpoints in step with the map, at
// a cost that follows what changed, not what there is (Zhou et al. 2021, FUEL, section IV).
// Clusters that no viewpoint can see are dormant: kept, and tried again when the map near them
// changes. World frame, metres. One thread; cannot fail in flight.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "understory/frontier/cluster.hpp"
#include "understory/frontier/frontier_config.hpp"
#include "understory/frontier/frontier_field.hpp"
#include "understory/frontier/viewpoint_sampler.hpp"

namespace understory {

class FrontierFinder {
 public:
  FrontierFinder(const FrontierConfig& config,
                 const CameraConfig& camera,
                 const GridGeometry& geometry);

  // Which voxels are frontier, as of this snapshot. Cheap, for every map update; clusters lag
  // behind until the next form().
  void observe(const MapSnapshotPtr& snapshot);
  // The clusters as of the last observe(), ascending by id, dormant ones included. `map` is of the
  // same snapshot.
  const std::vector<ClusterPtr>& form(const ClearanceMap& map, const RouteSearch& routes);

  [[nodiscard]] const std::vector<ClusterPtr>& clusters() const { return clusters_; }
  // Those that border an island too small to be worth a visit, which depends on how many are left
  // already; clusters() has none of them.
  [[nodiscard]] const std::vector<ClusterPtr>& worthless() const { return worthless_; }

  // Share of these voxels that is still frontier.
  [[nodiscard]] double remaining_share(const std::vector<VoxelIndex>& voxels) const;
  // Has so much of the cluster been seen that it is no longer worth a visit?
  [[nodiscard]] bool is_seen(const Cluster& cluster) const {
    return remaining_share(cluster.voxels) <= 1.0 - config_.seen_share;
  }

 private:
  using Owners = std::array<std::uint32_t, kVoxelsPerTile>;

  [[nodiscard]] std::uint32_t owner_of(const VoxelIndex& voxel) const;
  void set_owner(const VoxelIndex& voxel, std::uint32_t owner);
  template <class Visit>
  void for_each_owned_neighbour(const VoxelIndex& voxel, const Visit& visit) const;
  std::vector<VoxelIndex> dissolve();
  std::vector<std::uint32_t> form_clusters(const std::vector<VoxelIndex>& pool);
  std::vector<VoxelIndex> grow_component(const VoxelIndex& seed);
  void refresh(const ClearanceMap& map,
               const RouteSearch& routes,
               const std::vector<std::uint32_t>& formed);
  [[nodiscard]] bool map_changed_within(double distance_m, const Cluster& cluster) const;
  [[nodiscard]] bool has_more_neighbours_than(std::size_t most, const Cluster& cluster) const;
  void count_known(const MapSnapshot& snapshot, const std::vector<TileSlot>& changed);
  [[nodiscard]] bool is_large(const Cluster& cluster) const {
    return cluster.voxels.size() >= static_cast<std::size_t>(config_.min_cluster_voxels);
  }
  [[nodiscard]] double least_island_m3() const;

  FrontierConfig config_;
  ViewpointSampler sampler_;
  GridGeometry geometry_;
  FrontierField field_;
  FrontierField::Change pending_;                // since the last form()
  std::vector<std::unique_ptr<Owners>> owners_;  // cluster id per voxel
  std::map<std::uint32_t, ClusterPtr> members_;  // all clusters, too small ones as well
  std::uint32_t next_id_ = 2;                    // 0: no owner, 1: pooled
  std::vector<std::uint16_t> known_voxels_;      // of each tile
  std::size_t all_known_voxels_ = 0;
  std::vector<ClusterPtr> clusters_;
  std::vector<ClusterPtr> worthless_;
};

}  // namespace understory
