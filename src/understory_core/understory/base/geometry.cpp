// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/base/geometry.hpp"

#include <cmath>

namespace understory {

double wrap_angle(double angle_rad) {
  // What std::remainder, which is slow, would return too.
  if (std::abs(angle_rad) < kPi) {
    return angle_rad;
  }
  const double wrapped = std::remainder(angle_rad, 2.0 * kPi);
  return wrapped <= -kPi ? wrapped + 2.0 * kPi : wrapped;
}

double angle_difference(double to_rad, double from_rad) {
  return wrap_angle(to_rad - from_rad);
}

Pose level_pose(const Vector3d& position_m, double yaw_rad) {
  Pose pose = Pose::Identity();
  pose.translation() = position_m;
  pose.linear() = Eigen::AngleAxisd(yaw_rad, Vector3d::UnitZ()).toRotationMatrix();
  return pose;
}

double yaw_of(const Eigen::Quaterniond& world_from_body) {
  const Vector3d forward = world_from_body * Vector3d::UnitX();
  return std::atan2(forward.y(), forward.x());
}

}  // namespace understory
