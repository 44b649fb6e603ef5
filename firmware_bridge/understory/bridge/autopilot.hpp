// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What the bridge flies: something that takes setpoints and tells where the vehicle is. World ENU,
// body FLU, SI units. Called by the flight thread alone, at its rate; implementations must not
// block, allocate or throw. Today the simulated autopilot; the one on the CAN bus comes with it.
#pragma once

#include <cstdint>

#include "understory/autopilot/control_law.hpp"
#include "understory/base/time.hpp"

namespace understory {

struct Telemetry {
  Time time{};
  VehicleState state;
  bool is_down = false;  // landed, motors off
  std::uint64_t rejected_inputs = 0;
};

class Autopilot {
 public:
  Autopilot() = default;
  Autopilot(const Autopilot&) = delete;
  Autopilot& operator=(const Autopilot&) = delete;
  virtual ~Autopilot() = default;

  virtual void send(const Setpoint& setpoint, Time now) = 0;
  // The newest there is.
  [[nodiscard]] virtual Telemetry receive(Time now) = 0;
  // Sets the vehicle down where it is; setpoints are ignored from then on.
  virtual void land() = 0;
};

}  // namespace understory
