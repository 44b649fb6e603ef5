// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Keeps one identifier from drowning the others: a token bucket for each, filled at three times the
// nominal rate and deep enough for what gathers in 50 ms. It is written as the generic cell rate
// algorithm (ITU-T I.371), which needs one time per identifier. Times are the frames' stamps.
// Identifiers without a rate are not for us. One thread; no allocation after construction.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cstdint>
#include <vector>

#include "understory/base/time.hpp"
#include "understory/can/id_set.hpp"

namespace understory::can {

struct NominalRate {
  std::uint16_t id = 0;
  double rate_hz = 0.0;  // of messages that are only sent on events: the fastest that makes sense
};

class FloodGuard {
 public:
  static constexpr double kMargin = 3.0;
  static constexpr double kDepth_s = 0.05;
  static constexpr double kLeastDepth = 3.0;  // frames

  enum class Answer : std::uint8_t { kPass, kFlood, kUnlisted };

  explicit FloodGuard(const std::vector<NominalRate>& rates) {
    for (const NominalRate& rate : rates) {
      assert(rate.id < kIdCount && rate.rate_hz > 0.0);
      const double rate_hz = kMargin * rate.rate_hz;
      Bucket& bucket = buckets_[rate.id];
      bucket.interval = std::max(Duration(1), duration_from_seconds(1.0 / rate_hz));
      bucket.slack =
          duration_from_seconds((std::max(kLeastDepth, rate_hz * kDepth_s) - 1.0) / rate_hz);
    }
  }

  [[nodiscard]] Answer accept(std::uint16_t id, Time stamp) {
    Bucket& bucket = buckets_[id % kIdCount];
    if (bucket.interval == Duration(0)) {
      return Answer::kUnlisted;
    }
    const Duration ahead = bucket.expected - stamp;
    if (ahead > bucket.slack && ahead <= bucket.slack + bucket.interval) {
      return Answer::kFlood;
    }
    // Further ahead than a bucket can be: the clock was set back.
    const bool is_empty = ahead < Duration(0) || ahead > bucket.slack;
    bucket.expected = (is_empty ? stamp : bucket.expected) + bucket.interval;
    return Answer::kPass;
  }

 private:
  struct Bucket {
    Duration interval{0};
    Duration slack{0};
    Time expected{};
  };
  std::array<Bucket, kIdCount> buckets_{};
};

}  // namespace understory::can
