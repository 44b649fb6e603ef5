// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Keeps the vehicle on checked trajectories: plans from a little ahead of now on the one being
// flown, checks what is flown against every new map, brakes when a check fails. Nothing unchecked
// is ever handed out, and all that is handed out ends at rest in known free space. World frame, SI
// units, one thread; in flight every failure is a value.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "understory/plan/traffic.hpp"
#include "understory/plan/trajectory_follower.hpp"
#include "understory/plan/trajectory_planner.hpp"

namespace understory {

struct FlightGoal {
  std::vector<Vector3d> route_m;  // from where the next trajectory starts
  double yaw_rad = 0.0;
  FlightMode mode = FlightMode::kExplorer;
  Limits limits;
  std::vector<Sight> sights = {};  // to be looked at on the way
};

struct PilotCounters {
  std::uint64_t plans = 0;
  std::uint64_t failed_plans = 0;
  std::uint64_t brakes = 0;
  std::uint64_t failed_brakes = 0;
  std::uint64_t unsafe_checks = 0;
  std::uint64_t traffic_conflicts = 0;  // plans that others were in the way of
};

class Pilot {
 public:
  Pilot(const PlanConfig& config, Duration lead);

  // At rest here until told otherwise.
  void take_position(const Vector3d& position_m, double yaw_rad, Time now);

  void update_map(const MapSnapshotPtr& snapshot) { clearance_.update(snapshot); }
  [[nodiscard]] const ClearanceMap& clearance() const { return clearance_; }
  // Who else flies here, as known now.
  void set_traffic(Traffic traffic) { traffic_ = std::move(traffic); }

  // From now on so that two who see each other over this distance can stop before they meet:
  // looking where it flies, and slower if need be. Null: as it likes.
  void be_wary(std::optional<double> sight_m) { sight_m_ = sight_m; }

  // Where routes for a trajectory planned now do not lead.
  [[nodiscard]] Barriers barriers(Time now) const {
    return traffic_.barriers(next_start_point(now).position_m, next_start(now));
  }

  // Where a trajectory planned now begins.
  [[nodiscard]] Time next_start(Time now) const { return now + lead_; }
  [[nodiscard]] TrajectoryPoint next_start_point(Time now) const {
    return follower_.sample(next_start(now));
  }

  // When what is being flown first comes too close to something, as the newest map has it, or has
  // to have given way to someone.
  [[nodiscard]] std::optional<Time> unsafe_from(Time now) const;

  Result<TrajectoryPtr, PlanError> fly(const FlightGoal& goal, Time now);
  // Null: it brakes already, and to brake anew would only put it off.
  Result<TrajectoryPtr, PlanError> brake(Time now);
  // As if it had never been handed out: what was flown before holds on.
  void withdraw(const TrajectoryPtr& trajectory) { follower_.remove(trajectory); }

  [[nodiscard]] const TrajectoryFollower& follower() const { return follower_; }
  [[nodiscard]] bool is_at_rest(Time now) const { return now >= follower_.newest()->end(); }
  [[nodiscard]] const PilotCounters& counters() const { return counters_; }

 private:
  // When what is flown first comes too close to what the map has.
  [[nodiscard]] std::optional<Time> blocked_from(Time now) const;
  TrajectoryPtr accept(Trajectory trajectory, Time now);

  PlanConfig config_;
  Duration lead_;
  std::optional<double> sight_m_;  // while it is wary
  TrajectoryPlanner planner_;
  ClearanceMap clearance_;
  Traffic traffic_;
  TrajectoryFollower follower_;
  PilotCounters counters_;
  std::uint64_t next_id_ = 1;
};

}  // namespace understory
