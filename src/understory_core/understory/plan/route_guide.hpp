// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// A route made fit to be followed: lines of sight instead of lattice steps, cut to the horizon,
// with a speed for every place that slows for corners and for the end. Search and first guesses
// steer by it; nothing flies it as it is. Metres from its beginning, world frame; pure.
#pragma once

#include <vector>

#include "understory/plan/barrier.hpp"
#include "understory/plan/clearance_rule.hpp"
#include "understory/plan/trajectory.hpp"

namespace understory {

// The route's vertices that remain when every vertex is joined to the farthest later one in sight,
// at most horizon_m long; none leads through a barrier. Legs that are not clear themselves are kept
// as they are.
[[nodiscard]] std::vector<Vector3d> shortcut_route(const ClearanceMap& map,
                                                   const std::vector<Vector3d>& route_m,
                                                   const ClearanceRule& rule,
                                                   double horizon_m,
                                                   const Barriers& barriers = {});

class RouteGuide {
 public:
  // At least two vertices, no two neighbours equal. The start's velocity decides how fast the
  // guide's first metres are.
  RouteGuide(std::vector<Vector3d> vertices_m,
             const Vector3d& start_velocity_mps,
             const Limits& limits);

  [[nodiscard]] const std::vector<Vector3d>& vertices_m() const { return vertices_m_; }
  [[nodiscard]] double length_m() const { return vertex_at_m_.back(); }
  [[nodiscard]] Vector3d point_at(double along_m) const;
  [[nodiscard]] Vector3d direction_at(double along_m) const;
  [[nodiscard]] double speed_at(double along_m) const;
  [[nodiscard]] double time_to_go_s(double along_m) const;
  // Where the point is nearest to the guide between two places on it.
  [[nodiscard]] double nearest_along_m(const Vector3d& point_m, double from_m, double to_m) const;

 private:
  [[nodiscard]] std::size_t leg_at(double along_m) const;
  [[nodiscard]] double interpolated(const std::vector<double>& table, double along_m) const;
  void limit_corner_speeds(const Limits& limits);

  std::vector<Vector3d> vertices_m_;
  std::vector<double> vertex_at_m_;
  // At every step_m_ from 0 to the length.
  double step_m_;
  std::vector<double> speed_mps_;
  std::vector<double> time_to_go_s_;
};

}  // namespace understory
