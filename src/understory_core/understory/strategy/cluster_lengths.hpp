// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Lengths of the ways between clusters' best views, for orders of visits. One search per new
// cluster on a coarse lattice half-way up the box; what is known of a pair is kept as long as both
// clusters live, so a short cut that opens later counts only for new clusters (as in FUEL, Zhou et
// al. 2021, IV-C). World frame, metres. One thread; deterministic; nothing fails: where the lattice
// knows no way up to 15 m, that or a detour over the straight line is assumed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "understory/frontier/cluster.hpp"
#include "understory/plan/coarse_routes.hpp"

namespace understory {

class ClusterLengths {
 public:
  ClusterLengths(const GridGeometry& geometry, double clearance_m)
      : routes_(geometry, clearance_m) {}

  // `clusters`: all of now, with viewpoints. Forgets those that are gone.
  void update(const ClearanceMap& map, const std::vector<const Cluster*>& clusters);
  // Metres between two of the last update, by their places in it.
  [[nodiscard]] double between(std::size_t a, std::size_t b) const {
    return rows_m_[slots_[a]][slots_[b]];
  }

 private:
  using Slot = std::size_t;

  std::vector<std::size_t> take_slots(const std::vector<const Cluster*>& clusters);

  CoarseRoutes routes_;
  std::unordered_map<std::uint32_t, Slot> slot_of_;  // by cluster id
  std::vector<Slot> unused_;
  std::vector<std::vector<double>> rows_m_;  // slot by slot, both ways
  std::vector<Slot> slots_;                  // of the last update's clusters
};

}  // namespace understory
