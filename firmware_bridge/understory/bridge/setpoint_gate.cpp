// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/bridge/setpoint_gate.hpp"

#include <algorithm>
#include <cmath>

namespace understory {

SetpointGate::SetpointGate(const GateConfig& config, const Box3d& box_m)
    : config_(config),
      fence_m_(box_m.min() - Vector3d::Constant(config.fence_margin_m),
               box_m.max() + Vector3d::Constant(config.fence_margin_m)) {}

bool SetpointGate::is_acceptable(const Setpoint& setpoint, Time now) const {
  const bool is_finite = setpoint.position_m.allFinite() && setpoint.velocity_mps.allFinite() &&
                         setpoint.acceleration_mps2.allFinite() &&
                         std::isfinite(setpoint.yaw_rad) && std::isfinite(setpoint.yaw_rate_radps);
  if (!is_finite || !fence_m_.contains(setpoint.position_m) ||
      setpoint.velocity_mps.norm() > config_.max_speed_mps ||
      setpoint.acceleration_mps2.norm() > config_.max_acceleration_mps2) {
    return false;
  }
  if (!last_) {
    return true;
  }
  // At most a second: after a longer silence nothing explains a jump any more.
  const double elapsed_s = std::clamp(to_seconds(now - last_time_), 0.0, 1.0);
  const double step_m = (setpoint.position_m - last_->position_m).norm();
  return step_m <= config_.max_step_m + config_.max_speed_mps * elapsed_s;
}

std::optional<Setpoint> SetpointGate::pass(const Setpoint& setpoint, Time now) {
  if (is_acceptable(setpoint, now)) {
    last_ = setpoint;
    last_time_ = now;
    return setpoint;
  }
  ++violations_;
  last_time_ = now;  // holding on explains no jump either
  if (last_) {
    last_->velocity_mps.setZero();
    last_->acceleration_mps2.setZero();
    last_->yaw_rate_radps = 0.0;
  }
  return last_;
}

}  // namespace understory
