// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/live_line.hpp"

#include <cstdio>

#include <fmt/core.h>
#include <unistd.h>

namespace understory {
namespace {

constexpr auto kTerminalInterval = std::chrono::milliseconds(200);
constexpr auto kLogInterval = std::chrono::seconds(10);

}  // namespace

LiveLine::LiveLine(bool is_quiet)
    : is_quiet_(is_quiet),
      is_terminal_(isatty(STDERR_FILENO) == 1),
      next_(std::chrono::steady_clock::now()) {}

void LiveLine::print(const TickRow& row, double realtime_factor) const {
  fmt::print(stderr,
             "{}t {:6.1f} s  {}  {:4.2f} m/s  {:<11} {:<10} {:3} clusters  x{:.0f}{}",
             is_terminal_ ? "\r" : "",
             row.time_s,
             row.coverage ? fmt::format("coverage {:5.1f} %", 100.0 * *row.coverage)
                          : fmt::format("{:7.1f} m3 known", row.explored_volume_m3),
             row.velocity_mps.norm(),
             row.mission_state,
             row.mode,
             row.clusters,
             realtime_factor,
             is_terminal_ ? "\033[K" : "\n");
  static_cast<void>(std::fflush(stderr));
}

void LiveLine::show(const TickRow& row, double realtime_factor) {
  const auto now = std::chrono::steady_clock::now();
  if (is_quiet_ || now < next_) {
    return;
  }
  next_ =
      now + (is_terminal_ ? std::chrono::duration_cast<std::chrono::nanoseconds>(kTerminalInterval)
                          : std::chrono::duration_cast<std::chrono::nanoseconds>(kLogInterval));
  print(row, realtime_factor);
}

void LiveLine::finish(const TickRow& row, double realtime_factor) {
  if (!is_quiet_) {
    print(row, realtime_factor);
    fmt::print(stderr, "{}", is_terminal_ ? "\n" : "");
  }
}

}  // namespace understory
