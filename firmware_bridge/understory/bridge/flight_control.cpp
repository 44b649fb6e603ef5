// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/bridge/flight_control.hpp"

namespace understory {
namespace {

Setpoint hold_at(const VehicleState& state) {
  Setpoint hold;
  hold.position_m = state.position_m;
  hold.yaw_rad = yaw_of(state.world_from_body);
  return hold;
}

}  // namespace

Setpoint to_setpoint(const TrajectoryPoint& point) {
  return {point.position_m,
          point.velocity_mps,
          point.acceleration_mps2,
          point.yaw_rad,
          point.yaw_rate_radps};
}

FlightControl::FlightControl(const GateConfig& gate,
                             const TrackingConfig& tracking,
                             const Box3d& box_m)
    : tracking_(tracking), gate_(gate, box_m) {}

void FlightControl::watch(const FlightDecision& decision, const Telemetry& telemetry, Time now) {
  const double error_m = decision.setpoint && telemetry.is_valid
                             ? (decision.setpoint->position_m - telemetry.state.position_m).norm()
                             : 0.0;
  if (error_m <= tracking_.max_error_m) {
    far_since_.reset();
    return;
  }
  far_since_ = far_since_.value_or(now);
  is_astray_ = is_astray_ || to_seconds(now - *far_since_) >= tracking_.patience_s;
}

FlightDecision FlightControl::decide(const TrajectoryFollower* plan,
                                     const Telemetry& telemetry,
                                     Time now) {
  FlightDecision decision;
  decision.is_at_rest = plan == nullptr || now >= plan->newest()->end();
  if (!telemetry.is_following) {
    // What it did not follow has gone on without it.
    is_astray_ = is_astray_ || has_flown_plan_;
    hold_.reset();
    if (telemetry.is_valid) {
      gate_.forget();
      decision.setpoint = gate_.pass(hold_at(telemetry.state), now);
    }
    return decision;
  }
  if (plan != nullptr && !is_astray_) {
    hold_.reset();
    has_flown_plan_ = true;
    decision.flown = &plan->at(now);
    decision.setpoint = gate_.pass(to_setpoint(decision.flown->sample(now)), now);
    decision.is_hold = decision.is_at_rest;
    watch(decision, telemetry, now);
    return decision;
  }
  if (hold_) {
    decision.setpoint = gate_.pass(*hold_, now);
  } else if (telemetry.is_valid) {
    // Where it is, however far from where it was to be: else it would be sent back there.
    gate_.forget();
    decision.setpoint = gate_.pass(hold_at(telemetry.state), now);
    hold_ = decision.setpoint;
  }
  return decision;
}

}  // namespace understory
