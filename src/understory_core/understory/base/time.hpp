// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Time as core code sees it: integer microseconds since the start of the mission clock. The clock
// has no now(): time is always an argument, so the same code runs live and in lockstep.
#pragma once

#include <chrono>
#include <cmath>
#include <cstdint>

namespace understory {

struct MissionClock {
  using rep = std::int64_t;
  using period = std::micro;
  using duration = std::chrono::duration<rep, period>;
  using time_point = std::chrono::time_point<MissionClock, duration>;
  // NOLINTNEXTLINE(readability-identifier-naming): a clock of the standard library has it
  static constexpr bool is_steady = true;
};

using Duration = MissionClock::duration;
using Time = MissionClock::time_point;

[[nodiscard]] constexpr double to_seconds(Duration duration) {
  return static_cast<double>(duration.count()) * 1e-6;
}
[[nodiscard]] constexpr double to_seconds(Time time) {
  return to_seconds(time.time_since_epoch());
}

// Rounded to the nearest microsecond.
[[nodiscard]] inline Duration duration_from_seconds(double seconds) {
  return Duration(static_cast<Duration::rep>(std::llround(seconds * 1e6)));
}

}  // namespace understory
