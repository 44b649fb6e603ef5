// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/link/wire_sets.hpp"

#include <cmath>

namespace understory::can {
namespace {

constexpr double kStraightUp = 1e-5;  // cosine of the pitch: less than a step of the scale

template <class... Parts>
std::optional<FrameSet> encode_all(std::uint8_t counter, const Parts&... parts) {
  FrameSet frames;
  std::size_t i = 0;
  bool is_good = true;
  const auto add = [&](const auto& part) {
    const std::optional<Frame> frame = encode(part, counter);
    is_good = is_good && frame.has_value();
    frames[i++] = frame.value_or(Frame{});
  };
  (add(parts), ...);
  return is_good ? std::optional<FrameSet>(frames) : std::nullopt;
}

double wrapped(double angle_rad) {
  return std::remainder(angle_rad, 2.0 * M_PI);
}

bool is_finite(const Setpoint& setpoint) {
  return setpoint.position_m.allFinite() && setpoint.velocity_mps.allFinite() &&
         setpoint.acceleration_mps2.allFinite() && std::isfinite(setpoint.yaw_rad) &&
         std::isfinite(setpoint.yaw_rate_radps);
}

bool is_finite(const VehicleState& state) {
  return state.position_m.allFinite() && state.velocity_mps.allFinite() &&
         state.world_from_body.coeffs().allFinite() && state.body_rates_radps.allFinite();
}

Eigen::Quaterniond world_from_body(const Vector3d& roll_pitch_yaw_rad) {
  return Eigen::AngleAxisd(roll_pitch_yaw_rad.z(), Vector3d::UnitZ()) *
         Eigen::AngleAxisd(roll_pitch_yaw_rad.y(), Vector3d::UnitY()) *
         Eigen::AngleAxisd(roll_pitch_yaw_rad.x(), Vector3d::UnitX());
}

Vector3d roll_pitch_yaw_rad(const Eigen::Quaterniond& world_from_body) {
  const Eigen::Matrix3d r = world_from_body.toRotationMatrix();
  const double level = std::hypot(r(2, 1), r(2, 2));
  const double pitch_rad = std::atan2(-r(2, 0), level);
  // Straight up or down roll and yaw turn about the same axis, and all of it is told as yaw.
  if (level < kStraightUp) {
    return {0.0, pitch_rad, std::atan2(-r(0, 1), r(1, 1))};
  }
  return {std::atan2(r(2, 1), r(2, 2)), pitch_rad, std::atan2(r(1, 0), r(0, 0))};
}

}  // namespace

std::optional<FrameSet> encode_setpoint(const WireSetpoint& wire, std::uint8_t counter) {
  const Setpoint& setpoint = wire.setpoint;
  if (!is_finite(setpoint)) {
    return std::nullopt;  // NaN would be sent as "not available"
  }
  SpPosXy xy;
  xy.sp_xy_frame = wire.frame;
  xy.sp_x_m = setpoint.position_m.x();
  xy.sp_y_m = setpoint.position_m.y();
  SpPosZ z;
  z.sp_z_m = setpoint.position_m.z();
  z.sp_time_us = wire.time_wire_us;
  SpVel velocity;
  velocity.sp_vx_mps = setpoint.velocity_mps.x();
  velocity.sp_vy_mps = setpoint.velocity_mps.y();
  velocity.sp_vz_mps = setpoint.velocity_mps.z();
  SpAcc acceleration;
  acceleration.sp_ax_mps2 = setpoint.acceleration_mps2.x();
  acceleration.sp_ay_mps2 = setpoint.acceleration_mps2.y();
  acceleration.sp_az_mps2 = setpoint.acceleration_mps2.z();
  SpCommit commit;
  commit.sp_mode = wire.mode;
  commit.sp_yaw_rad = wrapped(setpoint.yaw_rad);
  commit.sp_yaw_rate_radps = setpoint.yaw_rate_radps;
  commit.sp_mask = wire.mask;
  commit.sp_seq = wire.seq;
  return encode_all(counter, xy, z, velocity, acceleration, commit);
}

std::optional<WireSetpoint> SetpointReceiver::setpoint() const {
  const auto& [xy, z, velocity, acceleration, commit] = parts();
  WireSetpoint wire;
  wire.setpoint.position_m = {xy.sp_x_m, xy.sp_y_m, z.sp_z_m};
  wire.setpoint.velocity_mps = {velocity.sp_vx_mps, velocity.sp_vy_mps, velocity.sp_vz_mps};
  wire.setpoint.acceleration_mps2 = {
      acceleration.sp_ax_mps2, acceleration.sp_ay_mps2, acceleration.sp_az_mps2};
  wire.setpoint.yaw_rad = commit.sp_yaw_rad;
  wire.setpoint.yaw_rate_radps = commit.sp_yaw_rate_radps;
  wire.mode = commit.sp_mode;
  wire.mask = commit.sp_mask;
  wire.frame = xy.sp_xy_frame;
  wire.seq = static_cast<std::uint8_t>(commit.sp_seq);
  wire.time_wire_us = z.sp_time_us;
  return is_finite(wire.setpoint) ? std::optional(wire) : std::nullopt;
}

std::optional<FrameSet> encode_odometry(const WireOdometry& wire, std::uint8_t counter) {
  const VehicleState& state = wire.state;
  if (!is_finite(state)) {
    return std::nullopt;
  }
  OdoPosXy xy;
  xy.odo_x_m = state.position_m.x();
  xy.odo_y_m = state.position_m.y();
  OdoPosZ z;
  z.odo_z_m = state.position_m.z();
  z.odo_time_us = wire.time_wire_us;
  OdoVel velocity;
  velocity.odo_vx_mps = state.velocity_mps.x();
  velocity.odo_vy_mps = state.velocity_mps.y();
  velocity.odo_vz_mps = state.velocity_mps.z();
  const Vector3d angles_rad = roll_pitch_yaw_rad(state.world_from_body);
  OdoAtt attitude;
  attitude.odo_roll_rad = angles_rad.x();
  attitude.odo_pitch_rad = angles_rad.y();
  attitude.odo_yaw_rad = angles_rad.z();
  OdoRate rate;
  rate.odo_quality = wire.quality;
  rate.odo_p_radps = state.body_rates_radps.x();
  rate.odo_q_radps = state.body_rates_radps.y();
  rate.odo_r_radps = state.body_rates_radps.z();
  return encode_all(counter, xy, z, velocity, attitude, rate);
}

std::optional<WireOdometry> OdometryReceiver::odometry() const {
  const auto& [xy, z, velocity, attitude, rate] = parts();
  WireOdometry wire;
  wire.state.position_m = {xy.odo_x_m, xy.odo_y_m, z.odo_z_m};
  wire.state.velocity_mps = {velocity.odo_vx_mps, velocity.odo_vy_mps, velocity.odo_vz_mps};
  wire.state.world_from_body =
      world_from_body({attitude.odo_roll_rad, attitude.odo_pitch_rad, attitude.odo_yaw_rad});
  wire.state.body_rates_radps = {rate.odo_p_radps, rate.odo_q_radps, rate.odo_r_radps};
  wire.quality = rate.odo_quality;
  wire.time_wire_us = z.odo_time_us;
  return is_finite(wire.state) ? std::optional(wire) : std::nullopt;
}

}  // namespace understory::can
