// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Between the core's types and messages. Metres, radians, ENU. Times: a Time is ROS time in whole
// microseconds since 1970. From messages of others nothing is taken on trust: what does not fit is
// no value.
#pragma once

#include <optional>
#include <string>

#include <nav_msgs/Odometry.h>
#include <ros/time.h>
#include <sensor_msgs/CameraInfo.h>
#include <understory_msgs/FlightStatus.h>
#include <understory_msgs/MissionStatus.h>

#include "understory/bridge/flight_loop.hpp"
#include "understory/mission_status.hpp"

namespace understory {

[[nodiscard]] Time to_time(const ros::Time& time);
[[nodiscard]] ros::Time to_ros(Time time);

[[nodiscard]] geometry_msgs::Point to_point(const Vector3d& vector);
[[nodiscard]] Vector3d to_vector(const geometry_msgs::Point& point);

// Twist in the body frame, as nav_msgs/Odometry has it.
// Without what only the flight loop knows: header, real_time, lost_ticks.
[[nodiscard]] understory_msgs::FlightStatus to_msg(const FlightTick& tick);
[[nodiscard]] nav_msgs::Odometry to_odometry(const Telemetry& telemetry,
                                             const std::string& map_frame,
                                             const std::string& body_frame);
// Nothing if it is not finite or its rotation is none.
[[nodiscard]] std::optional<VehicleState> to_vehicle_state(const nav_msgs::Odometry& odometry);

[[nodiscard]] understory_msgs::MissionStatus to_msg(const MissionStatus& status);
// Nothing if an enumerator is unknown.
[[nodiscard]] std::optional<MissionStatus> from_msg(const understory_msgs::MissionStatus& msg);

[[nodiscard]] sensor_msgs::CameraInfo to_camera_info(const CameraModel& camera);
// Nothing if it is not a calibrated pinhole camera.
[[nodiscard]] std::optional<CameraModel> to_camera_model(const sensor_msgs::CameraInfo& info,
                                                         double max_range_m);

}  // namespace understory
