// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Finds trunks by place: a uniform grid whose cells list the trunks that touch them. World frame,
// metres. Immutable after construction, any thread; works for any extent and number of trunks.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "understory/sim/forest.hpp"

namespace understory {

class TrunkIndex {
 public:
  explicit TrunkIndex(const std::vector<Trunk>& trunks);

  // Horizontal distance from a point to the nearest trunk's surface, negative inside a trunk,
  // `max_m` when none is nearer than that.
  [[nodiscard]] double distance_m(const Vector2d& point_m, double max_m) const;

  // Whether a trunk touches the straight line between two points.
  [[nodiscard]] bool touches_line(const Vector2d& from_m, const Vector2d& to_m) const;

  // Indices into the constructor's list, ascending, of trunks that touch the rectangle.
  [[nodiscard]] std::vector<std::size_t> touching(const Box2d& rectangle_m) const;

 private:
  struct Disc {
    double x_m;
    double y_m;
    double radius_m;
    std::size_t trunk;
  };

  [[nodiscard]] int cell_along(double offset_m, int count) const;  // clamped into the grid
  [[nodiscard]] bool touches_line_in_row(const Vector2d& from_m,
                                         const Vector2d& to_m,
                                         int row) const;
  // Looks at every cell that the square of this half size around the point meets.
  [[nodiscard]] double nearest_within(const Vector2d& p, double reach_m, double best_m) const;

  Vector2d origin_m_ = Vector2d::Zero();
  double cell_m_ = 1.0;
  int count_x_ = 0;
  int count_y_ = 0;
  std::vector<std::uint32_t> first_;  // of each cell into discs_, and one past the end
  std::vector<Disc> discs_;           // copies beside each other: one query, few cache lines
};

}  // namespace understory
