// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/power_train.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace understory {
namespace {

constexpr double kMaxThrust_n = 7.5;
constexpr double kStepS = 0.002;

struct Powered {
  void run(double share, double duration_s) {
    const auto steps = std::lround(duration_s / kStepS);
    for (long i = 0; i < steps; ++i) {
      train.step(
          {share * kMaxThrust_n, share * kMaxThrust_n, share * kMaxThrust_n, share * kMaxThrust_n},
          kStepS);
    }
  }

  PowerConfig config;
  PowerTrain train{config, kMaxThrust_n};
};

TEST(PowerTrain, IsFullAndColdAtFirst) {
  const Powered powered;

  EXPECT_EQ(powered.train.battery().charge_percent, 100.0);
  EXPECT_EQ(powered.train.battery().status, can::BattStatus::kGood);
  for (const can::EscReading& esc : powered.train.escs()) {
    EXPECT_EQ(esc.speed_rpm, 0.0);
    EXPECT_EQ(esc.current_a, 0.0);
    EXPECT_EQ(esc.error, can::EscErr::kNone);
    EXPECT_NEAR(esc.voltage_v, powered.train.battery().voltage_v, 1e-9);
  }
}

TEST(PowerTrain, SpeedGrowsWithTheRootOfThrustAndPowerWithItsPowerOfOneAndAHalf) {
  Powered quarter;
  Powered full;
  quarter.run(0.25, 0.01);
  full.run(1.0, 0.01);

  EXPECT_NEAR(full.train.escs()[0].speed_rpm, full.config.max_speed_rpm, 1e-9);
  EXPECT_NEAR(quarter.train.escs()[0].speed_rpm, 0.5 * full.config.max_speed_rpm, 1e-9);
  EXPECT_NEAR(full.train.escs()[3].current_a / quarter.train.escs()[3].current_a, 8.0, 1e-3);
}

TEST(PowerTrain, ThrustOutsideOfWhatAMotorGivesIsCutOff) {
  Powered powered;

  powered.train.step({-1.0, 20.0, 0.0, kMaxThrust_n}, kStepS);

  EXPECT_EQ(powered.train.escs()[0].speed_rpm, 0.0);
  EXPECT_EQ(powered.train.escs()[1].speed_rpm, powered.config.max_speed_rpm);
}

TEST(PowerTrain, WhatIsDrawnIsTakenFromTheCharge) {
  Powered powered;
  powered.run(1.0, 60.0);

  const double drawn_wh = (4.0 * powered.config.max_motor_power_w + 5.0) / 60.0;
  EXPECT_NEAR(powered.train.battery().charge_percent,
              100.0 * (1.0 - drawn_wh / powered.config.battery_wh),
              1e-6);
}

TEST(PowerTrain, TheVoltageSagsUnderLoadAndWithTheCharge) {
  Powered powered;
  powered.run(0.0, 0.01);
  const double idle_v = powered.train.battery().voltage_v;
  powered.run(1.0, 0.01);
  const double loaded_v = powered.train.battery().voltage_v;
  powered.train.drain(10.0);
  powered.run(0.0, 0.01);

  EXPECT_NEAR(idle_v - loaded_v,
              powered.config.battery_ohm * 480.0 / (1.1 * powered.config.battery_v),
              0.01);
  EXPECT_LT(powered.train.battery().voltage_v, idle_v - 2.0);
}

TEST(PowerTrain, ABatteryIsLowAtAFifthAndEmptyAtATwentieth) {
  for (const auto& [percent, status] : {std::pair(20.1, can::BattStatus::kGood),
                                        std::pair(20.0, can::BattStatus::kLow),
                                        std::pair(5.1, can::BattStatus::kLow),
                                        std::pair(5.0, can::BattStatus::kEmpty),
                                        std::pair(0.0, can::BattStatus::kEmpty)}) {
    Powered powered;
    powered.train.drain(percent);
    powered.run(0.0, kStepS);

    EXPECT_EQ(powered.train.battery().status, status) << percent;
  }
}

TEST(PowerTrain, DrainingNeverCharges) {
  Powered powered;
  powered.train.drain(30.0);
  powered.train.drain(80.0);
  powered.run(0.0, kStepS);

  EXPECT_LE(powered.train.battery().charge_percent, 30.0);
}

TEST(PowerTrain, AnEmptyBatteryStaysAtNothing) {
  Powered powered;
  powered.train.drain(0.0);
  powered.run(1.0, 10.0);

  EXPECT_EQ(powered.train.battery().charge_percent, 0.0);
  EXPECT_EQ(powered.train.battery().time_left_s, 0.0);
  EXPECT_GT(powered.train.battery().voltage_v, 0.0);
}

TEST(PowerTrain, TimeLeftIsChargeOverPower) {
  Powered powered;
  powered.run(1.0, kStepS);

  EXPECT_NEAR(powered.train.battery().time_left_s, 75.0 * 3600.0 / 485.0, 0.1);
}

TEST(PowerTrain, AnEscWarmsUpAndIsHotAndCoolsAgain) {
  Powered powered;
  powered.config.max_motor_power_w = 240.0;
  powered.train = PowerTrain(powered.config, kMaxThrust_n);
  powered.run(1.0, 1.0);
  EXPECT_EQ(powered.train.escs()[0].error, can::EscErr::kNone);
  powered.run(1.0, 100.0);
  EXPECT_EQ(powered.train.escs()[0].error, can::EscErr::kHot);
  powered.run(0.0, 60.0);

  EXPECT_EQ(powered.train.escs()[0].error, can::EscErr::kNone);
  EXPECT_NEAR(powered.train.escs()[0].temperature_celsius, 32.0, 5.0);
}

TEST(PowerTrain, AFailedEscStaysFailed) {
  Powered powered;
  powered.train.fail_esc(2);
  powered.run(0.5, 1.0);

  EXPECT_EQ(powered.train.escs()[2].error, can::EscErr::kFailed);
  EXPECT_EQ(powered.train.escs()[1].error, can::EscErr::kNone);
}

}  // namespace
}  // namespace understory
