// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/plan/trajectory.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace understory {

template <class Point>
typename CubicBSpline<Point>::Sample CubicBSpline<Point>::sample(double time_s) const {
  assert(control_points.size() >= 4 && knot_s > 0.0);
  const double pieces = static_cast<double>(control_points.size() - 3);
  const double knots = std::clamp(time_s / knot_s, 0.0, pieces);
  const double piece = std::min(std::floor(knots), pieces - 1.0);
  const double u = knots - piece;
  const Point* q = &control_points[static_cast<std::size_t>(piece)];
  const double w = 1.0 - u;
  // Differences of control points: a spline at rest has exactly zero derivatives.
  const Point first0 = q[1] - q[0];
  const Point first1 = q[2] - q[1];
  const Point first2 = q[3] - q[2];
  Sample sample{};
  sample.value = (w * w * w * q[0] + (3.0 * u * u * u - 6.0 * u * u + 4.0) * q[1] +
                  (3.0 * w * w * w - 6.0 * w * w + 4.0) * q[2] + u * u * u * q[3]) /
                 6.0;
  sample.first = (0.5 * w * w * first0 + (0.5 + u * w) * first1 + 0.5 * u * u * first2) / knot_s;
  sample.second = (w * (first1 - first0) + u * (first2 - first1)) / (knot_s * knot_s);
  return sample;
}

template struct CubicBSpline<double>;
template struct CubicBSpline<Vector3d>;

template <class Point>
std::array<Point, 3> control_points_for(const typename CubicBSpline<Point>::Sample& start,
                                        double knot_s) {
  const Point step = start.first * knot_s;
  const Point bend = start.second * (knot_s * knot_s / 6.0);
  return {Point(start.value - step + 2.0 * bend),
          Point(start.value - bend),
          Point(start.value + step + 2.0 * bend)};
}

template std::array<double, 3> control_points_for<double>(const CubicBSpline<double>::Sample& start,
                                                          double knot_s);
template std::array<Vector3d, 3> control_points_for<Vector3d>(
    const CubicBSpline<Vector3d>::Sample& start, double knot_s);

const char* to_string(FlightMode mode) {
  switch (mode) {
    case FlightMode::kExplorer:
      return "explorer";
    case FlightMode::kCollector:
      return "collector";
    case FlightMode::kTransit:
      return "transit";
    case FlightMode::kBrake:
      return "brake";
  }
  return "invalid flight mode";
}

Duration Trajectory::duration() const {
  // Rounded up to the clock's tick: at end() both splines have ended.
  const double longest_s = std::max(position.duration_s(), yaw.duration_s());
  return Duration(static_cast<Duration::rep>(std::ceil(longest_s * 1e6)));
}

TrajectoryPoint Trajectory::sample(Time time) const {
  const double elapsed_s = std::max(0.0, to_seconds(time - start));
  const CubicBSpline<Vector3d>::Sample p = position.sample(elapsed_s);
  const CubicBSpline<double>::Sample heading = yaw.sample(elapsed_s);
  return {p.value, p.first, p.second, heading.value, heading.first, heading.second};
}

}  // namespace understory
