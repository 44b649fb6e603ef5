// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// The true vehicle: a rigid-body X quadrotor with motor lag, drag, wind and level ground at z = 0.
// World ENU, body FLU, SI units. step() integrates to second order with fixed arithmetic (exact for
// constant forces), so the same commands and seed give the same bytes; steps of 1 or 2 ms. Nothing
// fails in flight; one thread.
#pragma once

#include <array>

#include "understory/autopilot/control_law.hpp"
#include "understory/base/rng.hpp"

namespace understory {

struct WindConfig {
  double mean_x_mps = 0.0;
  double mean_y_mps = 0.0;
  double gust_deviation_mps = 0.0;
  double gust_time_s = 2.0;

  void visit(FieldVisitor& f) {
    f.field("mean_x_mps", mean_x_mps, in_range(-20.0, 20.0), "east, where the wind blows to");
    f.field("mean_y_mps", mean_y_mps, in_range(-20.0, 20.0), "north, where the wind blows to");
    f.field("gust_deviation_mps",
            gust_deviation_mps,
            in_range(0.0, 10.0),
            "standard deviation of gusts on each horizontal axis; a third of it vertically");
    f.field("gust_time_s", gust_time_s, in_range(0.05, 60.0), "correlation time of gusts");
  }
};

struct VehicleConfig {
  AirframeConfig airframe;
  WindConfig wind;
  double gear_height_m = 0.10;

  void visit(FieldVisitor& f) {
    f.section("airframe", airframe, "Mass, motors and drag; the control law uses the same.");
    f.section("wind", wind, "Mean wind and gusts (Ornstein-Uhlenbeck).");
    f.field("gear_height_m",
            gear_height_m,
            in_range(0.0, 2.0),
            "height of the vehicle's centre above the ground when it stands");
  }
};

class Vehicle {
 public:
  // Starts at rest with still motors. `rng` is the wind's own stream.
  Vehicle(const VehicleConfig& config, const Vector3d& position_m, double yaw_rad, const Rng& rng);

  void step(const MotorCommands& commands, double step_s);

  [[nodiscard]] const VehicleState& state() const { return state_; }
  [[nodiscard]] const Vector3d& acceleration_mps2() const { return acceleration_mps2_; }
  [[nodiscard]] const std::array<double, 4>& motor_thrusts_n() const { return thrusts_n_; }
  [[nodiscard]] Vector3d wind_mps() const { return mean_wind_mps_ + gust_mps_; }
  // Or still in the launcher.
  [[nodiscard]] bool on_ground() const { return on_ground_; }
  // Where it starts, until the motors carry it.
  void hang_in_launcher() { is_in_launcher_ = true; }
  // Puts the vehicle into a state in mid-flight with the motors at hover thrust.
  void set_state(const VehicleState& state);

 private:
  void step_gust(double step_s);
  [[nodiscard]] Vector3d force_n(double thrust_n) const;
  void stand(const Vector3d& position_m, double step_s);

  VehicleConfig config_;
  Vector3d inertia_kgm2_;
  Vector3d mean_wind_mps_;
  Rng rng_;

  VehicleState state_;
  Vector3d acceleration_mps2_ = Vector3d::Zero();
  std::array<double, 4> thrusts_n_{};
  Vector3d gust_mps_ = Vector3d::Zero();
  bool on_ground_ = false;
  bool is_in_launcher_ = false;
  Vector3d stood_at_m_ = Vector3d::Zero();  // of use only while on the ground
};

}  // namespace understory
