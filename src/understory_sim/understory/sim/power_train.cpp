// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/power_train.hpp"

#include <algorithm>
#include <cmath>

namespace understory {
namespace {

constexpr double kSecondsPerHour = 3600.0;
constexpr double kAmbientCelsius = 20.0;
constexpr double kLostShare = 0.1;  // of an ESC's power, as heat
constexpr double kKelvinPerWatt = 4.0;
constexpr double kThermalTimeS = 30.0;
constexpr double kVoltageSpread = 0.2;  // full less empty, as a share of the voltage in between
constexpr double kHotCelsius = 90.0;
constexpr double kElectronicsW = 5.0;
constexpr double kLongestS = 2540.0;

}  // namespace

PowerTrain::PowerTrain(const PowerConfig& config, double max_motor_thrust_n)
    : config_(config), max_thrust_n_(max_motor_thrust_n), charge_wh_(config.battery_wh) {
  step({}, 0.0);
}

void PowerTrain::drain(double charge_percent) {
  charge_wh_ = std::min(charge_wh_, 0.01 * charge_percent * config_.battery_wh);
}

void PowerTrain::step(const std::array<double, 4>& thrusts_n, double step_s) {
  const double share = charge_wh_ / config_.battery_wh;
  const double open_v = config_.battery_v * (1.0 + kVoltageSpread * (share - 0.5));
  double power_w = kElectronicsW;
  for (std::size_t i = 0; i < escs_.size(); ++i) {
    can::EscReading& esc = escs_[i];
    const double load = std::clamp(thrusts_n[i] / max_thrust_n_, 0.0, 1.0);
    const double motor_w = config_.max_motor_power_w * load * std::sqrt(load);
    power_w += motor_w;
    esc.speed_rpm = config_.max_speed_rpm * std::sqrt(load);
    esc.current_a = motor_w / open_v;
    const double warm_celsius = kAmbientCelsius + kKelvinPerWatt * kLostShare * motor_w;
    esc.temperature_celsius += (warm_celsius - esc.temperature_celsius) * step_s / kThermalTimeS;
    if (esc.error != can::EscErr::kFailed) {
      esc.error = esc.temperature_celsius > kHotCelsius ? can::EscErr::kHot : can::EscErr::kNone;
    }
  }
  charge_wh_ = std::max(0.0, charge_wh_ - power_w * step_s / kSecondsPerHour);
  battery_.current_a = power_w / open_v;
  battery_.voltage_v = open_v - config_.battery_ohm * battery_.current_a;
  for (can::EscReading& esc : escs_) {
    esc.voltage_v = battery_.voltage_v;
  }
  battery_.charge_percent = 100.0 * charge_wh_ / config_.battery_wh;
  battery_.time_left_s = std::min(kLongestS, charge_wh_ * kSecondsPerHour / power_w);
  battery_.status = battery_.charge_percent <= config_.empty_percent ? can::BattStatus::kEmpty
                    : battery_.charge_percent <= config_.low_percent ? can::BattStatus::kLow
                                                                     : can::BattStatus::kGood;
}

}  // namespace understory
