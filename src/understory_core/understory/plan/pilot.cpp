// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/plan/pilot.hpp"

#include <algorithm>

namespace understory {

Pilot::Pilot(const PlanConfig& config, Duration lead)
    : config_(config), lead_(lead), planner_(config) {}

void Pilot::take_position(const Vector3d& position_m, double yaw_rad, Time now) {
  Trajectory rest;
  rest.start = now;
  rest.position.control_points.assign(4, position_m);
  rest.yaw.control_points.assign(4, yaw_rad);
  rest.mode = FlightMode::kBrake;
  accept(std::move(rest), now);
}

TrajectoryPtr Pilot::accept(Trajectory trajectory, Time now) {
  trajectory.id = next_id_++;
  auto shared = std::make_shared<const Trajectory>(std::move(trajectory));
  follower_.set(shared, now);
  return shared;
}

std::optional<Time> Pilot::unsafe_from(Time now) const {
  const double radius_m = config_.vehicle_radius_m + config_.recheck_margin_m;
  const std::vector<TrajectoryPtr>& queue = follower_.queue();
  for (std::size_t i = 0; i < queue.size(); ++i) {
    const std::optional<Time> unsafe =
        first_unsafe_time(clearance_, *queue[i], std::max(now, queue[i]->start), radius_m);
    const bool is_flown_then = unsafe && (i + 1 == queue.size() || *unsafe < queue[i + 1]->start);
    if (is_flown_then) {
      return unsafe;
    }
  }
  return traffic_.must_give_way_at(*follower_.newest(), now);
}

Result<TrajectoryPtr, PlanError> Pilot::fly(const FlightGoal& goal, Time now) {
  PlanRequest request;
  request.start = next_start_point(now);
  request.start_time = next_start(now);
  request.route_m = goal.route_m;
  request.barriers = barriers(now);
  request.goal_yaw_rad = goal.yaw_rad;
  request.sights = goal.sights;
  request.limits = goal.limits;
  request.mode = goal.mode;
  Result<Trajectory, PlanError> planned = planner_.plan(clearance_, request);
  ++counters_.plans;
  if (!planned) {
    ++counters_.failed_plans;
    return planned.error();
  }
  const Obstruction obstruction = traffic_.obstruction_of(*planned);
  if (obstruction != Obstruction::kNone) {
    ++counters_.traffic_conflicts;
    return obstruction == Obstruction::kPassing ? PlanError::kTraffic : PlanError::kBarred;
  }
  return accept(std::move(planned).value(), now);
}

Result<TrajectoryPtr, PlanError> Pilot::brake(Time now) {
  Result<Trajectory, PlanError> planned = planner_.plan_brake(clearance_, follower_.at(now), now);
  ++counters_.brakes;
  if (!planned) {
    ++counters_.failed_brakes;
    return planned.error();
  }
  return accept(std::move(planned).value(), now);
}

}  // namespace understory
