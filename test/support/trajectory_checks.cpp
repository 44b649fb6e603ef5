// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "support/trajectory_checks.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "support/snapshot_builder.hpp"

namespace understory::test {
namespace {

constexpr Duration kSamplePeriod{10000};
constexpr double kJoinTolerance = 1e-6;  // metres, m/s, m/s2, rad, rad/s
constexpr double kRestTolerance = 1e-6;  // the same units
constexpr double kRelativeTolerance = 2e-6;

std::string at_time(const std::string& what, Time time, double value, double limit) {
  std::ostringstream text;
  text.precision(10);
  text << what << " at " << to_seconds(time) << " s: " << value << ", limit " << limit;
  return text.str();
}

std::string fault_at_start(const Trajectory& trajectory, const TrajectoryRequirements& required) {
  const TrajectoryPoint first = trajectory.sample(required.start_time);
  const TrajectoryPoint& wanted = required.start;
  const auto jump = [&](const char* what, double size) {
    return size <= kJoinTolerance
               ? std::string()
               : at_time(std::string("jump of ") + what, required.start_time, size, kJoinTolerance);
  };
  if (trajectory.start != required.start_time) {
    return "starts at another time";
  }
  return jump("position", (first.position_m - wanted.position_m).norm()) +
         jump("velocity", (first.velocity_mps - wanted.velocity_mps).norm()) +
         jump("acceleration", (first.acceleration_mps2 - wanted.acceleration_mps2).norm()) +
         jump("yaw", std::abs(first.yaw_rad - wanted.yaw_rad)) +
         jump("yaw rate", std::abs(first.yaw_rate_radps - wanted.yaw_rate_radps));
}

std::string fault_at_end(const Trajectory& trajectory) {
  for (const double later_s : {0.0, 0.005, 100.0}) {
    const Time time = trajectory.end() + duration_from_seconds(later_s);
    const TrajectoryPoint point = trajectory.sample(time);
    const double motion =
        std::max({point.velocity_mps.norm(),
                  point.acceleration_mps2.norm() * 1e-3,  // rounding, over knots squared
                  std::abs(point.yaw_rate_radps),
                  (point.position_m - trajectory.sample(trajectory.end()).position_m).norm()});
    if (!(motion <= kRestTolerance)) {
      return at_time("not at rest", time, motion, kRestTolerance);
    }
  }
  return {};
}

std::string fault_in_limits(const TrajectoryPoint& point, Time time, const Limits& limits) {
  const auto above = [&](const char* what, double value, double limit) {
    return value <= limit * (1.0 + kRelativeTolerance) + 1e-9 ? std::string()
                                                              : at_time(what, time, value, limit);
  };
  return above("speed", point.velocity_mps.norm(), limits.speed_mps) +
         above("acceleration", point.acceleration_mps2.norm(), limits.acceleration_mps2) +
         above("yaw rate", std::abs(point.yaw_rate_radps), limits.yaw_rate_radps) +
         above("yaw acceleration",
               std::abs(point.yaw_acceleration_radps2),
               limits.yaw_acceleration_radps2);
}

Limits raised_by_start(const TrajectoryRequirements& required) {
  const TrajectoryPoint& start = required.start;
  Limits limits = required.limits;
  limits.speed_mps = std::max(limits.speed_mps, start.velocity_mps.norm());
  if (start.acceleration_mps2.norm() > limits.acceleration_mps2) {
    // It fades to what is allowed within a knot of 0.1 s.
    const Vector3d fastest_mps = start.velocity_mps + 0.05 * start.acceleration_mps2;
    limits.speed_mps = std::max(limits.speed_mps, fastest_mps.norm());
  }
  limits.acceleration_mps2 = std::max(limits.acceleration_mps2, start.acceleration_mps2.norm());
  limits.yaw_rate_radps = std::max(limits.yaw_rate_radps, std::abs(start.yaw_rate_radps));
  limits.yaw_acceleration_radps2 =
      std::max(limits.yaw_acceleration_radps2, std::abs(start.yaw_acceleration_radps2));
  return limits;
}

}  // namespace

TrajectoryRequirements requirements_of(const PlanRequest& request, const PlanConfig& config) {
  return {
      request.start, request.start_time, request.limits, config.vehicle_radius_m + config.margin_m};
}

TrajectoryRequirements brake_requirements(const Trajectory& flown,
                                          Time from,
                                          const PlanConfig& config) {
  return {
      flown.sample(from), from, flown.limits, config.vehicle_radius_m + config.recheck_margin_m};
}

std::string fault_in(const Trajectory& trajectory,
                     const MapSnapshot& map,
                     const TrajectoryRequirements& required) {
  std::string joint = fault_at_start(trajectory, required) + fault_at_end(trajectory);
  if (!joint.empty()) {
    return joint;
  }
  const Limits limits = raised_by_start(required);
  const double reach_m = required.radius_m + 0.01;
  for (Time time = trajectory.start;; time += kSamplePeriod) {
    const TrajectoryPoint point = trajectory.sample(time);
    std::string fault = fault_in_limits(point, time, limits);
    if (!fault.empty()) {
      return fault;
    }
    const double clearance_m = brute_force_clearance_m(map, point.position_m, reach_m);
    if (!(clearance_m > required.radius_m - 1e-9)) {
      return at_time("clearance", time, clearance_m, required.radius_m);
    }
    if (time >= trajectory.end()) {
      return {};
    }
  }
}

Trajectory straight_trajectory(const Vector3d& from_m,
                               const Vector3d& velocity_mps,
                               double duration_s) {
  Trajectory straight;
  const int pieces = static_cast<int>(std::lround(duration_s / straight.position.knot_s));
  for (int i = -1; i < pieces + 2; ++i) {
    straight.position.control_points.emplace_back(from_m +
                                                  i * straight.position.knot_s * velocity_mps);
  }
  straight.yaw.control_points.assign(4, 0.0);
  return straight;
}

}  // namespace understory::test
