// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What is known of a team mate, by its own word. World frame, SI units; all times are of this
// vehicle's clock. A value.
#pragma once

#include <optional>
#include <vector>

#include "understory/mission.hpp"
#include "understory/plan/trajectory.hpp"

namespace understory::team {

struct Peer {
  std::uint8_t id = 0;
  Time heard_at{};   // when the newest word of it arrived
  Time stated_at{};  // when it was where the position says
  Vector3d position_m = Vector3d::Zero();
  Vector3d velocity_mps = Vector3d::Zero();
  double yaw_rad = 0.0;
  FlightMode mode = FlightMode::kExplorer;
  MissionState state = MissionState::kWaiting;
  std::optional<Vector3d> target_m;
  TrajectoryPtr trajectory;  // null: none has arrived; its times are mapped to this clock
  bool in_contact = true;    // false: silent for longer than the configuration bears
};

// By id, without the vehicle itself.
using Peers = std::vector<Peer>;

}  // namespace understory::team
