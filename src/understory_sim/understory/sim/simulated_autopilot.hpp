// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// The control law and the true vehicle behind the bridge's interface, in real time: each call
// brings the physics up to now in steps of 2 ms. World ENU, SI units. As any Autopilot: one thread,
// no allocation, nothing fails after construction.
#pragma once

#include "understory/bridge/autopilot.hpp"
#include "understory/sim/vehicle.hpp"

namespace understory {

class SimulatedAutopilot : public Autopilot {
 public:
  // Stands or hovers where it starts. ConfigError when the motors cannot carry the airframe.
  SimulatedAutopilot(const VehicleConfig& vehicle,
                     const ControlConfig& control,
                     const Vector3d& start_m,
                     double yaw_rad,
                     const Rng& rng);

  void send(const Setpoint& setpoint, Time now) override;
  [[nodiscard]] Telemetry receive(Time now) override;
  void land() override;

 private:
  Vehicle vehicle_;
  ControlLaw law_;
  bool has_setpoint_ = false;
  Setpoint setpoint_;
  Time setpoint_time_{};
  bool has_time_ = false;
  Time time_{};
};

}  // namespace understory
