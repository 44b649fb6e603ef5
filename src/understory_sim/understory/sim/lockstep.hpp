// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// One mission in lockstep: physics and control law at 500 Hz, setpoints at 100 Hz over a bus in
// memory, camera, map and decisions at the camera's rate, all on one thread and one virtual clock.
// The mission starts once the vehicle is armed. The same configuration, forest and seed give the
// same flight and the same frames, bit for bit. World frame, SI units. Construction throws on wrong
// configuration; flying does not throw.
#pragma once

#include <functional>

#include "understory/base/rng.hpp"
#include "understory/bridge/flight_control.hpp"
#include "understory/map/mapper.hpp"
#include "understory/mission.hpp"
#include "understory/sim/depth_renderer.hpp"
#include "understory/sim/simulated_bus.hpp"
#include "understory/sim/simulation_config.hpp"
#include "understory/sim/stage_times.hpp"
#include "understory/sim/team_member.hpp"

namespace understory {

struct LockstepFrame {
  Time time{};
  MapSnapshotPtr map;      // what decisions are made on
  MapSnapshotPtr own_map;  // what of it the vehicle has seen itself
  MissionStep step;
};

class Lockstep {
 public:
  using StepHook = SimulatedBus::StepHook;

  // `resumed`: go on from this map instead of an unknown one. `on_step` sees the true vehicle at
  // every physics step; `times` collects wall times per stage.
  Lockstep(const SimulationConfig& config,
           std::shared_ptr<const DepthRenderer> renderer,
           const Rng& rng,
           const MapSnapshot* resumed,
           StepHook on_step,
           StageTimes& times);

  // From now on it works with a team.
  void join(std::unique_ptr<TeamMember> member) { member_ = std::move(member); }
  [[nodiscard]] const TeamMember* member() const { return member_.get(); }

  // Flies to the next exposure and through the decision that follows from it.
  LockstepFrame advance();
  // The same in two steps, between which others fly too; then they are where it may see them.
  void fly_to_next_exposure();
  LockstepFrame see_and_decide(const std::vector<Vector3d>& others_m);

  // The autopilot has set the vehicle down, or it hovers where it was stopped, or it has had ample
  // time for either.
  [[nodiscard]] bool is_over() const;
  void stop(StopReason reason) { mission_.stop(reason, now_); }

  [[nodiscard]] Time now() const { return now_; }
  [[nodiscard]] const Mission& mission() const { return mission_; }
  // The truth.
  [[nodiscard]] const VehicleState& vehicle() const { return bus_.vehicle().state(); }
  // Sees every frame on the bus.
  void set_tap(std::shared_ptr<can::FrameTap> tap) { bus_.host().node().set_tap(std::move(tap)); }
  [[nodiscard]] std::uint64_t gate_violations() const { return control_.gate_violations(); }
  [[nodiscard]] std::uint64_t skipped_frames() const { return skipped_frames_; }

 private:
  struct Stages {
    explicit Stages(StageTimes& times);
    StageTimes::Stage flight;
    StageTimes::Stage camera;
    StageTimes::Stage map;
    StageTimes::Stage update;    // frontiers and checks, no decision due
    StageTimes::Stage decision;  // the same, and target and trajectory
  };

  void fly_until(Time exposure);
  [[nodiscard]] DepthImage expose(const Pose& world_from_optical,
                                  const std::vector<Vector3d>& others_m);
  [[nodiscard]] MapSnapshotPtr update_map();
  [[nodiscard]] MissionStep decide(const MapSnapshotPtr& map);
  void fly_tick();
  void follow_vehicle(const Telemetry& telemetry);

  SimulationConfig config_;
  StepHook on_step_;
  StageTimes& times_;
  Stages stages_;
  SimulatedBus bus_;
  FlightControl control_;
  std::shared_ptr<const DepthRenderer> renderer_;
  CameraModel camera_;
  Pose body_from_optical_;
  Rng noise_rng_;
  Mapper mapper_;
  Mission mission_;
  std::unique_ptr<TeamMember> member_;  // null: it is alone
  Time now_{};
  std::int64_t frame_ = 0;
  Time next_tick_{};
  bool is_down_ = false;
  DepthImage image_;
  Time over_since_{};
  std::uint64_t skipped_frames_ = 0;
};

}  // namespace understory
