// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Lengths of the ways between clusters' best views, for orders of visits. One search per new
// cluster on a coarse lattice half-way up the box; what is known of a pair is kept as long as both
// clusters live, so a short cut that opens later counts only for new clusters (as in FUEL, Zhou et
// al. 2021, IV-C). World frame, metres. One thread; deterministic; nothing fails: where the lattice
// knows no way, a detour over the straight line is assumed.
#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "understory/frontier/cluster.hpp"
#include "understory/plan/coarse_routes.hpp"

namespace understory {

class ClusterLengths {
 public:
  using Row = std::unordered_map<std::uint32_t, double>;

  ClusterLengths(const GridGeometry& geometry, double clearance_m)
      : routes_(geometry, clearance_m) {}

  // `clusters`: all of now, with viewpoints. Forgets those that are gone.
  void update(const ClearanceMap& map, const std::vector<const Cluster*>& clusters);
  // Metres to all clusters of the last update, by id.
  [[nodiscard]] const Row& from(const Cluster& cluster) const;

 private:
  CoarseRoutes routes_;
  std::unordered_map<std::uint32_t, Row> rows_;  // by cluster id, both ways
};

}  // namespace understory
