// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// A piece of the border between free and unknown space, and where to look at it from. World frame,
// metres. Immutable once made; shared by pointer.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "understory/map/grid_geometry.hpp"
#include "understory/plan/route_lattice.hpp"

namespace understory {

enum class ClusterLabel : std::uint8_t { kFrontier, kTrail };

struct Viewpoint {
  RouteLattice::Node node;
  Vector3d position_m;
  double yaw_rad = 0.0;
  double coverage = 0.0;  // share of the cluster in view and unoccluded, 0 .. 1
};

struct Cluster {
  std::uint32_t id = 0;  // grows with every cluster made; ties break by it
  std::vector<VoxelIndex> voxels;
  Vector3d mean_m = Vector3d::Zero();
  Box3d bounds_m;
  ClusterLabel label = ClusterLabel::kFrontier;
  std::optional<double> island_m3;    // size of the island of unknown space it borders, if small
  std::vector<Viewpoint> viewpoints;  // best coverage first; none: dormant

  [[nodiscard]] bool is_dormant() const { return viewpoints.empty(); }
  [[nodiscard]] bool is_trail() const { return label == ClusterLabel::kTrail; }
};

// Clusters are made anew when they change; the border they stand for stays where it is.
[[nodiscard]] inline bool is_same_place(const Cluster& a, const Cluster& b) {
  constexpr double kSamePlaceM = 0.5;
  return (a.mean_m - b.mean_m).squaredNorm() < kSamePlaceM * kSamePlaceM;
}

using ClusterPtr = std::shared_ptr<const Cluster>;

}  // namespace understory
