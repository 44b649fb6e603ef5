// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Splines that hold their limits by construction: a uniform cubic B-spline's derivatives lie in the
// convex hulls of its control points' differences, so a spline grown point by point with bounded
// differences is bounded everywhere. Starts exactly in a given state. SI units; one thread.
#pragma once

#include <vector>

#include "understory/plan/trajectory.hpp"

namespace understory {

class ControlPointChain {
 public:
  ControlPointChain(const CubicBSpline<Vector3d>::Sample& start,
                    const Limits& limits,
                    double knot_s);

  [[nodiscard]] const Vector3d& position_m() const { return points_m_.back(); }
  [[nodiscard]] Vector3d velocity_mps() const {
    return (points_m_.back() - points_m_[points_m_.size() - 2]) / knot_s_;
  }
  [[nodiscard]] double knot_s() const { return knot_s_; }

  // One more point, at the velocity nearest to the wanted one that the limits admit.
  void step_towards(const Vector3d& wanted_mps);
  // One more point, moving in this direction, as slow as the acceleration limit admits; all of it
  // goes into the turn when the turn needs it.
  void step_braking(const Vector3d& direction);
  void stop();
  // From rest: straight to the point and to rest again.
  void append_leg(const Vector3d& to_m);

  // Stops first if it still moves.
  [[nodiscard]] CubicBSpline<Vector3d> finished();

 private:
  std::vector<Vector3d> points_m_;
  Limits limits_;
  double knot_s_;
};

// Yaw from a state to rest, the fastest way round to `goal_yaw_rad` (or a full turn away from it).
[[nodiscard]] CubicBSpline<double> yaw_spline(const CubicBSpline<double>::Sample& start,
                                              double goal_yaw_rad,
                                              const Limits& limits);
// Yaw at equal steps of time.
struct YawCourse {
  std::vector<double> yaw_rad;  // continuous, not wrapped
  double step_s = 0.1;
};

// Follows a course as well as the limits admit, then goes to `goal_yaw_rad` as above.
[[nodiscard]] CubicBSpline<double> yaw_spline_along(const CubicBSpline<double>::Sample& start,
                                                    const YawCourse& course,
                                                    double goal_yaw_rad,
                                                    const Limits& limits);
// Yaw rate to zero as soon as possible.
[[nodiscard]] CubicBSpline<double> stopping_yaw_spline(const CubicBSpline<double>::Sample& start,
                                                       const Limits& limits);

}  // namespace understory
