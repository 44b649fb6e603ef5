// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/team/clock_estimate.hpp"

#include <algorithm>

namespace understory::team {

void ClockEstimate::add_one_way(Time stated, Time arrived) {
  one_way_.push_back(stated - arrived);
  if (one_way_.size() > kRemembered) {
    one_way_.pop_front();
  }
}

void ClockEstimate::add_round_trip(Time sent, Duration held, Time stated, Time arrived) {
  const Duration delay = arrived - sent - held;
  if (held < Duration::zero() || delay < Duration::zero()) {
    return;  // cannot be
  }
  const Time received = stated - held;  // of their clock
  round_trips_.push_back({delay, ((received - sent) + (stated - arrived)) / 2});
  if (round_trips_.size() > kRemembered) {
    round_trips_.pop_front();
  }
}

std::optional<Duration> ClockEstimate::offset() const {
  if (!round_trips_.empty()) {
    const auto by_delay = [](const RoundTrip& a, const RoundTrip& b) { return a.delay < b.delay; };
    return std::min_element(round_trips_.begin(), round_trips_.end(), by_delay)->offset;
  }
  if (!one_way_.empty()) {
    return *std::max_element(one_way_.begin(), one_way_.end());
  }
  return std::nullopt;
}

}  // namespace understory::team
