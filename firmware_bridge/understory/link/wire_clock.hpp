// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Times on the bus are microseconds modulo 2^24 (16.8 s). Between two of them only the shorter way
// round counts: plus or minus 8.4 s. Pure functions; nothing can fail.
#pragma once

#include <cstdint>

#include "understory/base/time.hpp"

namespace understory::can {

inline constexpr std::int64_t kWireClockUs = std::int64_t{1} << 24U;

[[nodiscard]] inline std::uint32_t wire_time_us(Time time) {
  return static_cast<std::uint32_t>(time.time_since_epoch().count() & (kWireClockUs - 1));
}

// From `earlier` to `later`.
[[nodiscard]] inline Duration wire_difference(std::uint32_t later_us, std::uint32_t earlier_us) {
  const std::int64_t ahead_us = (std::int64_t{later_us} - earlier_us) & (kWireClockUs - 1);
  return Duration(ahead_us < kWireClockUs / 2 ? ahead_us : ahead_us - kWireClockUs);
}

// The time next to `near` that reads so on the bus.
[[nodiscard]] inline Time time_near(std::uint32_t wire_us, Time near) {
  return near + wire_difference(wire_us, wire_time_us(near));
}

}  // namespace understory::can
