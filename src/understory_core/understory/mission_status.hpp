// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What the world is told of a mission at one instant: for live lines, results, messages. A value;
// World frame, SI units. Nothing here can fail.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "understory/mission.hpp"

namespace understory {

struct MissionStatus {
  Time time{};
  MissionState state = MissionState::kWaiting;
  StopReason stop_reason = StopReason::kNone;
  FlightMode mode = FlightMode::kBrake;  // of what is flown now
  bool at_rest = true;
  Time started_at{};
  std::optional<Time> explored_at;  // once a stop reason is set
  std::size_t clusters = 0;
  std::size_t trails = 0;
  std::size_t dormant = 0;
  std::size_t set_aside = 0;
  std::optional<std::uint64_t> target_id;
  std::optional<Vector3d> target_m;
  std::uint64_t replans = 0;
  std::map<std::string, std::uint64_t> counters;

  [[nodiscard]] bool is_over() const {
    return state == MissionState::kLand || state == MissionState::kStopped;
  }
};

[[nodiscard]] MissionStatus status_of(const Mission& mission, Time now);

}  // namespace understory
