// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cmath>
#include <utility>

#include "understory/plan/clearance_rule.hpp"
#include "understory/plan/control_point_chain.hpp"
#include "understory/plan/trajectory_planner.hpp"

namespace understory {
namespace {

constexpr double kKnot_s = 0.1;
constexpr double kStandstill_mps = 1e-6;

// Along the path that was checked already, slower and slower.
CubicBSpline<Vector3d> brake_along(const Trajectory& flown,
                                   double from_s,
                                   const CubicBSpline<Vector3d>::Sample& start) {
  constexpr double kLookAhead_s = 0.2;
  constexpr double kLeastSpeed_mps = 0.02;
  ControlPointChain chain(start, flown.limits, kKnot_s);
  const double last_s = flown.position.duration_s();
  double along_s = std::min(last_s, from_s + kKnot_s);
  // Speed falls at every step but where all acceleration goes into turning.
  constexpr int kMaxSteps = 200;
  for (int i = 0; i < kMaxSteps && chain.velocity_mps().norm() > kStandstill_mps; ++i) {
    const Vector3d ahead = flown.position.sample(along_s + kLookAhead_s).value - chain.position_m();
    const Vector3d velocity = chain.velocity_mps();
    chain.step_braking(ahead.norm() > 1e-3 && ahead.dot(velocity) > 0.0 ? ahead.normalized()
                                                                        : velocity.normalized());
    const double flown_mps = std::max(kLeastSpeed_mps, flown.position.sample(along_s).first.norm());
    const double slower = std::min(1.0, chain.velocity_mps().norm() / flown_mps);
    along_s = std::min(last_s, along_s + slower * kKnot_s);
  }
  return chain.finished();
}

// Off to one side in the plane while braking; 0: straight on.
CubicBSpline<Vector3d> brake_turning(const Limits& limits,
                                     double turn_rad,
                                     const CubicBSpline<Vector3d>::Sample& start) {
  ControlPointChain chain(start, limits, kKnot_s);
  const Vector3d first = chain.velocity_mps();
  const Vector3d towards = Eigen::AngleAxisd(turn_rad, Vector3d::UnitZ()) * first.normalized();
  while (turn_rad != 0.0 && chain.velocity_mps().norm() > 0.2 * first.norm()) {
    const Vector3d velocity = chain.velocity_mps();
    chain.step_braking((velocity.normalized() + towards).normalized());
  }
  return chain.finished();
}

}  // namespace

Result<Trajectory, PlanError> TrajectoryPlanner::plan_brake(const ClearanceMap& map,
                                                            const Trajectory& flown,
                                                            Time from) const {
  const TrajectoryPoint now = flown.sample(from);
  const std::optional<ClearanceRule> rule =
      clearance_rule_from(map,
                          now.position_m,
                          config_.vehicle_radius_m,
                          config_.vehicle_radius_m + config_.recheck_margin_m);
  if (!rule) {
    return PlanError::kStartBlocked;
  }
  Trajectory brake;
  brake.start = from;
  brake.mode = FlightMode::kBrake;
  brake.limits = flown.limits;
  brake.depth_stamp = map.snapshot().stamp;
  brake.yaw = stopping_yaw_spline({now.yaw_rad, now.yaw_rate_radps, now.yaw_acceleration_radps2},
                                  flown.limits);
  PlanError error = PlanError::kUnsafe;
  const auto accepted = [&](CubicBSpline<Vector3d> position) {
    brake.position = std::move(position);
    if (!within_limits(brake)) {
      error = PlanError::kLimits;
      return false;
    }
    return !first_unsafe_time(map, brake, from, *rule);
  };
  const CubicBSpline<Vector3d>::Sample start{
      now.position_m, now.velocity_mps, now.acceleration_mps2};
  // Along a bend most of the acceleration goes into the turn: straight on stops sooner.
  std::array<CubicBSpline<Vector3d>, 2> ways = {
      brake_along(flown, to_seconds(from - flown.start), start),
      brake_turning(flown.limits, 0.0, start)};
  if (ways[1].duration_s() < ways[0].duration_s()) {
    std::swap(ways[0], ways[1]);
  }
  for (CubicBSpline<Vector3d>& way : ways) {
    if (accepted(std::move(way))) {
      return brake;
    }
  }
  for (const double turn_rad : {0.4, -0.4, 0.8, -0.8, 1.3, -1.3}) {
    if (accepted(brake_turning(flown.limits, turn_rad, start))) {
      return brake;
    }
  }
  return error;
}

}  // namespace understory
