// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/plan/route_budget.hpp"

#include <algorithm>

namespace understory {
namespace {

std::size_t difference(std::size_t a, std::size_t b) {
  return a > b ? a - b : b - a;
}

}  // namespace

RouteBudget::RouteBudget(const RouteLattice& lattice,
                         const std::vector<RouteLattice::Node>& targets,
                         std::uint32_t max_cost,
                         const StepCosts& costs)
    : columns_(static_cast<std::size_t>((lattice.count().x() >> kCellShift) + 1)),
      rows_(static_cast<std::size_t>((lattice.count().y() >> kCellShift) + 1)),
      allowed_(columns_ * rows_, 0) {
  std::vector<std::size_t> cells;
  cells.reserve(targets.size());
  for (const RouteLattice::Node& target : targets) {
    cells.push_back(cell_of(target));
  }
  std::sort(cells.begin(), cells.end());
  cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
  for (const std::size_t cell : cells) {
    spread_from(cell, max_cost, costs);
  }
}

void RouteBudget::spread_from(std::size_t cell, std::uint32_t max_cost, const StepCosts& costs) {
  constexpr std::size_t kCellNodes = std::size_t{1} << static_cast<unsigned>(kCellShift);
  const std::size_t row = cell / columns_;
  const std::size_t column = cell % columns_;
  // As many cells further the straight way alone is too long.
  const std::size_t reach = max_cost / (kCellNodes * costs.straight) + 1;
  // From border to border.
  const auto nodes_between = [](std::size_t a, std::size_t b) {
    const std::size_t cells = difference(a, b);
    return static_cast<std::uint32_t>(cells == 0 ? 0 : (cells - 1) * kCellNodes + 1);
  };
  for (std::size_t y = row - std::min(row, reach); y <= std::min(row + reach, rows_ - 1); ++y) {
    const std::uint32_t dy = nodes_between(y, row);
    for (std::size_t x = column - std::min(column, reach);
         x <= std::min(column + reach, columns_ - 1);
         ++x) {
      const std::uint32_t dx = nodes_between(x, column);
      const std::uint32_t least = std::min(dx, dy) * costs.diagonal +
                                  (std::max(dx, dy) - std::min(dx, dy)) * costs.straight;
      if (least <= max_cost) {
        std::uint32_t& allowed = allowed_[y * columns_ + x];
        allowed = std::max(allowed, max_cost - least + 1);
      }
    }
  }
}

}  // namespace understory
