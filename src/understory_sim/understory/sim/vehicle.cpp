// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/vehicle.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace understory {
namespace {

constexpr double kGravityMps2 = 9.81;
constexpr double kVerticalGustShare = 1.0 / 3.0;
// The launcher lets go when the motors carry the weight but for this. A hover that asks for exactly
// the weight never carries more.
constexpr double kLauncherShare = 0.05;
constexpr double kSettleTimeS = 0.1;  // in which legs on the ground bring the body level

Eigen::Quaterniond rotation_of(const Vector3d& angle_rad) {
  const double angle = angle_rad.norm();
  // Below this the half-angle series is exact to the last bit.
  const double scale = angle < 1e-6 ? 0.5 : std::sin(0.5 * angle) / angle;
  const Vector3d vector = scale * angle_rad;
  return {std::cos(0.5 * angle), vector.x(), vector.y(), vector.z()};
}

}  // namespace

Vehicle::Vehicle(const VehicleConfig& config,
                 const Vector3d& position_m,
                 double yaw_rad,
                 const Rng& rng)
    : config_(config),
      inertia_kgm2_(config.airframe.inertia_xx_kgm2,
                    config.airframe.inertia_yy_kgm2,
                    config.airframe.inertia_zz_kgm2),
      mean_wind_mps_(config.wind.mean_x_mps, config.wind.mean_y_mps, 0.0),
      rng_(rng) {
  state_.position_m = position_m;
  state_.position_m.z() = std::max(position_m.z(), config.gear_height_m);
  state_.world_from_body = Eigen::AngleAxisd(yaw_rad, Vector3d::UnitZ());
  on_ground_ = state_.position_m.z() <= config.gear_height_m;
  stood_at_m_ = state_.position_m;
}

void Vehicle::set_state(const VehicleState& state) {
  state_ = state;
  on_ground_ = false;
  thrusts_n_.fill(0.25 * config_.airframe.mass_kg * kGravityMps2);
}

void Vehicle::step_gust(double step_s) {
  const WindConfig& wind = config_.wind;
  if (wind.gust_deviation_mps <= 0.0) {
    return;
  }
  // Exact discretisation of the Ornstein-Uhlenbeck process.
  const double keep = std::exp(-step_s / wind.gust_time_s);
  const double kick_mps = wind.gust_deviation_mps * std::sqrt(1.0 - keep * keep);
  for (int axis = 0; axis < 3; ++axis) {
    const double share = axis == 2 ? kVerticalGustShare : 1.0;
    gust_mps_[axis] = keep * gust_mps_[axis] + share * kick_mps * rng_.normal();
  }
}

Vector3d Vehicle::force_n(double thrust_n) const {
  const AirframeConfig& airframe = config_.airframe;
  const Vector3d air_mps = state_.velocity_mps - wind_mps();
  const Vector3d up = state_.world_from_body * Vector3d::UnitZ();
  const double along_mps = up.dot(air_mps);
  const Vector3d rotor_drag_n = airframe.rotor_drag_xy_kgps * (air_mps - along_mps * up) +
                                airframe.rotor_drag_z_kgps * along_mps * up;
  return thrust_n * up - rotor_drag_n - airframe.body_drag_kgpm * air_mps.norm() * air_mps -
         Vector3d(0.0, 0.0, airframe.mass_kg * kGravityMps2);
}

void Vehicle::step(const MotorCommands& commands, double step_s) {
  assert(step_s > 0.0 && step_s <= 0.02);
  step_gust(step_s);

  // Thrust half a step on stands for the whole step: second order.
  const AirframeConfig& airframe = config_.airframe;
  const double lag_s = airframe.motor_time_constant_s;
  const double half_keep = lag_s > 0.0 ? std::exp(-0.5 * step_s / lag_s) : 0.0;
  std::array<double, 4> middle_n{};
  for (std::size_t i = 0; i < 4; ++i) {
    const double target_n = std::clamp(commands[i], 0.0, 1.0) * airframe.max_motor_thrust_n;
    middle_n[i] = target_n + (thrusts_n_[i] - target_n) * half_keep;
    thrusts_n_[i] = target_n + (middle_n[i] - target_n) * half_keep;
  }
  const double lever_m = airframe.arm_m * std::sqrt(0.5);
  const Vector3d torque_nm(
      lever_m * (middle_n[0] - middle_n[1] - middle_n[2] + middle_n[3]),
      -lever_m * (middle_n[0] + middle_n[1] - middle_n[2] - middle_n[3]),
      airframe.torque_per_thrust_m * (middle_n[0] - middle_n[1] + middle_n[2] - middle_n[3]));

  const Vector3d momentum = inertia_kgm2_.cwiseProduct(state_.body_rates_radps);
  const Vector3d angular_acceleration =
      (torque_nm - state_.body_rates_radps.cross(momentum)).cwiseQuotient(inertia_kgm2_);
  const Vector3d middle_rates = state_.body_rates_radps + 0.5 * step_s * angular_acceleration;
  // The force acts with the attitude of mid-step.
  const Eigen::Quaterniond before = state_.world_from_body;
  state_.world_from_body = before * rotation_of(0.5 * step_s * state_.body_rates_radps);
  acceleration_mps2_ =
      force_n(middle_n[0] + middle_n[1] + middle_n[2] + middle_n[3]) / airframe.mass_kg;
  state_.world_from_body = (before * rotation_of(step_s * middle_rates)).normalized();
  state_.body_rates_radps += step_s * angular_acceleration;
  state_.position_m += step_s * (state_.velocity_mps + 0.5 * step_s * acceleration_mps2_);
  state_.velocity_mps += step_s * acceleration_mps2_;

  const bool was_standing = on_ground_ || is_in_launcher_;
  is_in_launcher_ = is_in_launcher_ && acceleration_mps2_.z() <= -kLauncherShare * kGravityMps2;
  const bool is_low = state_.position_m.z() <= config_.gear_height_m;
  on_ground_ = is_in_launcher_ || (is_low && state_.velocity_mps.z() <= 0.0);
  if (on_ground_) {
    const Vector3d on_ground_m(state_.position_m.x(), state_.position_m.y(), config_.gear_height_m);
    stand(was_standing ? stood_at_m_ : on_ground_m, step_s);
  }
}

// Legs neither bounce nor slide, and bring the body level while its heading stays.
void Vehicle::stand(const Vector3d& position_m, double step_s) {
  stood_at_m_ = position_m;
  state_.position_m = stood_at_m_;
  state_.velocity_mps.setZero();
  state_.body_rates_radps.setZero();
  acceleration_mps2_.setZero();
  const Eigen::Quaterniond level(
      Eigen::AngleAxisd(yaw_of(state_.world_from_body), Vector3d::UnitZ()));
  state_.world_from_body =
      state_.world_from_body.slerp(std::min(1.0, step_s / kSettleTimeS), level).normalized();
}

}  // namespace understory
