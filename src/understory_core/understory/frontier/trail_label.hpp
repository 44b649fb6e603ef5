// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Is a cluster an island of unknown space with free space all around (paper, III-A)? "Surrounded":
// of the voxels in a ring around the cluster's hull in xy, only a small share is unknown without
// belonging to the small unknown component that the cluster itself borders. Independent of the
// map's axes. Pure function of snapshot and cluster; world frame, metres.
#pragma once

#include <optional>

#include "understory/frontier/cluster.hpp"
#include "understory/frontier/frontier_config.hpp"
#include "understory/map/map_snapshot.hpp"

namespace understory {

struct Surroundings {
  bool is_free_all_around = false;
  std::optional<double> island_m3;  // of the unknown component bordered, if that is a small one
};

[[nodiscard]] Surroundings surroundings_of(const MapSnapshot& snapshot,
                                           const Cluster& cluster,
                                           const TrailConfig& config);

}  // namespace understory
