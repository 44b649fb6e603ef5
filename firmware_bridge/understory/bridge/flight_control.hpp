// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Which setpoint is sent now: that of the newest trajectory while the vehicle follows it, else a
// hold. A vehicle that is not where its trajectory is, or that has held or landed by itself, is
// astray: no trajectory is flown any more, because none begins where it is. Every setpoint passes
// the gate. Values; the flight thread or the lockstep host; no allocation, cannot fail.
#pragma once

#include "understory/bridge/autopilot.hpp"
#include "understory/bridge/setpoint_gate.hpp"
#include "understory/plan/trajectory_follower.hpp"

namespace understory {

struct TrackingConfig {
  double max_error_m = 1.0;
  double patience_s = 0.3;

  void visit(FieldVisitor& f) {
    f.field("max_error_m",
            max_error_m,
            in_range(0.1, 2.5),
            "a vehicle this far from its setpoint is astray");
    f.field("patience_s", patience_s, in_range(0.0, 5.0), "once it has been so for so long");
  }
};

struct FlightDecision {
  std::optional<Setpoint> setpoint;
  bool is_hold = true;
  const Trajectory* flown = nullptr;  // of the plan that was given
  bool is_at_rest = true;             // the plan has ended
};

class FlightControl {
 public:
  FlightControl(const GateConfig& gate, const TrackingConfig& tracking, const Box3d& box_m);

  [[nodiscard]] FlightDecision decide(const TrajectoryFollower* plan,
                                      const Telemetry& telemetry,
                                      Time now);

  [[nodiscard]] bool is_astray() const { return is_astray_; }
  [[nodiscard]] std::uint64_t gate_violations() const { return gate_.violations(); }

 private:
  void watch(const FlightDecision& decision, const Telemetry& telemetry, Time now);

  TrackingConfig tracking_;
  SetpointGate gate_;
  std::optional<Setpoint> hold_;
  std::optional<Time> far_since_;
  bool has_flown_plan_ = false;
  bool is_astray_ = false;
};

[[nodiscard]] Setpoint to_setpoint(const TrajectoryPoint& point);

}  // namespace understory
