// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/plan/control_point_chain.hpp"

#include <algorithm>
#include <cmath>

#include "understory/plan/trapezoid_profile.hpp"

namespace understory {
namespace {

constexpr double kYawKnot_s = 0.05;
// Keeps rounding, and a start that is at the limit already, from passing the real limits.
constexpr double kLimitShare = 0.995;
// A turn that is planned anew while it still gains speed runs over by up to 1.3 %.
constexpr double kYawRateShare = 0.98;
constexpr double kStandstill_mps = 1e-9;
// Of the yaw acceleration that braking at the end of a course counts on.
constexpr double kCourseBrakeShare = 0.8;

CubicBSpline<double> yaw_along(const TrapezoidProfile& profile,
                               const std::array<double, 3>& first,
                               double target_rad) {
  CubicBSpline<double> yaw{{first.begin(), first.end()}, kYawKnot_s};
  const int steps = static_cast<int>(std::ceil(profile.duration_s() / kYawKnot_s));
  for (int i = 1; i < steps; ++i) {
    yaw.control_points.push_back(first[2] + profile.position_at(i * kYawKnot_s));
  }
  yaw.control_points.insert(yaw.control_points.end(), 3, target_rad);
  return yaw;
}

RateLimits yaw_limits(const Limits& limits) {
  return {kYawRateShare * limits.yaw_rate_radps, kLimitShare * limits.yaw_acceleration_radps2};
}

// The fastest way round from what the first three control points are to rest at the goal.
CubicBSpline<double> turn_to(const std::array<double, 3>& first,
                             double goal_yaw_rad,
                             const Limits& limits) {
  const double rate_radps = (first[2] - first[1]) / kYawKnot_s;
  const double nearest_rad = first[2] + angle_difference(goal_yaw_rad, first[2]);
  const auto profile_to = [&](double target_rad) {
    return TrapezoidProfile(target_rad - first[2], rate_radps, yaw_limits(limits));
  };
  double target_rad = nearest_rad;
  for (const double turn_rad : {-2.0 * kPi, 2.0 * kPi}) {
    if (profile_to(nearest_rad + turn_rad).duration_s() < profile_to(target_rad).duration_s()) {
      target_rad = nearest_rad + turn_rad;
    }
  }
  return yaw_along(profile_to(target_rad), first, target_rad);
}

double at(const YawCourse& course, double time_s) {
  const double steps = std::max(0.0, time_s / course.step_s);
  const auto before = std::min(static_cast<std::size_t>(steps), course.yaw_rad.size() - 1);
  const std::size_t after = std::min(before + 1, course.yaw_rad.size() - 1);
  const double share = std::min(1.0, steps - static_cast<double>(before));
  return course.yaw_rad[before] + share * (course.yaw_rad[after] - course.yaw_rad[before]);
}

}  // namespace

ControlPointChain::ControlPointChain(const CubicBSpline<Vector3d>::Sample& start,
                                     const Limits& limits,
                                     double knot_s)
    : limits_(limits), knot_s_(knot_s) {
  const std::array<Vector3d, 3> first = control_points_for<Vector3d>(start, knot_s);
  points_m_.assign(first.begin(), first.end());
  limits_.speed_mps *= kLimitShare;
  limits_.acceleration_mps2 *= kLimitShare;
}

void ControlPointChain::step_towards(const Vector3d& wanted_mps) {
  const Vector3d velocity = velocity_mps();
  const double wanted_norm = wanted_mps.norm();
  const double admitted = std::min(1.0, limits_.speed_mps / std::max(wanted_norm, kStandstill_mps));
  Vector3d change = admitted * wanted_mps - velocity;
  const double most_mps = limits_.acceleration_mps2 * knot_s_;
  const double norm = change.norm();
  if (norm > most_mps) {
    change *= most_mps / norm;
  }
  points_m_.emplace_back(position_m() + (velocity + change) * knot_s_);
}

void ControlPointChain::step_braking(const Vector3d& direction) {
  const Vector3d velocity = velocity_mps();
  const double along_mps = direction.dot(velocity);
  const double most_mps = limits_.acceleration_mps2 * knot_s_;
  const double across_square = velocity.squaredNorm() - along_mps * along_mps;
  const double spare_mps = std::sqrt(std::max(0.0, most_mps * most_mps - across_square));
  step_towards(std::max(0.0, along_mps - spare_mps) * direction);
}

void ControlPointChain::stop() {
  while (velocity_mps().norm() > kStandstill_mps) {
    step_towards(Vector3d::Zero());
  }
  points_m_.push_back(position_m());
}

void ControlPointChain::append_leg(const Vector3d& to_m) {
  const Vector3d from_m = position_m();
  const double length_m = (to_m - from_m).norm();
  const TrapezoidProfile profile(length_m, 0.0, {limits_.speed_mps, limits_.acceleration_mps2});
  const int steps = static_cast<int>(std::ceil(profile.duration_s() / knot_s_));
  for (int i = 1; i < steps; ++i) {
    points_m_.emplace_back(from_m + profile.position_at(i * knot_s_) / length_m * (to_m - from_m));
  }
  points_m_.push_back(to_m);
}

CubicBSpline<Vector3d> ControlPointChain::finished() {
  stop();
  points_m_.insert(points_m_.end(), 2, Vector3d(position_m()));
  return {points_m_, knot_s_};
}

CubicBSpline<double> yaw_spline(const CubicBSpline<double>::Sample& start,
                                double goal_yaw_rad,
                                const Limits& limits) {
  return turn_to(control_points_for<double>(start, kYawKnot_s), goal_yaw_rad, limits);
}

CubicBSpline<double> yaw_spline_along(const CubicBSpline<double>::Sample& start,
                                      const YawCourse& course,
                                      double goal_yaw_rad,
                                      const Limits& limits) {
  const std::array<double, 3> first = control_points_for<double>(start, kYawKnot_s);
  std::vector<double> points{first.begin(), first.end()};
  const RateLimits rates = yaw_limits(limits);
  const auto steps =
      static_cast<int>(static_cast<double>(course.yaw_rad.size() - 1) * course.step_s / kYawKnot_s);
  for (int i = 1; i < steps; ++i) {
    const double rate_radps = (points.back() - points[points.size() - 2]) / kYawKnot_s;
    const double left_rad = at(course, i * kYawKnot_s) - points.back();
    // No faster than it can be stopped there.
    const double most_radps = std::min(
        rates.rate, std::sqrt(2.0 * kCourseBrakeShare * rates.acceleration * std::abs(left_rad)));
    const double wanted_radps = std::clamp(left_rad / kYawKnot_s, -most_radps, most_radps);
    const double most_change = rates.acceleration * kYawKnot_s;
    const double change = std::clamp(wanted_radps - rate_radps, -most_change, most_change);
    points.push_back(points.back() + (rate_radps + change) * kYawKnot_s);
  }
  const std::size_t last = points.size() - 1;
  const CubicBSpline<double> rest =
      turn_to({points[last - 2], points[last - 1], points[last]}, goal_yaw_rad, limits);
  points.insert(points.end(), rest.control_points.begin() + 3, rest.control_points.end());
  return {points, kYawKnot_s};
}

CubicBSpline<double> stopping_yaw_spline(const CubicBSpline<double>::Sample& start,
                                         const Limits& limits) {
  const std::array<double, 3> first = control_points_for<double>(start, kYawKnot_s);
  const double rate_radps = (first[2] - first[1]) / kYawKnot_s;
  const double turn_rad = stopping_distance(rate_radps, yaw_limits(limits).acceleration);
  return yaw_along(
      TrapezoidProfile(turn_rad, rate_radps, yaw_limits(limits)), first, first[2] + turn_rad);
}

}  // namespace understory
