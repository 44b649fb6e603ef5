// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// The autopilot's control law: geometric tracking control on SE(3) (Lee, Leok, McClamroch 2010)
// from setpoint and state to four motor commands. The same code flies in the lockstep simulator
// and in the autopilot stand-in on the bus. World ENU, body FLU, SI units. Call at 500 Hz or more.
// No allocation, no exception in update(); one thread.
#pragma once

#include <array>
#include <cstdint>

#include "understory/base/config.hpp"
#include "understory/base/geometry.hpp"

namespace understory {

struct VehicleState {
  Vector3d position_m = Vector3d::Zero();
  Vector3d velocity_mps = Vector3d::Zero();
  Eigen::Quaterniond world_from_body = Eigen::Quaterniond::Identity();
  Vector3d body_rates_radps = Vector3d::Zero();
};

struct Setpoint {
  Vector3d position_m = Vector3d::Zero();
  Vector3d velocity_mps = Vector3d::Zero();
  Vector3d acceleration_mps2 = Vector3d::Zero();
  double yaw_rad = 0.0;
  double yaw_rate_radps = 0.0;
};

// What a setpoint of this age asks for now. For setpoints that come slower than the law runs: at
// 100 Hz and 3 m/s a held position is up to 3 cm old. The caller bounds the age.
[[nodiscard]] Setpoint extrapolated(const Setpoint& setpoint, double age_s);

// Thrust of each motor as a fraction of its maximum, 0 .. 1. Order: front left, front right,
// rear right, rear left.
using MotorCommands = std::array<double, 4>;

// An X quadrotor. Front left and rear right turn clockwise seen from above, so their drag torque
// on the body is positive (to the left).
struct AirframeConfig {
  double mass_kg = 1.2;
  double inertia_xx_kgm2 = 0.011;
  double inertia_yy_kgm2 = 0.011;
  double inertia_zz_kgm2 = 0.020;
  double arm_m = 0.16;
  double max_motor_thrust_n = 7.5;
  double torque_per_thrust_m = 0.016;
  double motor_time_constant_s = 0.025;
  double rotor_drag_xy_kgps = 0.30;
  double rotor_drag_z_kgps = 0.15;
  double body_drag_kgpm = 0.012;

  void visit(FieldVisitor& f) {
    f.field("mass_kg", mass_kg, in_range(0.1, 50.0), "all-up mass");
    f.field("inertia_xx_kgm2", inertia_xx_kgm2, in_range(1e-5, 10.0), "about the forward axis");
    f.field("inertia_yy_kgm2", inertia_yy_kgm2, in_range(1e-5, 10.0), "about the left axis");
    f.field("inertia_zz_kgm2", inertia_zz_kgm2, in_range(1e-5, 10.0), "about the up axis");
    f.field("arm_m", arm_m, in_range(0.03, 2.0), "centre to rotor axis");
    f.field("max_motor_thrust_n",
            max_motor_thrust_n,
            in_range(0.1, 500.0),
            "of one motor; the four lift at least 1.3 times the weight");
    f.field("torque_per_thrust_m",
            torque_per_thrust_m,
            in_range(1e-4, 0.5),
            "drag torque of a rotor per newton of its thrust");
    f.field("motor_time_constant_s",
            motor_time_constant_s,
            in_range(0.0, 0.2),
            "first-order lag of thrust behind command");
    f.field("rotor_drag_xy_kgps",
            rotor_drag_xy_kgps,
            in_range(0.0, 20.0),
            "drag linear in air speed across the rotor axes");
    f.field("rotor_drag_z_kgps",
            rotor_drag_z_kgps,
            in_range(0.0, 20.0),
            "drag linear in air speed along the rotor axes");
    f.field("body_drag_kgpm",
            body_drag_kgpm,
            in_range(0.0, 5.0),
            "drag quadratic in air speed: half air density times drag area");
  }
};

struct ControlConfig {
  double position_gain_per_s2 = 14.0;
  double velocity_gain_per_s = 7.0;
  double integral_gain_per_s3 = 12.0;
  double max_integral_mps2 = 3.0;
  double tilt_gain_per_s2 = 300.0;
  double tilt_rate_gain_per_s = 32.0;
  double yaw_gain_per_s2 = 80.0;
  double yaw_rate_gain_per_s = 16.0;
  double feed_forward_filter_s = 0.015;
  double max_tilt_rad = 0.6;
  double max_feed_forward_rate_radps = 4.0;
  double landing_rate_mps = 0.4;

  void visit(FieldVisitor& f) {
    f.field("position_gain_per_s2", position_gain_per_s2, in_range(0.1, 100.0), "on its error");
    f.field("velocity_gain_per_s", velocity_gain_per_s, in_range(0.1, 50.0), "on its error");
    f.field("integral_gain_per_s3",
            integral_gain_per_s3,
            in_range(0.0, 50.0),
            "on the summed position error, against steady wind");
    f.field("max_integral_mps2",
            max_integral_mps2,
            in_range(0.0, 10.0),
            "bound of the integral's acceleration, horizontally and vertically");
    f.field("tilt_gain_per_s2", tilt_gain_per_s2, in_range(1.0, 2000.0), "roll and pitch error");
    f.field("tilt_rate_gain_per_s", tilt_rate_gain_per_s, in_range(0.1, 200.0), "of their rates");
    f.field("yaw_gain_per_s2", yaw_gain_per_s2, in_range(1.0, 2000.0), "on yaw error");
    f.field("yaw_rate_gain_per_s", yaw_rate_gain_per_s, in_range(0.1, 200.0), "on its rate");
    f.field("feed_forward_filter_s",
            feed_forward_filter_s,
            in_range(0.004, 0.2),
            "time constant of the derivatives taken of the setpoint");
    f.field("max_tilt_rad", max_tilt_rad, in_range(0.05, 1.2), "of the commanded thrust");
    f.field("max_feed_forward_rate_radps",
            max_feed_forward_rate_radps,
            in_range(0.1, 50.0),
            "bound of the body rate asked for ahead of any error");
    f.field("landing_rate_mps", landing_rate_mps, in_range(0.05, 2.0), "descent in landing");
  }
};

enum class ControlMode : std::uint8_t {
  kIdle,   // motors off
  kTrack,  // follows the setpoint
  kLand,   // descends from where it is; on ground contact becomes kIdle by itself
};
[[nodiscard]] const char* to_string(ControlMode mode);

// First-order low-pass of a signal that also gives its derivative.
template <class Value>
struct FilteredDerivative {
  Value filtered;
  bool primed = false;

  Value update(const Value& input, double time_constant_s, double step_s) {
    if (!primed) {
      filtered = input;
      primed = true;
    }
    Value derivative = (input - filtered) / (time_constant_s + step_s);
    filtered += derivative * step_s;
    return derivative;
  }
};

class ControlLaw {
 public:
  // Throws ConfigError when the motors cannot carry the airframe. Starts in kIdle.
  ControlLaw(const AirframeConfig& airframe, const ControlConfig& config);

  // The setpoint matters in kTrack only. A state or setpoint that is not finite is counted and the
  // last good one is used in its place, its velocity taken as zero.
  [[nodiscard]] MotorCommands update(const VehicleState& state,
                                     const Setpoint& setpoint,
                                     double step_s);

  void set_mode(ControlMode mode);
  [[nodiscard]] ControlMode mode() const { return mode_; }
  [[nodiscard]] std::uint64_t rejected_inputs() const { return rejected_inputs_; }

 private:
  struct Attitude {
    Eigen::Matrix3d world_from_desired;
    Vector3d rates_radps;          // in the desired frame
    Vector3d acceleration_radps2;  // likewise
    double thrust_n = 0.0;
  };

  [[nodiscard]] Setpoint landing_setpoint(const VehicleState& state, double step_s);
  [[nodiscard]] Vector3d wanted_thrust_mps2(const VehicleState& state,
                                            const Setpoint& setpoint,
                                            double step_s);
  [[nodiscard]] Attitude wanted_attitude(const VehicleState& state,
                                         const Setpoint& setpoint,
                                         double step_s);
  [[nodiscard]] Vector3d torque_nm(const VehicleState& state, const Attitude& wanted) const;
  [[nodiscard]] MotorCommands mix(double thrust_n, const Vector3d& torque_nm) const;

  AirframeConfig airframe_;
  ControlConfig config_;
  Vector3d inertia_kgm2_;
  ControlMode mode_ = ControlMode::kIdle;

  Vector3d integral_mps2_ = Vector3d::Zero();
  FilteredDerivative<Vector3d> jerk_;
  FilteredDerivative<Vector3d> rate_change_;
  VehicleState last_state_;
  Setpoint last_setpoint_;
  bool landing_started_ = false;
  double still_on_ground_s_ = 0.0;
  std::uint64_t rejected_inputs_ = 0;
};

}  // namespace understory
