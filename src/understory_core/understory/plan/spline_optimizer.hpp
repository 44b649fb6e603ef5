// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Moves the inner control points of a uniform cubic B-spline, and stretches or shrinks its time, to
// be short, smooth, clear of obstacles and within the limits (Zhou et al. 2019, section IV, with
// the duration as one more variable). The constraints are penalties: the caller must check what
// comes back. SI units, world frame; deterministic (bounded by evaluations, not by time); pure.
#pragma once

#include "understory/plan/clearance_map.hpp"
#include "understory/plan/trajectory.hpp"

namespace understory {

struct SplineTask {
  CubicBSpline<Vector3d>::Sample start;  // kept exactly
  Limits limits;                         // aimed at; leave some room to the real ones
  double least_clearance_m = 0.0;
  double preferred_clearance_m = 0.0;
};

struct OptimizerEffort {
  int evaluations;
  bool duration_is_free;
  double limit_weight;
  double clearance_weight;
};

// The spline must start in the task's state and end at rest (its last three control points equal);
// so does the result, with the same number of control points.
[[nodiscard]] CubicBSpline<Vector3d> optimized_spline(const ClearanceMap& map,
                                                      const SplineTask& task,
                                                      const CubicBSpline<Vector3d>& initial,
                                                      const OptimizerEffort& effort);

// The same curve with twice as many pieces (knot insertion at the middle of each).
[[nodiscard]] CubicBSpline<Vector3d> refined_spline(const CubicBSpline<Vector3d>& spline);

}  // namespace understory
