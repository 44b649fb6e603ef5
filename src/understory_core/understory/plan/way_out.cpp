// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/plan/way_out.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace understory {
namespace {

constexpr double kFar_m = 4.0;
constexpr double kAround_m = 1.0;    // the search may lead so much further out
constexpr double kLongest_m = 20.0;  // of a way; in the open a quarter of it is enough

// The passable nodes of a square ring around `center_m`.
std::vector<RouteLattice::Node> ring_around(const ClearanceMap& map,
                                            const RouteSearch& routes,
                                            const Vector3d& center_m) {
  const RouteLattice& lattice = routes.lattice();
  const RouteLattice::Node center = lattice.nearest(center_m);
  const int reach = static_cast<int>(std::ceil(kFar_m / lattice.step_m()));
  std::vector<RouteLattice::Node> ring;
  for (int z = 0; z < lattice.count().z(); ++z) {
    for (int dy = -reach; dy <= reach; ++dy) {
      const int step = std::abs(dy) == reach ? 1 : 2 * reach;
      for (int dx = -reach; dx <= reach; dx += step) {
        const RouteLattice::Node node(center.x() + dx, center.y() + dy, z);
        if (routes.passable(map, node)) {
          ring.push_back(node);
        }
      }
    }
  }
  return ring;
}

// The box, no further than the search may lead.
GridGeometry surroundings(const GridGeometry& geometry, const Vector3d& center_m) {
  const Vector3d reach_m = Vector3d::Constant(kFar_m + kAround_m);
  const Box3d near_m(center_m - reach_m, center_m + reach_m);
  return {geometry.resolution_m(), geometry.box_m().intersection(near_m)};
}

}  // namespace

std::vector<Vector3d> way_out(const ClearanceMap& map,
                              RouteSearch& routes,
                              double clearance_m,
                              const Vector3d& start_m) {
  const std::vector<RouteLattice::Node> ring = ring_around(map, routes, start_m);
  routes.run(map, start_m, ring, kLongest_m);
  if (std::any_of(ring.begin(), ring.end(), [&](const auto& n) { return routes.length_m(n); })) {
    return {};
  }
  RouteLattice::Spacing every_voxel;
  every_voxel.step_voxels = 1;
  every_voxel.layer_step_voxels = 2;  // those of the lattice's layers are among them
  RouteSearch fine(surroundings(map.geometry(), start_m), clearance_m, every_voxel);
  fine.avoid(routes.avoided());
  std::vector<RouteLattice::Node> same;
  same.reserve(ring.size());
  for (const RouteLattice::Node& node : ring) {
    same.push_back(fine.lattice().nearest(routes.lattice().point_of(node)));
  }
  fine.run(map, start_m, same, kLongest_m);
  const auto length_of = [&fine](const RouteLattice::Node& node) {
    return fine.length_m(node).value_or(std::numeric_limits<double>::infinity());
  };
  const auto nearest =
      std::min_element(same.begin(), same.end(), [&length_of](const auto& a, const auto& b) {
        return length_of(a) < length_of(b);
      });
  return nearest == same.end() ? std::vector<Vector3d>{} : fine.route_m(*nearest);
}

}  // namespace understory
