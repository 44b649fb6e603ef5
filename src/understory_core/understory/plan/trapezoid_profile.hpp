// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// The fastest one-dimensional motion from a place and rate to rest at a target, with bounded rate
// and acceleration: at most three phases of constant acceleration. Any unit (metres, radians);
// pure. A start above the rate limit is slowed first.
#pragma once

#include <array>

namespace understory {

struct RateLimits {
  double rate;
  double acceleration;
};

class TrapezoidProfile {
 public:
  // From 0 at initial_rate to rest at `target`.
  TrapezoidProfile(double target, double initial_rate, const RateLimits& limits);

  [[nodiscard]] double duration_s() const {
    return phases_[0].duration_s + phases_[1].duration_s + phases_[2].duration_s;
  }
  // Before 0: 0. After the end: exactly the target.
  [[nodiscard]] double position_at(double time_s) const;

 private:
  struct Phase {
    double duration_s;
    double acceleration;
  };
  double target_;
  double initial_rate_;
  std::array<Phase, 3> phases_;
};

// Where the motion ends that brakes at once.
[[nodiscard]] double stopping_distance(double initial_rate, double acceleration);

}  // namespace understory
