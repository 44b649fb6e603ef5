// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/odometry_noise.hpp"

#include <cmath>

namespace understory {

void OdometryNoise::step(double step_s) {
  if (config_.position_deviation_m <= 0.0 && config_.yaw_deviation_rad <= 0.0) {
    return;
  }
  const double keep = std::exp(-step_s / config_.time_s);
  const double kick = std::sqrt(1.0 - keep * keep);
  for (double& error_m : offset_m_) {
    error_m = keep * error_m + kick * config_.position_deviation_m * rng_.normal();
  }
  turn_rad_ = keep * turn_rad_ + kick * config_.yaw_deviation_rad * rng_.normal();
}

VehicleState OdometryNoise::measured(const VehicleState& truth) const {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(turn_rad_, Vector3d::UnitZ()));
  VehicleState state = truth;
  state.position_m += offset_m_;
  state.velocity_mps = turn * truth.velocity_mps;
  state.world_from_body = turn * truth.world_from_body;
  return state;
}

}  // namespace understory
