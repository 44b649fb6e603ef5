// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/plan/route_search.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "understory/plan/route_budget.hpp"

namespace understory {
namespace {

// In fifths of a lattice step: straight 5, diagonal 7 (exactly 7.07), one layer 10.
constexpr std::uint32_t kStraightCost = 5;
constexpr std::uint32_t kDiagonalCost = 7;
constexpr std::uint32_t kLayerCost = 10;
constexpr std::size_t kBuckets = 64;  // above any single cost that is offered
constexpr std::uint32_t kUnlimited = UINT32_MAX / 2;
constexpr int kEntryReachNodes = 4;
constexpr int kEntryReachLayers = 2;

// The least squared distance between voxel centres at which a ball around one centre is sure not
// to touch the other voxel.
int safe_squared_distance(double radius_voxels) {
  int least = 0;
  const int reach = ClearanceMap::kReachVoxels;
  for (int x = 0; x <= reach; ++x) {
    for (int y = 0; y <= reach; ++y) {
      for (int z = 0; z <= reach; ++z) {
        const Vector3d face = (Vector3d(x, y, z).array() - 0.5).max(0.0);
        if (face.norm() <= radius_voxels) {
          least = std::max(least, x * x + y * y + z * z + 1);
        }
      }
    }
  }
  return std::min(least, reach * reach);
}

}  // namespace

RouteSearch::RouteSearch(const GridGeometry& geometry,
                         double clearance_m,
                         const RouteLattice::Spacing& spacing)
    : lattice_(geometry, spacing),
      cost_unit_m_(lattice_.step_m() / kStraightCost),
      min_squared_distance_(safe_squared_distance(clearance_m / geometry.resolution_m())),
      // Half-way the ball may come nearer by what half a step bends the nearest surface away.
      min_edge_squared_distance_(
          safe_squared_distance(clearance_m / geometry.resolution_m() - 0.4)),
      nodes_(lattice_.node_count()),
      buckets_(kBuckets) {}

RouteSearch::NodeState& RouteSearch::state_in_this_run(std::size_t index) {
  NodeState& state = nodes_[index];
  if (state.run != run_) {
    state = NodeState{};
    state.run = run_;
    state.cost = UINT32_MAX;
  }
  return state;
}

void RouteSearch::offer(std::size_t index, std::uint32_t cost, std::int32_t parent) {
  NodeState& state = state_in_this_run(index);
  if (cost < state.cost) {
    state.cost = cost;
    state.parent = parent;
    buckets_[cost % kBuckets].push_back(static_cast<std::uint32_t>(index));
  }
}

void RouteSearch::enter_lattice(const ClearanceMap& map) {
  const RouteLattice::Node center = lattice_.nearest(start_m_);
  bool entered = false;
  // Nearest shell first: further nodes are only taken when none nearer is passable.
  for (int shell = 0; shell <= kEntryReachNodes && !entered; ++shell) {
    const int layers = std::min(shell, kEntryReachLayers);
    for (int dz = -layers; dz <= layers; ++dz) {
      for (int dy = -shell; dy <= shell; ++dy) {
        for (int dx = -shell; dx <= shell; ++dx) {
          const RouteLattice::Node node = center + Vector3i(dx, dy, dz);
          if (!passable(map, node) || state_in_this_run(lattice_.index_of(node)).cost == 0) {
            continue;
          }
          const double length_m = (lattice_.point_of(node) - start_m_).norm();
          const auto cost = static_cast<std::uint32_t>(std::lround(length_m / cost_unit_m_));
          offer(lattice_.index_of(node), std::min<std::uint32_t>(cost, kBuckets - 1), -1);
          entered = true;
        }
      }
    }
  }
}

// Marks the targets that a route of this cost can lead to at best, and returns them.
std::vector<RouteLattice::Node> RouteSearch::mark_targets(
    const std::vector<RouteLattice::Node>& targets, double max_cost) {
  // Diagonals are a hundredth shorter than they should be; the way into the lattice is rounded.
  constexpr double kShortest = 0.98;
  constexpr double kRounding = 1.0;
  std::vector<RouteLattice::Node> marked;
  for (const RouteLattice::Node& target : targets) {
    if (!lattice_.contains(target)) {
      continue;
    }
    const double straight_m = (lattice_.point_of(target) - start_m_).head<2>().norm();
    if (kShortest * straight_m / cost_unit_m_ > max_cost + kRounding) {
      continue;
    }
    NodeState& state = state_in_this_run(lattice_.index_of(target));
    if (!state.is_target) {
      state.is_target = true;
      marked.push_back(target);
    }
  }
  return marked;
}

// As if they were impassable.
void RouteSearch::close_barriers() {
  for (const Barrier& barrier : barriers_) {
    const Vector3d reach_m = Vector3d::Constant(barrier.radius_m);
    const RouteLattice::Node first =
        lattice_.nearest(barrier.position_m - reach_m).cwiseMax(RouteLattice::Node::Zero());
    const RouteLattice::Node last = lattice_.nearest(barrier.position_m + reach_m)
                                        .cwiseMin(lattice_.count() - RouteLattice::Node::Ones());
    for (int z = first.z(); z <= last.z(); ++z) {
      for (int y = first.y(); y <= last.y(); ++y) {
        for (int x = first.x(); x <= last.x(); ++x) {
          const RouteLattice::Node node(x, y, z);
          if ((lattice_.point_of(node) - barrier.position_m).norm() < barrier.radius_m) {
            state_in_this_run(lattice_.index_of(node)).cost = 0;
          }
        }
      }
    }
  }
}

void RouteSearch::relax(const ClearanceMap& map,
                        const RouteLattice::Node& node,
                        std::size_t from,
                        const Step& step) {
  const RouteLattice::Node next(node.x() + step.dx, node.y() + step.dy, node.z() + step.dz);
  if (!lattice_.contains(next)) {
    return;
  }
  const std::size_t index = lattice_.index_of(next);
  const std::uint32_t cost = nodes_[from].cost + step.cost;
  NodeState& state = nodes_[index];
  // Of settled nodes and impassable ones too.
  if (state.run == run_ && cost >= state.cost) {
    return;
  }
  const VoxelIndex voxel = lattice_.voxel_of(next);
  if (map.squared_distance_voxels(voxel) < min_squared_distance_) {
    state_in_this_run(index).cost = 0;
    return;
  }
  const VoxelIndex midway = (lattice_.voxel_of(node) + voxel) / 2;
  if (map.squared_distance_voxels(midway) >= min_edge_squared_distance_) {
    offer(index, cost, static_cast<std::int32_t>(from));
  }
}

void RouteSearch::run(const ClearanceMap& map,
                      const Vector3d& start_m,
                      const std::vector<RouteLattice::Node>& targets,
                      double max_length_m) {
  static constexpr std::array<Step, 10> kSteps{{{1, 0, 0, kStraightCost},
                                                {-1, 0, 0, kStraightCost},
                                                {0, 1, 0, kStraightCost},
                                                {0, -1, 0, kStraightCost},
                                                {1, 1, 0, kDiagonalCost},
                                                {1, -1, 0, kDiagonalCost},
                                                {-1, 1, 0, kDiagonalCost},
                                                {-1, -1, 0, kDiagonalCost},
                                                {0, 0, 1, kLayerCost},
                                                {0, 0, -1, kLayerCost}}};
  ++run_;
  start_m_ = start_m;
  for (std::vector<std::uint32_t>& bucket : buckets_) {
    bucket.clear();
  }
  const std::vector<RouteLattice::Node> marked = mark_targets(targets, max_length_m / cost_unit_m_);
  const auto max_cost = static_cast<std::uint32_t>(
      std::clamp(max_length_m / cost_unit_m_, 0.0, static_cast<double>(kUnlimited)));
  std::optional<RouteBudget> budget;
  if (max_cost < kUnlimited && !marked.empty()) {
    budget.emplace(
        lattice_, marked, max_cost, RouteBudget::StepCosts{kStraightCost, kDiagonalCost});
  }
  close_barriers();
  enter_lattice(map);
  std::size_t open_targets = marked.size();
  std::size_t empty_in_a_row = 0;
  for (std::uint32_t cost = 0; cost <= max_cost && empty_in_a_row < kBuckets && open_targets > 0;
       ++cost) {
    std::vector<std::uint32_t>& bucket = buckets_[cost % kBuckets];
    empty_in_a_row = bucket.empty() ? empty_in_a_row + 1 : 0;
    while (!bucket.empty()) {
      const std::size_t index = bucket.back();
      bucket.pop_back();
      NodeState& state = nodes_[index];
      if (state.is_settled || state.cost != cost) {
        continue;
      }
      const RouteLattice::Node node = lattice_.node_of_index(index);
      if (budget && !budget->allows(node, cost)) {
        continue;
      }
      state.is_settled = true;
      open_targets -= state.is_target ? 1U : 0U;
      for (const Step& step : kSteps) {
        relax(map, node, index, step);
      }
    }
  }
}

std::optional<double> RouteSearch::length_m(const RouteLattice::Node& node) const {
  if (!lattice_.contains(node)) {
    return std::nullopt;
  }
  const NodeState& state = nodes_[lattice_.index_of(node)];
  if (state.run != run_ || !state.is_settled) {
    return std::nullopt;
  }
  return state.cost * cost_unit_m_;
}

std::vector<Vector3d> RouteSearch::route_m(const RouteLattice::Node& node) const {
  std::vector<Vector3d> route;
  if (!length_m(node)) {
    return route;
  }
  auto index = static_cast<std::int32_t>(lattice_.index_of(node));
  while (index >= 0) {
    route.push_back(lattice_.point_of(lattice_.node_of_index(static_cast<std::size_t>(index))));
    index = nodes_[static_cast<std::size_t>(index)].parent;
  }
  route.push_back(start_m_);
  std::reverse(route.begin(), route.end());
  return route;
}

}  // namespace understory
