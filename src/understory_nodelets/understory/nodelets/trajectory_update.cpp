// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/nodelets/trajectory_update.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

#include "understory/nodelets/conversions.hpp"

namespace understory {
namespace {

constexpr std::size_t kLeastControlPoints = 4;

bool is_positive(double value) {
  return std::isfinite(value) && value > 0.0;
}

bool makes_sense(const Trajectory& trajectory) {
  const auto is_finite_point = [](const Vector3d& point) { return point.allFinite(); };
  const auto is_finite_angle = [](double angle) { return std::isfinite(angle); };
  const std::vector<Vector3d>& points = trajectory.position.control_points;
  const std::vector<double>& angles = trajectory.yaw.control_points;
  return points.size() >= kLeastControlPoints && angles.size() >= kLeastControlPoints &&
         is_positive(trajectory.position.knot_s) && is_positive(trajectory.yaw.knot_s) &&
         std::all_of(points.begin(), points.end(), is_finite_point) &&
         std::all_of(angles.begin(), angles.end(), is_finite_angle);
}

}  // namespace

understory_msgs::Trajectory to_msg(const TrajectoryUpdate& update) {
  const Trajectory& trajectory = *update.trajectory;
  understory_msgs::Trajectory msg;
  msg.header = update.header;
  msg.id = trajectory.id;
  msg.mode = static_cast<std::uint8_t>(trajectory.mode);
  for (const Vector3d& point : trajectory.position.control_points) {
    msg.position_control_points.push_back(to_point(point));
  }
  msg.position_knot_s = trajectory.position.knot_s;
  msg.yaw_control_points = trajectory.yaw.control_points;
  msg.yaw_knot_s = trajectory.yaw.knot_s;
  msg.max_speed_mps = trajectory.limits.speed_mps;
  msg.max_acceleration_mps2 = trajectory.limits.acceleration_mps2;
  msg.max_yaw_rate_radps = trajectory.limits.yaw_rate_radps;
  msg.max_yaw_acceleration_radps2 = trajectory.limits.yaw_acceleration_radps2;
  msg.depth_stamp = to_ros(trajectory.depth_stamp);
  return msg;
}

TrajectoryPtr from_msg(const understory_msgs::Trajectory& msg) {
  if (msg.mode > understory_msgs::Trajectory::BRAKE) {
    return nullptr;
  }
  auto trajectory = std::make_shared<Trajectory>();
  trajectory->id = msg.id;
  trajectory->start = to_time(msg.header.stamp);
  trajectory->mode = static_cast<FlightMode>(msg.mode);
  for (const geometry_msgs::Point& point : msg.position_control_points) {
    trajectory->position.control_points.push_back(to_vector(point));
  }
  trajectory->position.knot_s = msg.position_knot_s;
  trajectory->yaw.control_points = msg.yaw_control_points;
  trajectory->yaw.knot_s = msg.yaw_knot_s;
  trajectory->limits = {msg.max_speed_mps,
                        msg.max_acceleration_mps2,
                        msg.max_yaw_rate_radps,
                        msg.max_yaw_acceleration_radps2};
  trajectory->depth_stamp = to_time(msg.depth_stamp);
  return makes_sense(*trajectory) ? trajectory : nullptr;
}

}  // namespace understory
