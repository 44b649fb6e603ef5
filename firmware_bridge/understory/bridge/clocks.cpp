// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/bridge/clocks.hpp"

#include <cerrno>
#include <ctime>

namespace understory {
namespace {

constexpr std::int64_t kNanoseconds = 1'000'000'000;

std::int64_t now_ns(clockid_t clock) {
  timespec time{};
  clock_gettime(clock, &time);
  return time.tv_sec * kNanoseconds + time.tv_nsec;
}

}  // namespace

Time wall_time() {
  return Time(Duration(now_ns(CLOCK_REALTIME) / 1000));
}

std::int64_t steady_ns() {
  return now_ns(CLOCK_MONOTONIC);
}

void sleep_until(std::int64_t until_ns) {
  const timespec until{static_cast<time_t>(until_ns / kNanoseconds),
                       static_cast<long>(until_ns % kNanoseconds)};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) {
  }
}

}  // namespace understory
