// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/plan/trapezoid_profile.hpp"

#include <algorithm>
#include <cmath>

namespace understory {

double stopping_distance(double initial_rate, double acceleration) {
  return initial_rate * std::abs(initial_rate) / (2.0 * acceleration);
}

TrapezoidProfile::TrapezoidProfile(double target, double initial_rate, const RateLimits& limits)
    : target_(target), initial_rate_(initial_rate), phases_{} {
  const double a = limits.acceleration;
  // Seen in the direction in which the target lies from where braking at once would end.
  const double sign = target >= stopping_distance(initial_rate, a) ? 1.0 : -1.0;
  const double distance = sign * target;
  const double rate = sign * initial_rate;
  const double unbounded_peak = std::sqrt(std::max(0.0, a * distance + 0.5 * rate * rate));
  const double peak = std::min(unbounded_peak, limits.rate);
  const double first_s = std::abs(peak - rate) / a;
  const double last_s = peak / a;
  const double covered = 0.5 * (rate + peak) * first_s + 0.5 * peak * last_s;
  const double cruise_s = peak > 0.0 ? std::max(0.0, distance - covered) / peak : 0.0;
  phases_ = {Phase{first_s, sign * std::copysign(a, peak - rate)},
             Phase{cruise_s, 0.0},
             Phase{last_s, -sign * a}};
}

double TrapezoidProfile::position_at(double time_s) const {
  if (time_s >= duration_s()) {
    return target_;
  }
  double position = 0.0;
  double rate = initial_rate_;
  double left_s = std::max(0.0, time_s);
  for (const Phase& phase : phases_) {
    const double t = std::min(left_s, phase.duration_s);
    position += rate * t + 0.5 * phase.acceleration * t * t;
    rate += phase.acceleration * t;
    left_s -= t;
  }
  return position;
}

}  // namespace understory
