// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What is known of a team mate, by its own word. World frame, SI units; all times are of this
// vehicle's clock. A value.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "understory/mission_state.hpp"
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
  MissionState state{};
  std::optional<Vector3d> target_m;
  TrajectoryPtr trajectory;  // null: none has arrived; its times are mapped to this clock
  bool in_contact = true;    // false: silent for longer than the configuration bears

  // Did it fly what it said it would, when last heard?
  [[nodiscard]] bool is_on_trajectory() const {
    constexpr double kStrayM = 1.0;
    return trajectory != nullptr &&
           (trajectory->sample(stated_at).position_m - position_m).norm() < kStrayM;
  }
  [[nodiscard]] Vector3d position_at(Time time) const {
    return is_on_trajectory() ? trajectory->sample(time).position_m : position_m;
  }
};

// By id, without the vehicle itself.
using Peers = std::vector<Peer>;

}  // namespace understory::team
