// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What ESCs and battery of the simulated vehicle tell: speed, voltage, current, temperature and
// charge, from the thrust that the motors give. Rotor power grows with thrust to the power of 1.5
// (momentum theory), its speed with the root; the battery is a voltage behind a resistance. SI
// units and rpm. One thread; no allocation; cannot fail.
#pragma once

#include <array>

#include "understory/base/config.hpp"
#include "understory/link/vehicle_station.hpp"

namespace understory {

struct PowerConfig {
  double max_speed_rpm = 12000.0;
  double max_motor_power_w = 120.0;
  double battery_wh = 75.0;
  double battery_v = 14.8;
  double battery_ohm = 0.02;
  double low_percent = 20.0;
  double empty_percent = 5.0;

  void visit(FieldVisitor& f) {
    f.field("max_speed_rpm", max_speed_rpm, in_range(1000.0, 32000.0), "of a rotor");
    f.field("max_motor_power_w", max_motor_power_w, in_range(1.0, 5000.0), "of one, electrical");
    f.field("battery_wh", battery_wh, in_range(1.0, 5000.0), "when full");
    f.field("battery_v", battery_v, in_range(3.0, 60.0), "at half charge");
    f.field("battery_ohm", battery_ohm, in_range(0.0, 1.0), "inner resistance");
    f.field("low_percent", low_percent, in_range(1.0, 90.0), "of charge: time to come home");
    f.field("empty_percent", empty_percent, in_range(0.0, 50.0), "of charge: it must land");
  }
};

class PowerTrain {
 public:
  PowerTrain(const PowerConfig& config, double max_motor_thrust_n);

  void step(const std::array<double, 4>& thrusts_n, double step_s);

  // Faults for tests.
  void drain(double charge_percent);
  void fail_esc(std::size_t index) { escs_[index].error = can::EscErr::kFailed; }

  [[nodiscard]] const std::array<can::EscReading, 4>& escs() const { return escs_; }
  [[nodiscard]] const can::BatteryReading& battery() const { return battery_; }

 private:
  PowerConfig config_;
  double max_thrust_n_;
  double charge_wh_;
  std::array<can::EscReading, 4> escs_;
  can::BatteryReading battery_;
};

}  // namespace understory
