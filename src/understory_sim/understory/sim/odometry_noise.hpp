// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Where the vehicle takes itself to be: the truth, displaced and turned about the vertical by
// errors that come and go (Ornstein-Uhlenbeck). It begins without any. World ENU, SI units. The
// same configuration, Rng state and steps give the same errors; nothing can fail.
#pragma once

#include "understory/autopilot/control_law.hpp"
#include "understory/base/config.hpp"
#include "understory/base/rng.hpp"

namespace understory {

struct OdometryNoiseConfig {
  double position_deviation_m = 0.0;
  double yaw_deviation_rad = 0.0;
  double time_s = 20.0;

  void visit(FieldVisitor& f) {
    f.field("position_deviation_m",
            position_deviation_m,
            in_range(0.0, 1.0),
            "standard deviation of the error on each axis");
    f.field("yaw_deviation_rad",
            yaw_deviation_rad,
            in_range(0.0, 0.5),
            "standard deviation of the error about the vertical");
    f.field("time_s", time_s, in_range(0.1, 1000.0), "correlation time of both");
  }
};

class OdometryNoise {
 public:
  // `rng`: its own stream.
  OdometryNoise(const OdometryNoiseConfig& config, const Rng& rng) : config_(config), rng_(rng) {}

  void step(double step_s);
  [[nodiscard]] VehicleState measured(const VehicleState& truth) const;

 private:
  OdometryNoiseConfig config_;
  Rng rng_;
  Vector3d offset_m_ = Vector3d::Zero();
  double turn_rad_ = 0.0;
};

}  // namespace understory
