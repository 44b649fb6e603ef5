// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Which nodes of a route lattice a route of limited cost to any of several targets can lead
// through: for square cells of nodes, what it may have cost up to there at most. Never too little,
// as the straight way to the nearest target is taken for free. Costs as in RouteSearch, of which
// this is a part. Values; nothing fails.
#pragma once

#include <cstdint>
#include <vector>

#include "understory/plan/route_lattice.hpp"

namespace understory {

class RouteBudget {
 public:
  // What a step to a neighbour along an axis and along a diagonal costs.
  struct StepCosts {
    std::uint32_t straight;
    std::uint32_t diagonal;
  };

  // Without targets, no node has any.
  RouteBudget(const RouteLattice& lattice,
              const std::vector<RouteLattice::Node>& targets,
              std::uint32_t max_cost,
              const StepCosts& costs);

  // Can a route that has cost so much at this node still reach a target?
  [[nodiscard]] bool allows(const RouteLattice::Node& node, std::uint32_t cost) const {
    return cost < allowed_[cell_of(node)];
  }

 private:
  [[nodiscard]] std::size_t cell_of(const RouteLattice::Node& node) const {
    return static_cast<std::size_t>(node.y() >> kCellShift) * columns_ +
           static_cast<std::size_t>(node.x() >> kCellShift);
  }
  void spread_from(std::size_t cell, std::uint32_t max_cost, const StepCosts& costs);

  static constexpr int kCellShift = 3;  // 8 nodes along x and y

  std::size_t columns_;
  std::size_t rows_;
  std::vector<std::uint32_t> allowed_;  // by cell; costs below this
};

}  // namespace understory
