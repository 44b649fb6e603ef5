// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Where to look at a cluster from (Zhou et al. 2021, FUEL, section IV-B): rings around its mean,
// yaw by best coverage, scored by the share of the cluster in view and unoccluded. Viewpoints sit
// on the route lattice, so that one search reaches them all. Pure function; world frame, metres.
#pragma once

#include <vector>

#include "understory/frontier/cluster.hpp"
#include "understory/frontier/frontier_config.hpp"
#include "understory/plan/clearance_map.hpp"
#include "understory/plan/route_search.hpp"
#include "understory/sense/camera_model.hpp"

namespace understory {

class ViewpointSampler {
 public:
  ViewpointSampler(const ViewpointConfig& config, const CameraConfig& camera);

  // Best coverage first, ties by lattice index; none when no viewpoint sees enough of the cluster.
  [[nodiscard]] std::vector<Viewpoint> sample(const ClearanceMap& map,
                                              const RouteSearch& routes,
                                              const Cluster& cluster) const;

 private:
  [[nodiscard]] std::vector<RouteLattice::Node> candidates(const ClearanceMap& map,
                                                           const RouteSearch& routes,
                                                           const Cluster& cluster) const;
  [[nodiscard]] bool is_in_reach(const Vector3d& from_m, const Vector3d& to_m) const;
  [[nodiscard]] std::vector<double> bearings_in_view(const ClearanceMap& map,
                                                     const Vector3d& from_m,
                                                     const std::vector<Vector3d>& places_m,
                                                     std::size_t needed) const;

  ViewpointConfig config_;
  double half_horizontal_fov_rad_;
  double vertical_slope_;
  double max_range_m_;
};

}  // namespace understory
