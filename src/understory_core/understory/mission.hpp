// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// The mission around the exploration: take off, explore until nothing is left, return home, land;
// and what an operator may ask for in between. World frame, SI units. Called with every map update,
// on one thread; deterministic; nothing throws in flight. Every phase is bounded: what cannot be
// flown after a number of tries ends the mission where the vehicle is, at rest in known free space.
#pragma once

#include "understory/explorer.hpp"
#include "understory/mission_state.hpp"
#include "understory/team/lookout.hpp"
#include "understory/team/meeting.hpp"

namespace understory {

struct MissionConfig {
  double take_off_height_m = 1.0;
  double launch_site_radius_m = 0.7;
  double time_limit_s = 1500.0;
  bool return_home = true;
  bool auto_start = true;

  void visit(FieldVisitor& f) {
    f.field("take_off_height_m",
            take_off_height_m,
            in_range(0.2, 100.0),
            "a vehicle that starts lower climbs to this height first");
    f.field("launch_site_radius_m",
            launch_site_radius_m,
            in_range(0.3, 5.0),
            "the operator vouches that this much around the start is free, up to take-off height");
    f.field("time_limit_s", time_limit_s, in_range(1.0, 1e6), "then the vehicle stops where it is");
    f.field("return_home", return_home, "fly back to the start and land when nothing is left");
    f.field("auto_start", auto_start, "false: the vehicle stays where it is until told to start");
  }
};

// What the operator vouches for; to be marked free in the map before the first update.
[[nodiscard]] Box3d launch_site_m(const MissionConfig& config, const Vector3d& home_m);

struct MissionStep {
  ExploreStep explore;
  TrajectoryPtr published;
};

class Mission {
 public:
  // `home_m` is where the vehicle stands or hovers now, at rest.
  Mission(const MissionConfig& config,
          const ExplorerConfig& explorer,
          const GridGeometry& geometry,
          const Vector3d& home_m,
          double yaw_rad,
          Time now);

  MissionStep on_map(const MapSnapshotPtr& snapshot, Time now);
  // What is known of team mates now; before on_map().
  void set_peers(const team::Peers& peers, Time now);
  // Brakes, and stays where it is. Once it is over, nothing more happens.
  TrajectoryPtr stop(StopReason reason, Time now);

  // What an operator asks for. False: not now (start: it flies already; the others: it is over).
  // A trajectory is handed out where the vehicle must brake first.
  bool start(Time now);
  struct Answer {
    bool accepted = false;
    TrajectoryPtr published;
  };
  Answer pause(Time now);
  Answer return_home(Time now);
  Answer land(Time now);

  // The host could not hand this trajectory out in time: what was flown before is flown on.
  void withdraw(const TrajectoryPtr& trajectory);

  [[nodiscard]] MissionState state() const { return state_; }
  // kLand: the autopilot sets the vehicle down; kStopped: it hovers. Nothing more will be planned.
  [[nodiscard]] bool is_over() const {
    return state_ == MissionState::kLand || state_ == MissionState::kStopped;
  }
  [[nodiscard]] StopReason stop_reason() const { return reason_; }
  [[nodiscard]] Time started_at() const { return started_at_; }
  // When exploration ended; meaningful once a stop reason is set.
  [[nodiscard]] Time explored_at() const { return explored_at_; }
  [[nodiscard]] const Pilot& pilot() const { return pilot_; }
  [[nodiscard]] const Explorer& explorer() const { return explorer_; }

 private:
  // For team mates: for those heard, and those that this map's cloud shows.
  void watch_out(const MapSnapshot& map, Time now);
  [[nodiscard]] bool is_flying_unwatched() const;
  TrajectoryPtr brake(Time now);
  void end_exploration(StopReason reason, Time now);
  TrajectoryPtr climb(Time now);
  TrajectoryPtr explore(const ExploreStep& step, Time now);
  void resume_at_home();
  [[nodiscard]] std::vector<Vector3d> route_home(Time now);
  [[nodiscard]] bool is_home(Time now) const;
  [[nodiscard]] bool is_way_home_over(Time now) const;
  TrajectoryPtr fly_home(Time now);
  TrajectoryPtr meet(Time now);
  TrajectoryPtr descend(Time now);
  TrajectoryPtr fly_leg(const Vector3d& to_m, Time now);

  MissionConfig config_;
  ExplorerConfig explorer_config_;
  Pilot pilot_;
  Explorer explorer_;
  team::Meeting meeting_;
  team::Lookout lookout_;
  Vector3d home_m_;
  double home_yaw_rad_;
  bool has_map_ = false;  // without one nothing but rest is flown
  MissionState state_;
  MissionState resumed_state_ = MissionState::kTakeOff;  // what follows on a pause
  StopReason reason_ = StopReason::kNone;
  Time started_at_;
  Time explored_at_{};
  bool has_explored_ = true;  // since explored_at_ was set
  std::optional<Time> nothing_left_since_;
  int resumptions_ = 0;
  Time last_leg_{};
  int strikes_ = 0;
};

}  // namespace understory
