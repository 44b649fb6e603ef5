// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// The autopilot's control law: geometric tracking control on SE(3) (Lee, Leok, McClamroch 2010)
// from setpoint and state to four motor commands. The same code flies in the lockstep simulator
// and in the autopilot stand-in on the bus. World ENU, body FLU, SI units. Call at 500 Hz or more.
// No allocation, no exception in update(); one thread.
#pragma once

#include <array>

#include "understory/base/config.hpp"
#include "understory/base/geometry.hpp"

namespace understory {

struct VehicleState {
  Vector3d position_m = Vector3d::Zero();
  Vector3d velocity_mps = Vector3d::Zero();
  Eigen::Quaterniond world_from_body = Eigen::Quaterniond::Identity();
  Vector3d body_rates_radps = Vector3d::Zero();
};

struct Setpoint {
  Vector3d position_m = Vector3d::Zero();
  Vector3d velocity_mps = Vector3d::Zero();
  Vector3d acceleration_mps2 = Vector3d::Zero();
  double yaw_rad = 0.0;
  double yaw_rate_radps = 0.0;
};

// Thrust of each motor as a fraction of its maximum, 0 .. 1. Order: front left, front right,
// rear right, rear left.
using MotorCommands = std::array<double, 4>;

}  // namespace understory
