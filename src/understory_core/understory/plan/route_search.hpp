// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// One Dijkstra from the vehicle to all targets: path lengths in the map for every target at the
// price of one search (the paper runs A* per target; same numbers, less work). World frame,
// metres. Edges: the 8 neighbours in a layer and the layers above and below; a node is passable
// when the ball of `clearance_m` around it is known free. Lengths are those of the lattice, up to
// 8 % above the straight line. Nodes that no route of the length asked for can lead through are
// left out, which changes neither lengths nor routes. Deterministic, one thread; scratch memory is
// kept between calls.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "understory/plan/barrier.hpp"
#include "understory/plan/clearance_map.hpp"
#include "understory/plan/route_lattice.hpp"

namespace understory {

class RouteSearch {
 public:
  RouteSearch(const GridGeometry& geometry, double clearance_m)
      : RouteSearch(geometry, clearance_m, RouteLattice::Spacing{}) {}
  RouteSearch(const GridGeometry& geometry,
              double clearance_m,
              const RouteLattice::Spacing& spacing);

  // What the runs from now on lead around.
  void avoid(Barriers barriers) { barriers_ = std::move(barriers); }
  [[nodiscard]] const Barriers& avoided() const { return barriers_; }

  // Searches from `start_m` as far as max_length_m, or until every target is settled. `map` must
  // outlive the use of the results. A start that is too close to something enters the lattice at
  // the nearest passable node within reach.
  void run(const ClearanceMap& map,
           const Vector3d& start_m,
           const std::vector<RouteLattice::Node>& targets,
           double max_length_m);

  // Of a target of the last run; nothing when it was not reached. Of other nodes, only what was
  // needed for that is known.
  [[nodiscard]] std::optional<double> length_m(const RouteLattice::Node& node) const;
  // From the start's position to the node, lattice point by lattice point.
  [[nodiscard]] std::vector<Vector3d> route_m(const RouteLattice::Node& node) const;

  [[nodiscard]] bool passable(const ClearanceMap& map, const RouteLattice::Node& node) const {
    return lattice_.contains(node) &&
           map.squared_distance_voxels(lattice_.voxel_of(node)) >= min_squared_distance_;
  }
  [[nodiscard]] const RouteLattice& lattice() const { return lattice_; }

 private:
  struct NodeState {
    std::uint32_t run = 0;   // the run in which the rest was written
    std::uint32_t cost = 0;  // of an impassable node: none is less
    std::int32_t parent = -1;
    bool is_settled = false;
    bool is_target = false;
  };
  struct Step {
    int dx;
    int dy;
    int dz;
    std::uint32_t cost;
  };

  std::vector<RouteLattice::Node> mark_targets(const std::vector<RouteLattice::Node>& targets,
                                               double max_cost);
  void close_barriers();
  void enter_lattice(const ClearanceMap& map);
  void relax(const ClearanceMap& map,
             const RouteLattice::Node& node,
             std::size_t from,
             const Step& step);
  void offer(std::size_t index, std::uint32_t cost, std::int32_t parent);
  NodeState& state_in_this_run(std::size_t index);

  RouteLattice lattice_;
  double cost_unit_m_;
  int min_squared_distance_;       // of a node
  int min_edge_squared_distance_;  // half-way along an edge
  std::uint32_t run_ = 0;
  Vector3d start_m_ = Vector3d::Zero();
  Barriers barriers_;
  std::vector<NodeState> nodes_;
  std::vector<std::vector<std::uint32_t>> buckets_;  // circular, by cost (Dial 1969)
};

}  // namespace understory
