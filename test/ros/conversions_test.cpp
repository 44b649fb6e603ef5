// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/nodelets/conversions.hpp"

#include <limits>

#include <gtest/gtest.h>

namespace understory {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Telemetry some_telemetry() {
  Telemetry telemetry;
  telemetry.time = Time(std::chrono::microseconds(1700000000123456));
  telemetry.state.position_m = {1.5, -2.5, 0.75};
  telemetry.state.velocity_mps = {0.5, 0.25, -0.125};
  telemetry.state.world_from_body =
      Eigen::AngleAxisd(2.0, Vector3d::UnitZ()) * Eigen::AngleAxisd(0.2, Vector3d::UnitX());
  telemetry.state.body_rates_radps = {0.1, -0.2, 0.3};
  return telemetry;
}

nav_msgs::Odometry some_odometry() {
  return to_odometry(some_telemetry(), "map", "base_link");
}

TEST(Odometry, ComesBackAsTheStateItWasMadeFrom) {
  const Telemetry telemetry = some_telemetry();

  const nav_msgs::Odometry odometry = to_odometry(telemetry, "map", "uav1/base_link");
  const std::optional<VehicleState> state = to_vehicle_state(odometry);

  EXPECT_EQ(odometry.header.frame_id, "map");
  EXPECT_EQ(odometry.child_frame_id, "uav1/base_link");
  EXPECT_EQ(to_time(odometry.header.stamp), telemetry.time);
  ASSERT_TRUE(state);
  EXPECT_EQ(state->position_m, telemetry.state.position_m);
  EXPECT_TRUE(state->velocity_mps.isApprox(telemetry.state.velocity_mps, 1e-12));
  EXPECT_TRUE(state->world_from_body.isApprox(telemetry.state.world_from_body, 1e-12));
  EXPECT_EQ(state->body_rates_radps, telemetry.state.body_rates_radps);
}

TEST(Odometry, HasItsTwistInTheBodyFrame) {
  Telemetry telemetry;
  telemetry.state.velocity_mps = {1.0, 0.0, 0.0};
  telemetry.state.world_from_body = Eigen::AngleAxisd(M_PI / 2.0, Vector3d::UnitZ());

  const geometry_msgs::Vector3 twist = to_odometry(telemetry, "m", "b").twist.twist.linear;

  EXPECT_NEAR(twist.x, 0.0, 1e-12);
  EXPECT_NEAR(twist.y, -1.0, 1e-12);
}

TEST(Odometry, WithABadQuaternionIsRefused) {
  nav_msgs::Odometry odometry = some_odometry();
  odometry.pose.pose.orientation = geometry_msgs::Quaternion();  // zeros, as nobody filled it
  EXPECT_FALSE(to_vehicle_state(odometry));
  odometry.pose.pose.orientation.w = 1.1;
  EXPECT_FALSE(to_vehicle_state(odometry));
  odometry.pose.pose.orientation.w = kNan;
  EXPECT_FALSE(to_vehicle_state(odometry));
}

TEST(Odometry, WithoutFiniteNumbersIsRefused) {
  nav_msgs::Odometry odometry = some_odometry();
  odometry.pose.pose.position.z = kNan;
  EXPECT_FALSE(to_vehicle_state(odometry));
  odometry = some_odometry();
  odometry.twist.twist.linear.x = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(to_vehicle_state(odometry));
  odometry = some_odometry();
  odometry.twist.twist.angular.y = kNan;
  EXPECT_FALSE(to_vehicle_state(odometry));
}

TEST(Stamp, KeepsWholeMicroseconds) {
  const Time time(std::chrono::microseconds(1700000000999999));

  EXPECT_EQ(to_ros(time).toNSec(), 1700000000999999000U);
  EXPECT_EQ(to_time(to_ros(time)), time);
}

CameraModel some_camera() {
  CameraConfig config;
  config.width_px = 640;
  config.height_px = 480;
  return CameraModel(config);
}

TEST(CameraInfo, ComesBackAsTheCameraItWasMadeFrom) {
  const CameraModel camera = some_camera();

  const std::optional<CameraModel> back = to_camera_model(to_camera_info(camera), 4.5);

  ASSERT_TRUE(back);
  EXPECT_EQ(back->width_px, 640);
  EXPECT_EQ(back->height_px, 480);
  EXPECT_EQ(back->fx, camera.fx);
  EXPECT_EQ(back->fy, camera.fy);
  EXPECT_EQ(back->cx, camera.cx);
  EXPECT_EQ(back->cy, camera.cy);
  EXPECT_EQ(back->max_range_m, 4.5);
}

TEST(CameraInfo, WithoutProjectionMatrixIsTakenFromK) {
  sensor_msgs::CameraInfo info = to_camera_info(some_camera());
  info.P.fill(0.0);

  const std::optional<CameraModel> camera = to_camera_model(info, 4.5);

  ASSERT_TRUE(camera);
  EXPECT_EQ(camera->fx, some_camera().fx);
  EXPECT_EQ(camera->cy, some_camera().cy);
}

TEST(CameraInfo, OfNoCameraIsRefused) {
  sensor_msgs::CameraInfo info = to_camera_info(some_camera());
  info.P[0] = info.K[0] = 0.0;  // as uncalibrated drivers send it
  EXPECT_FALSE(to_camera_model(info, 4.5));
  info = to_camera_info(some_camera());
  info.P[5] = 0.0;
  EXPECT_FALSE(to_camera_model(info, 4.5));
  info.P[5] = kNan;
  EXPECT_FALSE(to_camera_model(info, 4.5));
  info = to_camera_info(some_camera());
  info.width = 0;
  EXPECT_FALSE(to_camera_model(info, 4.5));
  info.width = 1U << 31U;
  EXPECT_FALSE(to_camera_model(info, 4.5));
  EXPECT_FALSE(to_camera_model(sensor_msgs::CameraInfo(), 4.5));
}

TEST(MissionStatusMessage, ComesBackAsItWas) {
  MissionStatus status;
  status.time = Time(std::chrono::microseconds(1700000000123456));
  status.state = MissionState::kExplore;
  status.mode = FlightMode::kCollector;
  status.at_rest = false;
  status.clusters = 12;
  status.target_id = 3;
  status.target_m = Vector3d(1.0, 2.0, 3.0);
  status.counters["kept"] = 5;

  const std::optional<MissionStatus> back = from_msg(to_msg(status));

  ASSERT_TRUE(back);
  EXPECT_EQ(back->time, status.time);
  EXPECT_EQ(back->state, status.state);
  EXPECT_EQ(back->mode, status.mode);
  EXPECT_EQ(back->at_rest, status.at_rest);
  EXPECT_FALSE(back->explored_at);
  EXPECT_EQ(back->clusters, status.clusters);
  EXPECT_EQ(back->target_id, status.target_id);
  EXPECT_EQ(back->target_m, status.target_m);
  EXPECT_EQ(back->counters, status.counters);
}

TEST(MissionStatusMessage, WithUnknownEnumeratorsIsRefused) {
  const understory_msgs::MissionStatus good = to_msg(MissionStatus());
  understory_msgs::MissionStatus msg = good;
  msg.state = understory_msgs::MissionStatus::MEET + 1;
  EXPECT_FALSE(from_msg(msg));
  msg = good;
  msg.stop_reason = understory_msgs::MissionStatus::TRACKING_LOST + 1;
  EXPECT_FALSE(from_msg(msg));
  msg = good;
  msg.mode = 4;
  EXPECT_FALSE(from_msg(msg));
  msg = good;
  msg.counter_names.push_back("without value");
  EXPECT_FALSE(from_msg(msg));
}

}  // namespace
}  // namespace understory
