// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/frontier/frontier_finder.hpp"

#include <algorithm>
#include <bitset>
#include <cmath>
#include <iterator>

#include "understory/frontier/clustering.hpp"
#include "understory/frontier/trail_label.hpp"

namespace understory {
namespace {

constexpr std::uint32_t kNoOwner = 0;
constexpr std::uint32_t kPooled = 1;

}  // namespace

FrontierFinder::FrontierFinder(const FrontierConfig& config,
                               const CameraConfig& camera,
                               const GridGeometry& geometry)
    : config_(config),
      sampler_(config.viewpoints, camera),
      geometry_(geometry),
      field_(geometry),
      owners_(geometry.slot_count()),
      known_voxels_(geometry.slot_count()) {}

std::uint32_t FrontierFinder::owner_of(const VoxelIndex& voxel) const {
  if (!geometry_.contains(voxel)) {
    return kNoOwner;
  }
  const Owners* owners = owners_[geometry_.slot_of(voxel)].get();
  return owners == nullptr ? kNoOwner : (*owners)[offset_in_tile(voxel)];
}

void FrontierFinder::set_owner(const VoxelIndex& voxel, std::uint32_t owner) {
  std::unique_ptr<Owners>& owners = owners_[geometry_.slot_of(voxel)];
  if (!owners) {
    owners = std::make_unique<Owners>();
  }
  (*owners)[offset_in_tile(voxel)] = owner;
}

// The 26 neighbours that have an owner, row by row.
template <class Visit>
void FrontierFinder::for_each_owned_neighbour(const VoxelIndex& voxel, const Visit& visit) const {
  const VoxelBox& box = geometry_.voxels();
  const int first = std::max(voxel.x() - 1, box.min.x());
  const int last = std::min(voxel.x() + 1, box.end.x() - 1);
  for (int z = std::max(voxel.z() - 1, box.min.z()); z <= std::min(voxel.z() + 1, box.end.z() - 1);
       ++z) {
    for (int y = std::max(voxel.y() - 1, box.min.y());
         y <= std::min(voxel.y() + 1, box.end.y() - 1);
         ++y) {
      const Owners* owners = nullptr;
      for (int x = first; x <= last; ++x) {
        const VoxelIndex neighbour(x, y, z);
        if (x == first || (x & (kTileVoxels - 1)) == 0) {
          owners = owners_[geometry_.slot_of(neighbour)].get();
        }
        const std::uint32_t owner =
            owners == nullptr ? kNoOwner : (*owners)[offset_in_tile(neighbour)];
        if (owner != kNoOwner && neighbour != voxel) {
          visit(neighbour, owner);
        }
      }
    }
  }
}

// Takes apart every cluster that lost a voxel or that a new voxel touches, and returns the frontier
// voxels that have no cluster now.
std::vector<VoxelIndex> FrontierFinder::dissolve() {
  std::vector<std::uint32_t> affected;
  const auto affect = [&affected](std::uint32_t owner) {
    if (owner != kNoOwner && (affected.empty() || affected.back() != owner)) {
      affected.push_back(owner);
    }
  };
  for (const VoxelIndex& voxel : pending_.removed) {
    affect(owner_of(voxel));
  }
  // What came and went again since the last time is of no account.
  pending_.added.erase(
      std::remove_if(pending_.added.begin(),
                     pending_.added.end(),
                     [this](const VoxelIndex& voxel) { return !field_.contains(voxel); }),
      pending_.added.end());
  for (const VoxelIndex& voxel : pending_.added) {
    for_each_owned_neighbour(voxel, [&](const VoxelIndex&, auto owner) { affect(owner); });
  }
  std::sort(affected.begin(), affected.end());
  affected.erase(std::unique(affected.begin(), affected.end()), affected.end());
  std::vector<VoxelIndex> pool;
  for (const std::uint32_t id : affected) {
    const auto member = members_.find(id);
    for (const VoxelIndex& voxel : member->second->voxels) {
      const bool is_frontier = field_.contains(voxel);
      set_owner(voxel, is_frontier ? kPooled : kNoOwner);
      if (is_frontier) {
        pool.push_back(voxel);
      }
    }
    members_.erase(member);
  }
  for (const VoxelIndex& voxel : pending_.added) {
    set_owner(voxel, kPooled);
    pool.push_back(voxel);
  }
  return pool;
}

// Takes the component out of the pool.
std::vector<VoxelIndex> FrontierFinder::grow_component(const VoxelIndex& seed) {
  std::vector<VoxelIndex> component{seed};
  set_owner(seed, kNoOwner);
  for (std::size_t next = 0; next < component.size(); ++next) {
    const VoxelIndex voxel = component[next];
    for_each_owned_neighbour(voxel, [&](const VoxelIndex& neighbour, auto owner) {
      if (owner == kPooled) {
        set_owner(neighbour, kNoOwner);
        component.push_back(neighbour);
      }
    });
  }
  return component;
}

std::vector<std::uint32_t> FrontierFinder::form_clusters(const std::vector<VoxelIndex>& pool) {
  std::vector<std::uint32_t> formed;
  const double max_length_voxels = config_.max_cluster_length_m / geometry_.resolution_m();
  for (const VoxelIndex& seed : pool) {
    if (owner_of(seed) != kPooled) {
      continue;
    }
    for (std::vector<VoxelIndex>& piece :
         split_along_principal_axis(grow_component(seed), max_length_voxels)) {
      Cluster cluster = make_cluster(std::move(piece), geometry_);
      cluster.id = next_id_++;
      for (const VoxelIndex& voxel : cluster.voxels) {
        set_owner(voxel, cluster.id);
      }
      const std::uint32_t id = cluster.id;
      formed.push_back(id);
      members_[id] = std::make_shared<const Cluster>(std::move(cluster));
    }
  }
  return formed;
}

bool FrontierFinder::has_more_neighbours_than(std::size_t most, const Cluster& cluster) const {
  std::size_t count = 0;
  for (const auto& [id, other] : members_) {
    if (id != cluster.id && is_large(*other) &&
        are_neighbours(cluster, *other, config_.trails.neighbour_distance_m, geometry_) &&
        ++count > most) {
      return true;
    }
  }
  return false;
}

bool FrontierFinder::map_changed_within(double distance_m, const Cluster& cluster) const {
  return std::any_of(pending_.tiles.begin(), pending_.tiles.end(), [&](TileSlot slot) {
    const VoxelBox voxels = geometry_.voxels_of_slot(slot);
    const Box3d tile_m(voxels.min.cast<double>() * geometry_.resolution_m(),
                       voxels.end.cast<double>() * geometry_.resolution_m());
    return tile_m.squaredExteriorDistance(cluster.bounds_m) <= distance_m * distance_m;
  });
}

// Labels and viewpoints of what is new; labels of its neighbours; another try for the dormant.
void FrontierFinder::refresh(const ClearanceMap& map,
                             const RouteSearch& routes,
                             const std::vector<std::uint32_t>& formed) {
  const double reach_m = config_.trails.ring_m + config_.trails.neighbour_distance_m;
  const double view_reach_m = config_.viewpoints.max_radius_m;
  std::vector<Box3d> formed_m;
  formed_m.reserve(formed.size());
  for (const std::uint32_t id : formed) {
    formed_m.push_back(members_.at(id)->bounds_m);
  }
  const auto is_formed = [&](std::uint32_t id) {
    return std::binary_search(formed.begin(), formed.end(), id);
  };
  for (auto& [id, member] : members_) {
    if (!is_large(*member)) {
      continue;
    }
    const bool is_new = is_formed(id);
    const bool relabel =
        is_new ||
        std::any_of(formed_m.begin(), formed_m.end(), [&, &cluster = *member](auto& other) {
          return other.squaredExteriorDistance(cluster.bounds_m) <= reach_m * reach_m;
        });
    const bool resample =
        is_new || (member->is_dormant() && map_changed_within(view_reach_m, *member));
    if (!relabel && !resample) {
      continue;
    }
    Cluster cluster = *member;
    if (relabel) {
      const std::size_t lone = config_.trails.one_neighbour_is_trail ? 1 : 0;
      const Surroundings around = surroundings_of(map.snapshot(), cluster, config_.trails);
      const bool trail = around.is_free_all_around || !has_more_neighbours_than(lone, cluster);
      cluster.label = trail ? ClusterLabel::kTrail : ClusterLabel::kFrontier;
      cluster.island_m3 = around.island_m3;
    }
    if (resample) {
      cluster.viewpoints = sampler_.sample(map, routes, cluster);
    }
    member = std::make_shared<const Cluster>(std::move(cluster));
  }
}

void FrontierFinder::observe(const MapSnapshotPtr& snapshot) {
  const FrontierField::Change change = field_.update(snapshot);
  count_known(*snapshot, change.tiles);
  pending_.added.insert(pending_.added.end(), change.added.begin(), change.added.end());
  pending_.removed.insert(pending_.removed.end(), change.removed.begin(), change.removed.end());
  std::vector<TileSlot> tiles;
  std::set_union(pending_.tiles.begin(),
                 pending_.tiles.end(),
                 change.tiles.begin(),
                 change.tiles.end(),
                 std::back_inserter(tiles));
  pending_.tiles = std::move(tiles);
}

const std::vector<ClusterPtr>& FrontierFinder::form(const ClearanceMap& map,
                                                    const RouteSearch& routes) {
  const std::vector<std::uint32_t> formed = form_clusters(dissolve());
  refresh(map, routes, formed);
  pending_ = {};
  clusters_.clear();
  worthless_.clear();
  const double least_m3 = least_island_m3();
  for (const auto& [id, member] : members_) {
    if (is_large(*member)) {
      const bool is_worthless = member->island_m3 && *member->island_m3 < least_m3;
      (is_worthless ? worthless_ : clusters_).push_back(member);
    }
  }
  return clusters_;
}

void FrontierFinder::count_known(const MapSnapshot& snapshot,
                                 const std::vector<TileSlot>& changed) {
  for (const TileSlot slot : changed) {
    std::size_t known = 0;
    if (const Tile* tile = snapshot.tiles[slot].get()) {
      for (const std::uint16_t row : tile->known_rows) {
        known += std::bitset<16>(row).count();
      }
    }
    all_known_voxels_ = all_known_voxels_ - known_voxels_[slot] + known;
    known_voxels_[slot] = static_cast<std::uint16_t>(known);
  }
}

// The size from which on an island is worth a visit: the fewer are left so far, the larger.
double FrontierFinder::least_island_m3() const {
  std::vector<double> islands_m3;
  for (const auto& [id, member] : members_) {
    if (is_large(*member) && member->island_m3) {
      islands_m3.push_back(*member->island_m3);
    }
  }
  std::sort(islands_m3.begin(), islands_m3.end());
  const double known_m3 =
      static_cast<double>(all_known_voxels_) * std::pow(geometry_.resolution_m(), 3);
  double room_m3 = config_.max_left_share * known_m3;
  double least_m3 = std::max(config_.min_island_m3, config_.max_island_m3);
  for (const double island_m3 : islands_m3) {
    room_m3 -= std::max(0.0, island_m3 - config_.trunk_in_island_m3);
    if (room_m3 < 0.0) {
      least_m3 = std::clamp(island_m3, config_.min_island_m3, least_m3);
      break;
    }
  }
  return std::min(least_m3, config_.max_island_share * geometry_.box_m().volume());
}

double FrontierFinder::remaining_share(const std::vector<VoxelIndex>& voxels) const {
  const auto remaining =
      std::count_if(voxels.begin(), voxels.end(), [this](const VoxelIndex& voxel) {
        return field_.contains(voxel);
      });
  return static_cast<double>(remaining) / static_cast<double>(voxels.size());
}

}  // namespace understory
