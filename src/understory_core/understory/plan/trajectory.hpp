// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What the vehicle flies: a uniform cubic B-spline for position and one for yaw, from a start time
// on. World frame, SI units. Every trajectory ends at rest and stays there for ever, so silence is
// safe. Immutable value, any thread, sampling cannot fail.
// Source: uniform B-splines as in Zhou et al. 2019, section IV (de Boor's basis in matrix form).
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "understory/base/geometry.hpp"
#include "understory/base/time.hpp"

namespace understory {

struct Limits {
  double speed_mps = 1.5;          // Euclidean norm
  double acceleration_mps2 = 1.0;  // Euclidean norm
  double yaw_rate_radps = 0.9;
  double yaw_acceleration_radps2 = 2.0;
};

// Kinematic state along a trajectory.
struct TrajectoryPoint {
  Vector3d position_m = Vector3d::Zero();
  Vector3d velocity_mps = Vector3d::Zero();
  Vector3d acceleration_mps2 = Vector3d::Zero();
  double yaw_rad = 0.0;  // continuous along a trajectory, not wrapped
  double yaw_rate_radps = 0.0;
  double yaw_acceleration_radps2 = 0.0;
};

// Uniform cubic B-spline over control points of dimension `Point` (Vector3d or double): n control
// points make n - 3 pieces of knot_s each. Evaluation outside [0, duration] is clamped to the ends.
template <class Point>
struct CubicBSpline {
  std::vector<Point> control_points;  // at least 4
  double knot_s = 0.1;

  struct Sample {
    Point value;
    Point first;   // derivative per second
    Point second;  // derivative per second squared
  };

  [[nodiscard]] double duration_s() const {
    return static_cast<double>(control_points.size() - 3) * knot_s;
  }
  [[nodiscard]] Sample sample(double time_s) const;
};

extern template struct CubicBSpline<double>;
extern template struct CubicBSpline<Vector3d>;

// The three control points with which a spline starts in this state.
template <class Point>
[[nodiscard]] std::array<Point, 3> control_points_for(
    const typename CubicBSpline<Point>::Sample& start, double knot_s);

extern template std::array<double, 3> control_points_for<double>(
    const CubicBSpline<double>::Sample& start, double knot_s);
extern template std::array<Vector3d, 3> control_points_for<Vector3d>(
    const CubicBSpline<Vector3d>::Sample& start, double knot_s);

enum class FlightMode : std::uint8_t { kExplorer, kCollector, kTransit, kBrake };
[[nodiscard]] const char* to_string(FlightMode mode);

struct Trajectory {
  std::uint64_t id = 0;
  Time start{};
  CubicBSpline<Vector3d> position;
  CubicBSpline<double> yaw;
  FlightMode mode = FlightMode::kExplorer;
  Limits limits;
  Time depth_stamp{};  // exposure of the newest frame in the map it was planned on

  [[nodiscard]] Duration duration() const;  // the longer of the two splines
  [[nodiscard]] Time end() const { return start + duration(); }
  // Before the start: the start; after the end: at rest at the end.
  [[nodiscard]] TrajectoryPoint sample(Time time) const;
};

using TrajectoryPtr = std::shared_ptr<const Trajectory>;

}  // namespace understory
