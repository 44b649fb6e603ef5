// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/nodelets/conversions.hpp"

#include <cmath>

#include <sensor_msgs/distortion_models.h>

namespace understory {
namespace {

constexpr std::int64_t kNanosecondsPerMicrosecond = 1000;
constexpr double kQuaternionTolerance = 0.01;

Vector3d to_vector(const geometry_msgs::Vector3& vector) {
  return {vector.x, vector.y, vector.z};
}

geometry_msgs::Vector3 to_vector3(const Vector3d& vector) {
  geometry_msgs::Vector3 msg;
  msg.x = vector.x();
  msg.y = vector.y();
  msg.z = vector.z();
  return msg;
}

}  // namespace

Time to_time(const ros::Time& time) {
  return Time(Duration(static_cast<std::int64_t>(time.toNSec()) / kNanosecondsPerMicrosecond));
}

ros::Time to_ros(Time time) {
  ros::Time stamp;
  stamp.fromNSec(
      static_cast<std::uint64_t>(time.time_since_epoch().count() * kNanosecondsPerMicrosecond));
  return stamp;
}

geometry_msgs::Point to_point(const Vector3d& vector) {
  geometry_msgs::Point point;
  point.x = vector.x();
  point.y = vector.y();
  point.z = vector.z();
  return point;
}

Vector3d to_vector(const geometry_msgs::Point& point) {
  return {point.x, point.y, point.z};
}

understory_msgs::FlightStatus to_msg(const FlightTick& tick) {
  const Telemetry& telemetry = tick.telemetry;
  const LinkStatus& link = telemetry.link;
  understory_msgs::FlightStatus msg;
  msg.armed = static_cast<std::uint8_t>(telemetry.is_following);
  msg.down = static_cast<std::uint8_t>(telemetry.is_down);
  msg.astray = static_cast<std::uint8_t>(tick.is_astray);
  msg.battery_low = static_cast<std::uint8_t>(telemetry.is_battery_low);
  msg.at_rest = static_cast<std::uint8_t>(tick.is_at_rest);
  msg.trajectory_id = tick.trajectory_id;
  msg.gate_violations = tick.gate_violations;
  msg.skipped_deadlines = tick.skipped_deadlines;
  msg.host_state = can::to_string(link.host);
  msg.problem = can::to_string(link.problem);
  msg.vehicle_state = can::to_string(link.vehicle);
  msg.vehicle_reason = can::to_string(link.reason);
  msg.battery_percent = static_cast<float>(link.battery_percent);
  msg.round_trip_ms = static_cast<float>(1e3 * to_seconds(link.round_trip));
  msg.setpoints_sent = link.sets_sent;
  msg.setpoints_not_flown = link.sets_not_flown;
  msg.odometry_torn = link.sets_torn;
  msg.frames_lost = link.frames_lost;
  msg.frames_wrong = link.frames_wrong;
  msg.tx_full = link.tx_full;
  msg.tx_expired = link.tx_expired;
  msg.bus_reopened = link.bus_reopened;
  msg.sessions = link.sessions;
  return msg;
}

nav_msgs::Odometry to_odometry(const Telemetry& telemetry,
                               const std::string& map_frame,
                               const std::string& body_frame) {
  const VehicleState& state = telemetry.state;
  nav_msgs::Odometry odometry;
  odometry.header.stamp = to_ros(telemetry.time);
  odometry.header.frame_id = map_frame;
  odometry.child_frame_id = body_frame;
  odometry.pose.pose.position = to_point(state.position_m);
  odometry.pose.pose.orientation.w = state.world_from_body.w();
  odometry.pose.pose.orientation.x = state.world_from_body.x();
  odometry.pose.pose.orientation.y = state.world_from_body.y();
  odometry.pose.pose.orientation.z = state.world_from_body.z();
  odometry.twist.twist.linear = to_vector3(state.world_from_body.conjugate() * state.velocity_mps);
  odometry.twist.twist.angular = to_vector3(state.body_rates_radps);
  return odometry;
}

std::optional<VehicleState> to_vehicle_state(const nav_msgs::Odometry& odometry) {
  const geometry_msgs::Quaternion& q = odometry.pose.pose.orientation;
  const Eigen::Quaterniond rotation(q.w, q.x, q.y, q.z);
  VehicleState state;
  state.position_m = to_vector(odometry.pose.pose.position);
  state.body_rates_radps = to_vector(odometry.twist.twist.angular);
  const Vector3d body_velocity_mps = to_vector(odometry.twist.twist.linear);
  // The negated comparison also catches NaN.
  if (!(std::abs(rotation.norm() - 1.0) < kQuaternionTolerance) || !state.position_m.allFinite() ||
      !state.body_rates_radps.allFinite() || !body_velocity_mps.allFinite()) {
    return std::nullopt;
  }
  state.world_from_body = rotation.normalized();
  state.velocity_mps = state.world_from_body * body_velocity_mps;
  return state;
}

understory_msgs::MissionStatus to_msg(const MissionStatus& status) {
  understory_msgs::MissionStatus msg;
  msg.header.stamp = to_ros(status.time);
  msg.state = static_cast<std::uint8_t>(status.state);
  msg.stop_reason = static_cast<std::uint8_t>(status.stop_reason);
  msg.mode = static_cast<std::uint8_t>(status.mode);
  msg.at_rest = static_cast<std::uint8_t>(status.at_rest);
  msg.started_at = to_ros(status.started_at);
  msg.has_explored = static_cast<std::uint8_t>(status.explored_at.has_value());
  msg.explored_at = to_ros(status.explored_at.value_or(Time{}));
  msg.clusters = static_cast<std::uint32_t>(status.clusters);
  msg.trails = static_cast<std::uint32_t>(status.trails);
  msg.dormant = static_cast<std::uint32_t>(status.dormant);
  msg.set_aside = static_cast<std::uint32_t>(status.set_aside);
  msg.has_target = static_cast<std::uint8_t>(status.target_m.has_value());
  msg.target_id = status.target_id.value_or(0);
  msg.target = to_point(status.target_m.value_or(Vector3d::Zero()));
  msg.replans = status.replans;
  for (const auto& [name, value] : status.counters) {
    msg.counter_names.push_back(name);
    msg.counter_values.push_back(value);
  }
  return msg;
}

std::optional<MissionStatus> from_msg(const understory_msgs::MissionStatus& msg) {
  using Msg = understory_msgs::MissionStatus;
  if (msg.state > Msg::MEET || msg.stop_reason > Msg::TRACKING_LOST ||
      msg.mode > static_cast<std::uint8_t>(FlightMode::kBrake) ||
      msg.counter_names.size() != msg.counter_values.size()) {
    return std::nullopt;
  }
  MissionStatus status;
  status.time = to_time(msg.header.stamp);
  status.state = static_cast<MissionState>(msg.state);
  status.stop_reason = static_cast<StopReason>(msg.stop_reason);
  status.mode = static_cast<FlightMode>(msg.mode);
  status.at_rest = msg.at_rest != 0;
  status.started_at = to_time(msg.started_at);
  if (msg.has_explored != 0) {
    status.explored_at = to_time(msg.explored_at);
  }
  status.clusters = msg.clusters;
  status.trails = msg.trails;
  status.dormant = msg.dormant;
  status.set_aside = msg.set_aside;
  if (msg.has_target != 0) {
    status.target_id = msg.target_id;
    status.target_m = to_vector(msg.target);
  }
  status.replans = msg.replans;
  for (std::size_t i = 0; i < msg.counter_names.size(); ++i) {
    status.counters[msg.counter_names[i]] = msg.counter_values[i];
  }
  return status;
}

sensor_msgs::CameraInfo to_camera_info(const CameraModel& camera) {
  sensor_msgs::CameraInfo info;
  info.width = static_cast<std::uint32_t>(camera.width_px);
  info.height = static_cast<std::uint32_t>(camera.height_px);
  info.distortion_model = sensor_msgs::distortion_models::PLUMB_BOB;
  info.D.assign(5, 0.0);
  info.K = {camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0};
  info.R = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
  info.P = {camera.fx, 0.0, camera.cx, 0.0, 0.0, camera.fy, camera.cy, 0.0, 0.0, 0.0, 1.0, 0.0};
  return info;
}

std::optional<CameraModel> to_camera_model(const sensor_msgs::CameraInfo& info,
                                           double max_range_m) {
  // P, because the depth images are rectified ones; K where a driver leaves P empty.
  const bool has_projection = info.P[0] > 0.0;
  CameraModel camera;
  camera.width_px = static_cast<int>(info.width);
  camera.height_px = static_cast<int>(info.height);
  camera.fx = has_projection ? info.P[0] : info.K[0];
  camera.fy = has_projection ? info.P[5] : info.K[4];
  camera.cx = has_projection ? info.P[2] : info.K[2];
  camera.cy = has_projection ? info.P[6] : info.K[5];
  camera.max_range_m = max_range_m;
  constexpr int kMostPixels = 8192;
  const bool is_finite = std::isfinite(camera.fx) && std::isfinite(camera.fy) &&
                         std::isfinite(camera.cx) && std::isfinite(camera.cy);
  if (!is_finite || !(camera.fx > 0.0) || !(camera.fy > 0.0) || camera.width_px <= 0 ||
      camera.height_px <= 0 || camera.width_px > kMostPixels || camera.height_px > kMostPixels) {
    return std::nullopt;
  }
  return camera;
}

}  // namespace understory
