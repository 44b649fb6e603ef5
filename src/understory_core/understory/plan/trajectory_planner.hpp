// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// From a route to a flyable trajectory: kinodynamic search in known free space, a uniform cubic
// B-spline fitted to it, optimised for smoothness, clearance and limits, then time adjustment
// (Zhou et al. 2019), yaw as a spline of its own. Starts exactly in the given state (position,
// velocity, acceleration, yaw, yaw rate), ends at rest. World frame, SI units. Deterministic; one
// thread. What comes back holds its limits at every 100 Hz sample and is clear at each of them.
// A start beyond the limits asked for (a Collector becomes an Explorer) raises those that it comes
// with: the vehicle can neither be slower nor gain less speed at once.
#pragma once

#include <optional>
#include <vector>

#include "understory/base/config.hpp"
#include "understory/base/result.hpp"
#include "understory/plan/barrier.hpp"
#include "understory/plan/clearance_map.hpp"
#include "understory/plan/look_around.hpp"
#include "understory/plan/trajectory.hpp"

namespace understory {

struct PlanConfig {
  double vehicle_radius_m = 0.20;
  double margin_m = 0.08;          // over the radius, when a trajectory is made
  double recheck_margin_m = 0.05;  // over the radius, when a flown trajectory is checked again
  double preferred_clearance_m = 0.45;
  double horizon_m = 8.0;  // longer routes are flown piece by piece
  LookConfig look;

  void visit(FieldVisitor& f) {
    f.field("vehicle_radius_m", vehicle_radius_m, in_range(0.05, 2.0), "sphere around the vehicle");
    f.field("margin_m", margin_m, in_range(0.0, 1.0), "kept free around that sphere when planning");
    f.field("recheck_margin_m",
            recheck_margin_m,
            in_range(0.0, 1.0),
            "the same when a trajectory in flight is checked again; smaller, so that voxel noise "
            "does not stop the vehicle");
    f.field("preferred_clearance_m",
            preferred_clearance_m,
            in_range(0.1, 2.0),
            "the optimiser keeps this distance where there is room");
    f.field("horizon_m",
            horizon_m,
            in_range(2.0, 50.0),
            "longest piece of a route that one trajectory covers");
    f.section("look", look, "Where the camera looks on the way; not in the paper.");
  }
};

enum class PlanError {
  kStartBlocked,
  kGoalBlocked,
  kNoRoute,
  kLimits,
  kUnsafe,
  kBudgetSpent,
  kTraffic,
  kBarred
};
[[nodiscard]] const char* to_string(PlanError error);

struct PlanRequest {
  TrajectoryPoint start;
  Time start_time{};
  std::vector<Vector3d> route_m;  // from the start's position to the goal, collision-free legs
  Barriers barriers;              // that the route leads around
  double goal_yaw_rad = 0.0;
  std::vector<Sight> sights;  // to be looked at on the way, where that costs no time
  bool looks_ahead = false;   // where it flies instead
  Limits limits;
  FlightMode mode = FlightMode::kExplorer;
};

class TrajectoryPlanner {
 public:
  explicit TrajectoryPlanner(const PlanConfig& config) : config_(config) {}

  [[nodiscard]] Result<Trajectory, PlanError> plan(const ClearanceMap& map,
                                                   const PlanRequest& request) const;

  // To rest as soon as the limits allow, inside free space. Yaw rate goes to zero as well.
  [[nodiscard]] Result<Trajectory, PlanError> plan_brake(const ClearanceMap& map,
                                                         const Trajectory& flown,
                                                         Time from) const;

 private:
  [[nodiscard]] Trajectory looking(const ClearanceMap& map,
                                   const PlanRequest& request,
                                   const Trajectory& planned) const;

  PlanConfig config_;
};

// The first sampled instant (100 Hz) at or after `from` at which the ball of this radius around the
// vehicle touches a voxel that is not known free; none: safe to its end.
[[nodiscard]] std::optional<Time> first_unsafe_time(const ClearanceMap& map,
                                                    const Trajectory& trajectory,
                                                    Time from,
                                                    double radius_m);

// Do speed, acceleration and yaw rate hold at 100 Hz from start to end, and does it end at rest?
[[nodiscard]] bool within_limits(const Trajectory& trajectory);

}  // namespace understory
