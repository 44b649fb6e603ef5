// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// The vehicle's clock as the host knows it, from PING and PONG: of the last 16 round trips the
// quickest counts, because it has waited the least. A clock that has jumped, as after a restart, is
// learnt anew. Source: the clock filter of NTP (RFC 5905, section 10). One thread; no allocation;
// cannot fail.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "understory/link/wire_clock.hpp"

namespace understory::can {

class ClockSync {
 public:
  // Sent and received by the host's clock; arrived at the vehicle, by its own, and answered `dwell`
  // later. A round trip that took less than no time, or more than a second, is none.
  void add(Time sent, std::uint32_t arrived_wire_us, Duration dwell, Time received) {
    const Duration round_trip = received - sent - dwell;
    if (round_trip < Duration(0) || round_trip > std::chrono::seconds(1)) {
      return;
    }
    const Time middle = sent + round_trip / 2;
    const Sample sample{wire_difference(arrived_wire_us, wire_time_us(middle)), round_trip};
    if (is_set() && has_jumped(sample)) {
      reset();
    }
    samples_[next_] = sample;
    next_ = (next_ + 1) % samples_.size();
    count_ = count_ < samples_.size() ? count_ + 1 : count_;
    best_ = 0;
    for (std::size_t i = 1; i < count_; ++i) {
      best_ = samples_[i].round_trip < samples_[best_].round_trip ? i : best_;
    }
  }

  void reset() { count_ = next_ = best_ = 0; }
  [[nodiscard]] bool is_set() const { return count_ > 0; }
  // These two only once it is set.
  [[nodiscard]] std::uint32_t vehicle_wire_us(Time host) const {
    return wire_time_us(host + samples_[best_].offset);
  }
  [[nodiscard]] Time host_time(std::uint32_t vehicle_us, Time near) const {
    return time_near(vehicle_us, near + samples_[best_].offset) - samples_[best_].offset;
  }
  [[nodiscard]] std::optional<Duration> round_trip() const {
    return is_set() ? std::optional(samples_[best_].round_trip) : std::nullopt;
  }

 private:
  struct Sample {
    Duration offset{};  // vehicle's clock less the host's, on the bus's scale
    Duration round_trip{};
  };
  // Further than what either message can have been under way explains, and some drift.
  [[nodiscard]] bool has_jumped(const Sample& sample) const {
    const Sample& best = samples_[best_];
    const Duration apart = std::chrono::abs(sample.offset - best.offset);
    return apart > (sample.round_trip + best.round_trip) / 2 + std::chrono::milliseconds(2);
  }

  std::array<Sample, 16> samples_{};
  std::size_t next_ = 0;
  std::size_t count_ = 0;
  std::size_t best_ = 0;
};

}  // namespace understory::can
