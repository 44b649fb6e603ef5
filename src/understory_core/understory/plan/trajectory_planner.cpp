// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/plan/trajectory_planner.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "understory/plan/clearance_rule.hpp"
#include "understory/plan/control_point_chain.hpp"
#include "understory/plan/kinodynamic_search.hpp"
#include "understory/plan/route_guide.hpp"
#include "understory/plan/spline_optimizer.hpp"

namespace understory {
namespace {

constexpr double kKnot_s = 0.1;
constexpr double kCoarseKnot_s = 0.2;
constexpr Duration kSamplePeriod{10000};
constexpr double kRelativeTolerance = 1e-6;
constexpr double kRest = 1e-6;  // metres, m/s, m/s2, rad/s
// The optimiser's limits are penalties: aim a little below the real ones.
constexpr double kAimedSpeed = 0.985;
constexpr double kAimedAcceleration = 0.99;
// Trilinear distances are off by up to a third of a voxel from the exact test's.
constexpr double kClearanceSlackVoxels = 0.4;
// Coarse knots find the shape, fine ones the last tenths of a second; then, as long as the verdict
// is against it, the penalty that was too weak grows.
constexpr OptimizerEffort kCoarseEffort{60, true, 20.0, 3000.0};
constexpr OptimizerEffort kFineEffort{50, true, 300.0, 5000.0};
constexpr int kRepairEvaluations = 25;
constexpr int kMaxRounds = 5;

using PositionSpline = CubicBSpline<Vector3d>;

PositionSpline::Sample position_state(const TrajectoryPoint& point) {
  return {point.position_m, point.velocity_mps, point.acceleration_mps2};
}
CubicBSpline<double>::Sample yaw_state(const TrajectoryPoint& point) {
  return {point.yaw_rad, point.yaw_rate_radps, point.yaw_acceleration_radps2};
}

// A vehicle that is faster than a new mode allows cannot be slower at once, and one that gains
// speed faster than it allows gains more until the first knot.
Limits limits_including(const Limits& limits, const TrajectoryPoint& start) {
  Limits raised = limits;
  raised.speed_mps = std::max(limits.speed_mps, start.velocity_mps.norm());
  if (start.acceleration_mps2.norm() > limits.acceleration_mps2) {
    const Vector3d gained_mps = 0.5 * kKnot_s * start.acceleration_mps2;
    raised.speed_mps = std::max(raised.speed_mps, (start.velocity_mps + gained_mps).norm());
  }
  raised.acceleration_mps2 = std::max(limits.acceleration_mps2, start.acceleration_mps2.norm());
  raised.yaw_rate_radps = std::max(limits.yaw_rate_radps, std::abs(start.yaw_rate_radps));
  raised.yaw_acceleration_radps2 =
      std::max(limits.yaw_acceleration_radps2, std::abs(start.yaw_acceleration_radps2));
  return raised;
}

bool is_finite(const PlanRequest& request) {
  const TrajectoryPoint& s = request.start;
  return s.position_m.allFinite() && s.velocity_mps.allFinite() &&
         s.acceleration_mps2.allFinite() && std::isfinite(s.yaw_rad) &&
         std::isfinite(s.yaw_rate_radps) && std::isfinite(s.yaw_acceleration_radps2) &&
         std::isfinite(request.goal_yaw_rad) &&
         std::all_of(request.route_m.begin(), request.route_m.end(), [](const Vector3d& p) {
           return p.allFinite();
         });
}

// What every attempt at one request shares.
struct Task {
  const ClearanceMap& map;
  PositionSpline::Sample start;
  std::vector<Vector3d> vertices_m;  // shortcut route, from the start
  ClearanceRule rule;
  Limits limits;  // asked for
};

PositionSpline spline_through(const SampledMotion& motion, const Task& task) {
  const double duration_s = motion.duration_s() + kCoarseKnot_s;
  const auto pieces =
      static_cast<std::size_t>(std::clamp(std::ceil(duration_s / kCoarseKnot_s), 5.0, 100.0));
  PositionSpline spline;
  spline.knot_s = duration_s / static_cast<double>(pieces);
  const std::array<Vector3d, 3> first = control_points_for<Vector3d>(task.start, spline.knot_s);
  spline.control_points.assign(first.begin(), first.end());
  for (std::size_t i = 3; i < pieces; ++i) {
    spline.control_points.push_back(motion.at(static_cast<double>(i - 1) * spline.knot_s));
  }
  spline.control_points.insert(spline.control_points.end(), 3, task.vertices_m.back());
  return spline;
}

// Against the limits the optimiser finds time cheap: from a start that is too fast, or flies the
// other way, it may end with ten times the time it takes to stop and to begin anew.
bool is_sluggish(double duration_s, const Task& task) {
  constexpr double kFactor = 1.3;
  constexpr double kSlack_s = 1.0;
  const double speed_mps = task.start.first.norm();
  const double stop_s = speed_mps / task.limits.acceleration_mps2;
  const RouteGuide from_rest(task.vertices_m, Vector3d::Zero(), task.limits);
  return duration_s > kFactor * (stop_s + from_rest.time_to_go_s(0.0)) + kSlack_s;
}

// Whether a spline may be flown, as the planner decides it.
using Verdict = std::function<std::optional<PlanError>(const PositionSpline&)>;

// The first spline the verdict admits while the penalties grow, or nothing.
bool optimised(const Task& task, double preferred_clearance_m, const Verdict& verdict) {
  const RouteGuide guide(task.vertices_m, task.start.first, task.limits);
  const SampledMotion motion =
      motion_along(task.map, guide, {task.start.value, task.start.first}, task.limits, task.rule);
  const double voxel_m = task.map.geometry().resolution_m();
  SplineTask spline_task{task.start,
                         task.limits,
                         task.rule.hard_m + kClearanceSlackVoxels * voxel_m,
                         preferred_clearance_m};
  spline_task.limits.speed_mps *= kAimedSpeed;
  spline_task.limits.acceleration_mps2 *= kAimedAcceleration;
  PositionSpline spline = spline_through(motion, task);
  spline = optimized_spline(task.map, spline_task, spline, kCoarseEffort);
  spline = refined_spline(spline);
  OptimizerEffort effort = kFineEffort;
  std::optional<PlanError> error;
  for (int round = 0; round < kMaxRounds; ++round) {
    spline = optimized_spline(task.map, spline_task, spline, effort);
    error = verdict(spline);
    if (!error) {
      return true;
    }
    if (*error == PlanError::kUnsafe) {
      spline_task.least_clearance_m += 0.1 * voxel_m;
      effort.clearance_weight *= 3.0;
    } else {
      spline_task.limits.speed_mps *= 0.998;
      spline_task.limits.acceleration_mps2 *= 0.998;
      effort.limit_weight *= 3.0;
    }
    effort.evaluations = kRepairEvaluations;
  }
  return false;
}

PositionSpline stop_at_corners(const Task& task) {
  ControlPointChain chain(task.start, task.limits, kKnot_s);
  chain.stop();
  for (const Vector3d& vertex : task.vertices_m) {
    if ((vertex - chain.position_m()).norm() > kRest) {
      chain.append_leg(vertex);
    }
  }
  return chain.finished();
}

}  // namespace

const char* to_string(PlanError error) {
  switch (error) {
    case PlanError::kStartBlocked:
      return "start blocked";
    case PlanError::kGoalBlocked:
      return "goal blocked";
    case PlanError::kNoRoute:
      return "no route";
    case PlanError::kLimits:
      return "limits cannot be held";
    case PlanError::kUnsafe:
      return "no safe trajectory";
    case PlanError::kTraffic:
      return "traffic";
    case PlanError::kBarred:
      return "someone stands in the way";
    case PlanError::kBudgetSpent:
      return "budget spent";
  }
  return "invalid plan error";
}

std::optional<Time> first_unsafe_time(const ClearanceMap& map,
                                      const Trajectory& trajectory,
                                      Time from,
                                      double radius_m) {
  return first_unsafe_time(map, trajectory, from, ClearanceRule{radius_m, radius_m});
}

bool within_limits(const Trajectory& trajectory) {
  const Limits& limits = trajectory.limits;
  const auto within = [](double value, double limit) {
    return value <= limit * (1.0 + kRelativeTolerance) + 1e-12;
  };
  for (Time time = trajectory.start;; time += kSamplePeriod) {
    const TrajectoryPoint point = trajectory.sample(time);
    if (!within(point.velocity_mps.norm(), limits.speed_mps) ||
        !within(point.acceleration_mps2.norm(), limits.acceleration_mps2) ||
        !within(std::abs(point.yaw_rate_radps), limits.yaw_rate_radps) ||
        !within(std::abs(point.yaw_acceleration_radps2), limits.yaw_acceleration_radps2)) {
      return false;
    }
    if (time >= trajectory.end()) {
      return point.velocity_mps.norm() < kRest && std::abs(point.yaw_rate_radps) < kRest;
    }
  }
}

// The same way, but looking to the sides where that takes no longer.
Trajectory TrajectoryPlanner::looking(const ClearanceMap& map,
                                      const PlanRequest& request,
                                      const Trajectory& planned) const {
  if (request.looks_ahead) {
    Trajectory trajectory = planned;
    trajectory.yaw = yaw_ahead(planned);
    return within_limits(trajectory) ? trajectory : planned;
  }
  if (!config_.look.is_on || request.sights.empty()) {
    return planned;
  }
  const double longest_s = std::max(planned.position.duration_s(), planned.yaw.duration_s());
  LookConfig config = config_.look;
  const std::vector<SeenSight> seen = seen_on_the_way(map, request.sights, planned, config);
  // The camera lags behind the course that it is given, the more the more it turns.
  for (const double lag_s : {0.0, 0.5, 1.0}) {
    config.spare_s = config_.look.spare_s + lag_s;
    const std::optional<CubicBSpline<double>> yaw = looking_yaw(seen, planned, config);
    if (!yaw) {
      return planned;
    }
    Trajectory trajectory = planned;
    trajectory.yaw = *yaw;
    if (yaw->duration_s() <= longest_s && within_limits(trajectory)) {
      return trajectory;
    }
  }
  return planned;
}

Result<Trajectory, PlanError> TrajectoryPlanner::plan(const ClearanceMap& map,
                                                      const PlanRequest& request) const {
  if (request.route_m.empty() || !is_finite(request)) {
    return PlanError::kNoRoute;
  }
  const Vector3d& start_m = request.start.position_m;
  const double hard_m = config_.vehicle_radius_m + config_.margin_m;
  const std::optional<ClearanceRule> rule =
      clearance_rule_from(map, start_m, config_.vehicle_radius_m, hard_m);
  if (!rule) {
    return PlanError::kStartBlocked;
  }
  std::vector<Vector3d> route_m{start_m};
  route_m.insert(route_m.end(), request.route_m.begin(), request.route_m.end());
  Task task{map,
            position_state(request.start),
            shortcut_route(map, route_m, *rule, config_.horizon_m, request.barriers),
            *rule,
            request.limits};
  if (!map.clearance_at_least(task.vertices_m.back(), hard_m)) {
    return PlanError::kGoalBlocked;
  }
  Trajectory trajectory;
  trajectory.start = request.start_time;
  trajectory.mode = request.mode;
  trajectory.limits = limits_including(request.limits, request.start);
  trajectory.depth_stamp = map.snapshot().stamp;
  trajectory.yaw = yaw_spline(yaw_state(request.start), request.goal_yaw_rad, request.limits);
  const auto verdict = [&](const PositionSpline& position) -> std::optional<PlanError> {
    trajectory.position = position;
    if (!within_limits(trajectory)) {
      return PlanError::kLimits;
    }
    if (first_unsafe_time(map, trajectory, trajectory.start, *rule)) {
      return PlanError::kUnsafe;
    }
    return std::nullopt;
  };
  std::optional<Trajectory> smooth;
  if (task.vertices_m.size() > 1 && optimised(task, config_.preferred_clearance_m, verdict)) {
    smooth = trajectory;
    if (!is_sluggish(smooth->position.duration_s(), task)) {
      return looking(map, request, *smooth);
    }
  }
  const std::optional<PlanError> error = verdict(stop_at_corners(task));
  if (smooth && (error || smooth->position.duration_s() <= trajectory.position.duration_s())) {
    return looking(map, request, *smooth);
  }
  if (error) {
    return *error;
  }
  return looking(map, request, trajectory);
}

}  // namespace understory
