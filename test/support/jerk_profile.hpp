// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Reference motions for control tests: pieces of constant jerk, which is what a cubic B-spline is,
// so tests of the vehicle need no planner. World frame, SI units, exact integration.
#pragma once

#include <algorithm>
#include <vector>

#include "understory/autopilot/control_law.hpp"

namespace understory::test {

struct JerkPiece {
  double duration_s;
  Vector3d jerk_mps3;
};

struct JerkProfile {
  Vector3d start_m = Vector3d(0.0, 0.0, 1.0);
  std::vector<JerkPiece> pieces;

  [[nodiscard]] double duration_s() const {
    double sum_s = 0.0;
    for (const JerkPiece& piece : pieces) {
      sum_s += piece.duration_s;
    }
    return sum_s;
  }

  // Yaw is left at zero.
  [[nodiscard]] Setpoint sample(double time_s) const {
    Setpoint now;
    now.position_m = start_m;
    for (const JerkPiece& piece : pieces) {
      const double step_s = std::clamp(time_s, 0.0, piece.duration_s);
      now = extrapolated(now, step_s);
      now.position_m += step_s * step_s * step_s / 6.0 * piece.jerk_mps3;
      now.velocity_mps += 0.5 * step_s * step_s * piece.jerk_mps3;
      now.acceleration_mps2 += step_s * piece.jerk_mps3;
      time_s -= step_s;
    }
    return now;
  }
};

struct MotionLimits {
  double speed_mps;
  double acceleration_mps2;
  double jerk_mps3;
};

// From rest up to the full speed, one second of it, and back to rest, along `direction`.
inline JerkProfile straight_leg(const MotionLimits& limits, const Vector3d& direction) {
  const double ramp_s = limits.acceleration_mps2 / limits.jerk_mps3;
  const double hold_s = limits.speed_mps / limits.acceleration_mps2 - ramp_s;
  const Vector3d up = limits.jerk_mps3 * direction.normalized();
  const Vector3d none = Vector3d::Zero();
  return {Vector3d(0.0, 0.0, 1.0),
          {{ramp_s, up},
           {hold_s, none},
           {ramp_s, -up},
           {1.0, none},
           {ramp_s, -up},
           {hold_s, none},
           {ramp_s, up}}};
}

// Heading that changes with a bounded rate and acceleration: to the left, to the right, at rest.
class YawProfile {
 public:
  YawProfile(double rate_radps, double acceleration_radps2)
      : full_rate_radps_(rate_radps), acceleration_radps2_(acceleration_radps2) {}

  void step(double time_s, double step_s, Setpoint& setpoint) {
    const double wanted_radps =
        time_s < 2.0 ? full_rate_radps_ : (time_s < 4.0 ? -full_rate_radps_ : 0.0);
    const double change_radps = acceleration_radps2_ * step_s;
    rate_radps_ += std::clamp(wanted_radps - rate_radps_, -change_radps, change_radps);
    yaw_rad_ += rate_radps_ * step_s;
    setpoint.yaw_rad = yaw_rad_;
    setpoint.yaw_rate_radps = rate_radps_;
  }

 private:
  double full_rate_radps_;
  double acceleration_radps2_;
  double yaw_rad_ = 0.0;
  double rate_radps_ = 0.0;
};

}  // namespace understory::test
