// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// How far a team mate's clock is ahead of this vehicle's. From times that went there and back, as
// NTP does (RFC 5905, section 8): of the last ones that with the least delay, which bounds the
// error by half of it. Before the first has come back: as if what arrived first had taken no time.
// A value.
#pragma once

#include <cstddef>
#include <deque>
#include <optional>

#include "understory/base/time.hpp"

namespace understory::team {

class ClockEstimate {
 public:
  // Sent at `stated` of their clock, arrived at `arrived` of ours.
  void add_one_way(Time stated, Time arrived);
  // Besides: it answers what was sent at `sent` of our clock and lay with them for `held`.
  void add_round_trip(Time sent, Duration held, Time stated, Time arrived);

  // Theirs minus ours; none before anything has arrived.
  [[nodiscard]] std::optional<Duration> offset() const;

 private:
  static constexpr std::size_t kRemembered = 16;

  struct RoundTrip {
    Duration delay;
    Duration offset;
  };

  std::deque<Duration> one_way_;  // theirs minus ours, less the delay
  std::deque<RoundTrip> round_trips_;
};

}  // namespace understory::team
