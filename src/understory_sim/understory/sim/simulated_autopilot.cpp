// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/simulated_autopilot.hpp"

#include <algorithm>

namespace understory {
namespace {

constexpr Duration kPhysicsStep = std::chrono::milliseconds(2);
constexpr Duration kFullyExtrapolated = std::chrono::milliseconds(50);
// The world stands still while the process was suspended for longer.
constexpr Duration kLongestCatchUp = std::chrono::seconds(1);

}  // namespace

// NOLINTNEXTLINE(readability-function-size): all that a vehicle is made of, once
SimulatedAutopilot::SimulatedAutopilot(const VehicleConfig& vehicle,
                                       const ControlConfig& control,
                                       const Vector3d& start_m,
                                       double yaw_rad,
                                       const Rng& rng)
    : vehicle_(vehicle, start_m, yaw_rad, rng), law_(vehicle.airframe, control) {
  // Before the first setpoint it holds where it starts.
  setpoint_.position_m = start_m;
  setpoint_.yaw_rad = yaw_rad;
  law_.set_mode(ControlMode::kTrack);
}

void SimulatedAutopilot::send(const Setpoint& setpoint, Time now) {
  static_cast<void>(receive(now));  // up to now the previous one holds
  setpoint_ = setpoint;
  setpoint_time_ = now;
  has_setpoint_ = true;
}

Telemetry SimulatedAutopilot::receive(Time now) {
  if (!has_time_ || now - time_ > kLongestCatchUp) {
    time_ = now;
    has_time_ = true;
  }
  const double step_s = to_seconds(kPhysicsStep);
  while (time_ + kPhysicsStep <= now) {
    const Duration age = has_setpoint_ ? time_ - setpoint_time_ : Duration(0);
    const double age_s = to_seconds(std::clamp(age, Duration(0), kFullyExtrapolated));
    vehicle_.step(law_.update(vehicle_.state(), extrapolated(setpoint_, age_s), step_s), step_s);
    time_ += kPhysicsStep;
  }
  Telemetry telemetry;
  telemetry.time = time_;
  telemetry.state = vehicle_.state();
  telemetry.is_down = law_.mode() == ControlMode::kIdle;
  telemetry.rejected_inputs = law_.rejected_inputs();
  return telemetry;
}

void SimulatedAutopilot::land() {
  law_.set_mode(ControlMode::kLand);
}

}  // namespace understory
