// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/autopilot/control_law.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace understory {
namespace {

constexpr double kGravityMps2 = 9.81;
// Of the upward thrust: below this the direction of thrust is lost, and with it the attitude.
constexpr double kMinLiftMps2 = 2.0;
constexpr double kMaxThrustShare = 0.9;  // the rest is left for torque
// Landed: the descent has run this far ahead of a vehicle that stands still for this long.
constexpr double kContactLeadM = 0.10;
constexpr double kContactSpeedMps = 0.05;
constexpr double kContactTimeS = 0.3;

constexpr std::array<double, 4> kForward = {1.0, 1.0, -1.0, -1.0};
constexpr std::array<double, 4> kLeft = {1.0, -1.0, -1.0, 1.0};
constexpr std::array<double, 4> kTurnLeft = {1.0, -1.0, 1.0, -1.0};

bool is_finite(const VehicleState& state) {
  return state.position_m.allFinite() && state.velocity_mps.allFinite() &&
         state.world_from_body.coeffs().allFinite() && state.body_rates_radps.allFinite() &&
         state.world_from_body.squaredNorm() > 0.5;
}

bool is_finite(const Setpoint& setpoint) {
  return setpoint.position_m.allFinite() && setpoint.velocity_mps.allFinite() &&
         setpoint.acceleration_mps2.allFinite() && std::isfinite(setpoint.yaw_rad) &&
         std::isfinite(setpoint.yaw_rate_radps);
}

Setpoint at_rest(Setpoint setpoint) {
  setpoint.velocity_mps.setZero();
  setpoint.acceleration_mps2.setZero();
  setpoint.yaw_rate_radps = 0.0;
  return setpoint;
}

Vector3d limited(const Vector3d& vector, double max_norm) {
  const double norm = vector.norm();
  return norm > max_norm ? Vector3d(vector * (max_norm / norm)) : vector;
}

}  // namespace

const char* to_string(ControlMode mode) {
  switch (mode) {
    case ControlMode::kIdle:
      return "idle";
    case ControlMode::kTrack:
      return "track";
    case ControlMode::kLand:
      return "land";
  }
  return "unknown";
}

Setpoint extrapolated(const Setpoint& setpoint, double age_s) {
  Setpoint now = setpoint;
  now.position_m += age_s * (setpoint.velocity_mps + 0.5 * age_s * setpoint.acceleration_mps2);
  now.velocity_mps += age_s * setpoint.acceleration_mps2;
  now.yaw_rad += age_s * setpoint.yaw_rate_radps;
  return now;
}

ControlLaw::ControlLaw(const AirframeConfig& airframe, const ControlConfig& config)
    : airframe_(airframe),
      config_(config),
      inertia_kgm2_(airframe.inertia_xx_kgm2, airframe.inertia_yy_kgm2, airframe.inertia_zz_kgm2) {
  const double lift_n = 4.0 * airframe.max_motor_thrust_n * kMaxThrustShare;
  if (!(lift_n > 1.3 * kMaxThrustShare * airframe.mass_kg * kGravityMps2)) {
    throw ConfigError(
        "airframe: max_motor_thrust_n: four motors must lift at least 1.3 times "
        "the weight");
  }
}

void ControlLaw::set_mode(ControlMode mode) {
  if (mode == mode_) {
    return;
  }
  // Coming from rest on the ground, what was summed in an earlier flight no longer holds.
  if (mode_ == ControlMode::kIdle) {
    integral_mps2_.setZero();
  }
  jerk_.primed = false;
  rate_change_.primed = false;
  landing_started_ = false;
  still_on_ground_s_ = 0.0;
  mode_ = mode;
}

MotorCommands ControlLaw::update(const VehicleState& state,
                                 const Setpoint& setpoint,
                                 double step_s) {
  assert(step_s > 0.0 && step_s <= 0.02);
  if (is_finite(state)) {
    last_state_ = state;
  } else {
    ++rejected_inputs_;
    last_state_.velocity_mps.setZero();
    last_state_.body_rates_radps.setZero();
  }
  if (mode_ == ControlMode::kLand) {
    last_setpoint_ = landing_setpoint(last_state_, step_s);
  } else if (is_finite(setpoint)) {
    last_setpoint_ = setpoint;
  } else if (mode_ == ControlMode::kTrack) {
    ++rejected_inputs_;
    last_setpoint_ = at_rest(last_setpoint_);
  }
  if (mode_ == ControlMode::kIdle) {
    return {};
  }
  const Attitude wanted = wanted_attitude(last_state_, last_setpoint_, step_s);
  return mix(wanted.thrust_n, torque_nm(last_state_, wanted));
}

Setpoint ControlLaw::landing_setpoint(const VehicleState& state, double step_s) {
  Setpoint wanted = last_setpoint_;
  if (!landing_started_) {
    landing_started_ = true;
    wanted = Setpoint{};
    wanted.position_m = state.position_m;
    wanted.yaw_rad = yaw_of(state.world_from_body);
  }
  wanted.velocity_mps = Vector3d(0.0, 0.0, -config_.landing_rate_mps);
  wanted.position_m.z() -= config_.landing_rate_mps * step_s;
  const bool still = state.position_m.z() - wanted.position_m.z() > kContactLeadM &&
                     std::abs(state.velocity_mps.z()) < kContactSpeedMps;
  still_on_ground_s_ = still ? still_on_ground_s_ + step_s : 0.0;
  if (still_on_ground_s_ > kContactTimeS) {
    set_mode(ControlMode::kIdle);
  }
  return wanted;
}

Vector3d ControlLaw::wanted_thrust_mps2(const VehicleState& state,
                                        const Setpoint& setpoint,
                                        double step_s) {
  const Vector3d position_error_m = setpoint.position_m - state.position_m;
  const Vector3d velocity_error_mps = setpoint.velocity_mps - state.velocity_mps;
  const Vector3d& velocity_mps = setpoint.velocity_mps;
  const Vector3d rotor_drag_kgps(
      airframe_.rotor_drag_xy_kgps, airframe_.rotor_drag_xy_kgps, airframe_.rotor_drag_z_kgps);
  const Vector3d drag_n = rotor_drag_kgps.cwiseProduct(velocity_mps) +
                          airframe_.body_drag_kgpm * velocity_mps.norm() * velocity_mps;

  Vector3d thrust_mps2 = setpoint.acceleration_mps2 + drag_n / airframe_.mass_kg + integral_mps2_ +
                         config_.position_gain_per_s2 * position_error_m +
                         config_.velocity_gain_per_s * velocity_error_mps;
  thrust_mps2.z() += kGravityMps2;

  const double max_thrust_mps2 =
      kMaxThrustShare * 4.0 * airframe_.max_motor_thrust_n / airframe_.mass_kg;
  const double lift_mps2 = std::clamp(thrust_mps2.z(), kMinLiftMps2, max_thrust_mps2);
  const double max_side_mps2 = lift_mps2 * std::tan(config_.max_tilt_rad);
  const Vector3d side_mps2(thrust_mps2.x(), thrust_mps2.y(), 0.0);
  const bool saturated = lift_mps2 != thrust_mps2.z() || side_mps2.norm() > max_side_mps2;
  // Anti-windup: what cannot be carried out is not summed.
  if (!saturated) {
    integral_mps2_ += config_.integral_gain_per_s3 * step_s * position_error_m;
    const Vector3d side =
        limited({integral_mps2_.x(), integral_mps2_.y(), 0.0}, config_.max_integral_mps2);
    integral_mps2_.head<2>() = side.head<2>();
    integral_mps2_.z() =
        std::clamp(integral_mps2_.z(), -config_.max_integral_mps2, config_.max_integral_mps2);
  }
  return limited(side_mps2, max_side_mps2) + Vector3d(0.0, 0.0, lift_mps2);
}

ControlLaw::Attitude ControlLaw::wanted_attitude(const VehicleState& state,
                                                 const Setpoint& setpoint,
                                                 double step_s) {
  const double filter_s = config_.feed_forward_filter_s;
  const Vector3d jerk_mps3 = jerk_.update(setpoint.acceleration_mps2, filter_s, step_s);
  const Vector3d thrust_mps2 = wanted_thrust_mps2(state, setpoint, step_s);
  const double size_mps2 = thrust_mps2.norm();
  const Vector3d up = thrust_mps2 / size_mps2;
  const Vector3d heading(std::cos(setpoint.yaw_rad), std::sin(setpoint.yaw_rad), 0.0);
  // Lee's projection of the heading turns the vehicle when it leans both ways at once (0.03 rad at
  // 2 m/s2); leaning the heading towards the thrust axis within its own vertical plane does not.
  const Vector3d forward = (heading - Vector3d(0.0, 0.0, heading.dot(up) / up.z())).normalized();
  const Vector3d left = up.cross(forward);

  Attitude wanted;
  wanted.world_from_desired << forward, left, up;
  // As Lee et al. have it: the wanted force projected on the thrust axis that there is now.
  wanted.thrust_n = airframe_.mass_kg * thrust_mps2.dot(state.world_from_body * Vector3d::UnitZ());

  // The rates with which the wanted attitude moves come from the setpoint's jerk; those that
  // feedback causes are left out, they would amplify noise.
  const Vector3d up_rate = (jerk_mps3 - up * up.dot(jerk_mps3)) / size_mps2;
  const Vector3d rates(-left.dot(up_rate), forward.dot(up_rate), setpoint.yaw_rate_radps * up.z());
  wanted.rates_radps = limited(rates, config_.max_feed_forward_rate_radps);
  wanted.acceleration_radps2 = rate_change_.update(wanted.rates_radps, filter_s, step_s);
  return wanted;
}

// Moment of Lee et al., with gains as angular accelerations, so that they do not depend on inertia.
Vector3d ControlLaw::torque_nm(const VehicleState& state, const Attitude& wanted) const {
  const Eigen::Matrix3d world_from_body = state.world_from_body.normalized().toRotationMatrix();
  const Eigen::Matrix3d desired_from_body = wanted.world_from_desired.transpose() * world_from_body;
  const Eigen::Matrix3d twist = desired_from_body - desired_from_body.transpose();
  const Vector3d attitude_error = 0.5 * Vector3d(twist(2, 1), twist(0, 2), twist(1, 0));
  const Vector3d& rates = state.body_rates_radps;
  const Vector3d wanted_rates = desired_from_body.transpose() * wanted.rates_radps;
  const Vector3d wanted_acceleration = desired_from_body.transpose() * wanted.acceleration_radps2;
  const Vector3d gain(config_.tilt_gain_per_s2, config_.tilt_gain_per_s2, config_.yaw_gain_per_s2);
  const Vector3d rate_gain(
      config_.tilt_rate_gain_per_s, config_.tilt_rate_gain_per_s, config_.yaw_rate_gain_per_s);
  const Vector3d angular_acceleration = -gain.cwiseProduct(attitude_error) -
                                        rate_gain.cwiseProduct(rates - wanted_rates) +
                                        wanted_acceleration - rates.cross(wanted_rates);
  return inertia_kgm2_.cwiseProduct(angular_acceleration) +
         rates.cross(inertia_kgm2_.cwiseProduct(rates));
}

// What the motors cannot give is given up in this order: yaw, lift, tilt. But for its tilt the
// vehicle never lifts more than its weight: a tilt that swings would carry it up, less lift would
// be asked for, which takes more tilt for the same push, and so on without end.
MotorCommands ControlLaw::mix(double thrust_n, const Vector3d& torque_nm) const {
  const double max_n = airframe_.max_motor_thrust_n;
  const double lever_m = 4.0 * airframe_.arm_m * std::sqrt(0.5);
  std::array<double, 4> tilt_n{};
  double low_n = 0.0;
  double high_n = 0.0;
  for (std::size_t i = 0; i < 4; ++i) {
    tilt_n[i] = (kLeft[i] * torque_nm.x() - kForward[i] * torque_nm.y()) / lever_m;
    low_n = std::min(low_n, tilt_n[i]);
    high_n = std::max(high_n, tilt_n[i]);
  }
  const double room_below_n = 0.25 * std::max(thrust_n, airframe_.mass_kg * kGravityMps2);
  const double tilt_share = std::min(
      {1.0, max_n / std::max(high_n - low_n, 1e-9), room_below_n / std::max(-low_n, 1e-9)});
  const double least_n = -low_n * tilt_share;
  // With all authority taken by the tilt both bounds are one, up to rounding.
  const double most_n = std::max(least_n, max_n - high_n * tilt_share);
  const double mean_n = std::clamp(0.25 * thrust_n, least_n, most_n);

  const double yaw_n = torque_nm.z() / (4.0 * airframe_.torque_per_thrust_m);
  double yaw_share = 1.0;
  for (std::size_t i = 0; i < 4; ++i) {
    const double base_n = mean_n + tilt_share * tilt_n[i];
    const double change_n = kTurnLeft[i] * yaw_n;
    const double room_n = change_n > 0.0 ? max_n - base_n : base_n;
    yaw_share = std::min(yaw_share, std::max(room_n, 0.0) / std::max(std::abs(change_n), 1e-9));
  }
  MotorCommands commands{};
  for (std::size_t i = 0; i < 4; ++i) {
    const double motor_n = mean_n + tilt_share * tilt_n[i] + yaw_share * kTurnLeft[i] * yaw_n;
    commands[i] = std::clamp(motor_n / max_n, 0.0, 1.0);
  }
  return commands;
}

}  // namespace understory
