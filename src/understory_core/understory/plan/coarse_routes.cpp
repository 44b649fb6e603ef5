// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/plan/coarse_routes.hpp"

#include <algorithm>
#include <limits>

namespace understory {
namespace {

constexpr double kSpacingM = 0.4;
constexpr int kEntryReachNodes = 2;

int spacing_voxels(const GridGeometry& geometry) {
  return std::max(1, static_cast<int>(std::lround(kSpacingM / geometry.resolution_m())));
}

}  // namespace

CoarseRoutes::CoarseRoutes(const GridGeometry& geometry, double clearance_m)
    : routes_(geometry, clearance_m, RouteLattice::flat(geometry, spacing_voxels(geometry))) {}

RouteLattice::Node CoarseRoutes::entry_of(const ClearanceMap& map, const Vector3d& at_m) const {
  const RouteLattice& lattice = routes_.lattice();
  RouteLattice::Node center = lattice.nearest(at_m);
  center.z() = 0;
  if (routes_.passable(map, center)) {
    return center;
  }
  RouteLattice::Node best = nowhere();
  double nearest = std::numeric_limits<double>::infinity();
  for (int shell = 1; shell <= kEntryReachNodes && best.x() < 0; ++shell) {
    for (int dy = -shell; dy <= shell; ++dy) {
      for (int dx = -shell; dx <= shell; ++dx) {
        const RouteLattice::Node node = center + Vector3i(dx, dy, 0);
        const double distance = (lattice.point_of(node) - at_m).head<2>().squaredNorm();
        if (distance < nearest && routes_.passable(map, node)) {
          nearest = distance;
          best = node;
        }
      }
    }
  }
  return best;
}

std::vector<std::optional<double>> CoarseRoutes::lengths_m(const ClearanceMap& map,
                                                           const Vector3d& from_m,
                                                           const Entries& entries,
                                                           double max_length_m) {
  routes_.run(map, from_m, entries, max_length_m);
  std::vector<std::optional<double>> lengths;
  lengths.reserve(entries.size());
  for (const RouteLattice::Node& entry : entries) {
    lengths.push_back(routes_.length_m(entry));
  }
  return lengths;
}

}  // namespace understory
