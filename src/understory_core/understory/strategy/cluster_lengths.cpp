// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/strategy/cluster_lengths.hpp"

#include <algorithm>

namespace understory {
namespace {

// Of a way that the lattice does not know, against the straight line.
constexpr double kDetourFactor = 1.5;
constexpr double kDetourM = 5.0;

const Vector3d& view_of(const Cluster& cluster) {
  return cluster.viewpoints.front().position_m;
}

}  // namespace

void ClusterLengths::update(const ClearanceMap& map, const std::vector<const Cluster*>& clusters) {
  std::unordered_map<std::uint32_t, Row> kept;
  std::vector<const Cluster*> fresh;
  for (const Cluster* cluster : clusters) {
    const auto row = rows_.find(cluster->id);
    if (row == rows_.end()) {
      fresh.push_back(cluster);
    } else {
      kept.emplace(cluster->id, std::move(row->second));
    }
  }
  rows_ = std::move(kept);
  if (fresh.empty()) {
    return;
  }
  CoarseRoutes::Entries entries;
  entries.reserve(clusters.size());
  for (const Cluster* cluster : clusters) {
    entries.push_back(routes_.entry_of(map, view_of(*cluster)));
  }
  for (const Cluster* from : fresh) {
    const std::vector<std::optional<double>> found_m =
        routes_.lengths_m(map, view_of(*from), entries);
    Row& row = rows_[from->id];
    for (std::size_t i = 0; i < clusters.size(); ++i) {
      const Cluster& to = *clusters[i];
      const double straight_m = (view_of(to) - view_of(*from)).norm();
      const double length_m =
          found_m[i] ? std::max(*found_m[i], straight_m) : kDetourFactor * straight_m + kDetourM;
      row[to.id] = length_m;
      rows_[to.id][from->id] = length_m;
    }
  }
}

const ClusterLengths::Row& ClusterLengths::from(const Cluster& cluster) const {
  return rows_.at(cluster.id);
}

}  // namespace understory
