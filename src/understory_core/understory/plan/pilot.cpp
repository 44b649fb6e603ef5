// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/plan/pilot.hpp"

#include <algorithm>
#include <cmath>

namespace understory {
namespace {

// From the instant that two who fly head on can see each other to when both brake.
constexpr double kReaction_s = 0.45;
// Two vehicles, and as much again between them.
constexpr double kRoomPerRadius = 4.0;
// Where it cannot see, until its camera has turned.
constexpr double kBlind_mps = 0.7;

// With which two who fly head on, and see each other over this distance, stop before they meet.
double speed_that_stops_within(double sight_m, double acceleration_mps2) {
  const double lost_mps = acceleration_mps2 * kReaction_s;
  return std::sqrt(lost_mps * lost_mps + acceleration_mps2 * std::max(0.0, sight_m)) - lost_mps;
}

// Does the camera look where it flies fast?
bool sees_its_way(const Trajectory& planned, const LookConfig& look) {
  constexpr Duration kStep = std::chrono::milliseconds(100);
  for (Time time = planned.start; time < planned.end(); time += kStep) {
    const TrajectoryPoint point = planned.sample(time);
    const Vector3d& velocity_mps = point.velocity_mps;
    const double heading_rad = std::atan2(velocity_mps.y(), velocity_mps.x());
    if (velocity_mps.head<2>().norm() > 1.1 * kBlind_mps &&
        std::abs(angle_difference(heading_rad, point.yaw_rad)) > look.half_field_rad) {
      return false;
    }
  }
  return true;
}

}  // namespace

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

std::optional<Time> Pilot::blocked_from(Time now) const {
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
  return std::nullopt;
}

std::optional<Time> Pilot::unsafe_from(Time now) const {
  const std::optional<Time> blocked = blocked_from(now);
  return blocked ? blocked : traffic_.must_give_way_at(*follower_.newest(), now);
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
  if (sight_m_) {
    request.looks_ahead = true;
    const double room_m = *sight_m_ - kRoomPerRadius * config_.vehicle_radius_m;
    request.limits.speed_mps = std::min(
        goal.limits.speed_mps, speed_that_stops_within(room_m, goal.limits.acceleration_mps2));
  }
  request.mode = goal.mode;
  Result<Trajectory, PlanError> planned = planner_.plan(clearance_, request);
  if (sight_m_ && planned && !sees_its_way(*planned, config_.look)) {
    request.limits.speed_mps = std::min(request.limits.speed_mps, kBlind_mps);
    planned = planner_.plan(clearance_, request);
  }
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
  if (follower_.newest()->mode == FlightMode::kBrake && !blocked_from(now)) {
    return TrajectoryPtr{};
  }
  Result<Trajectory, PlanError> planned = planner_.plan_brake(clearance_, follower_.at(now), now);
  ++counters_.brakes;
  if (!planned) {
    ++counters_.failed_brakes;
    return planned.error();
  }
  return accept(std::move(planned).value(), now);
}

}  // namespace understory
