// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// The clocks of a flight in real time. Any thread; cannot fail.
#pragma once

#include <cstdint>

#include "understory/base/time.hpp"

namespace understory {

// Wall-clock time as trajectories and the bus use it.
[[nodiscard]] Time wall_time();
[[nodiscard]] std::int64_t steady_ns();
// Returns at this time of the steady clock, whatever interrupts.
void sleep_until(std::int64_t steady_ns);

}  // namespace understory
