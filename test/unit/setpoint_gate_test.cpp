// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/bridge/setpoint_gate.hpp"

#include <functional>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

namespace understory {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr Duration kTick = std::chrono::milliseconds(10);
const Box3d kBox_m(Vector3d(-5.0, -5.0, 0.0), Vector3d(5.0, 5.0, 2.0));

GateConfig config() {
  GateConfig config;
  config.max_speed_mps = 4.0;
  config.max_acceleration_mps2 = 6.0;
  config.max_step_m = 0.2;
  config.fence_margin_m = 0.3;
  return config;
}

Time tick(int number) {
  return Time(std::chrono::seconds(100)) + number * kTick;
}

Setpoint at(double x_m, double y_m = 0.0, double z_m = 1.0) {
  Setpoint setpoint;
  setpoint.position_m = {x_m, y_m, z_m};
  return setpoint;
}

// At (1, 0, 1) and on the move.
Setpoint moving() {
  Setpoint setpoint = at(1.0);
  setpoint.velocity_mps = {2.0, 1.0, 0.0};
  setpoint.acceleration_mps2 = {0.0, 3.0, 1.0};
  setpoint.yaw_rad = 0.7;
  setpoint.yaw_rate_radps = 0.4;
  return setpoint;
}

bool same(const std::optional<Setpoint>& a, const Setpoint& b) {
  return a && a->position_m == b.position_m && a->velocity_mps == b.velocity_mps &&
         a->acceleration_mps2 == b.acceleration_mps2 && a->yaw_rad == b.yaw_rad &&
         a->yaw_rate_radps == b.yaw_rate_radps;
}

Setpoint held(Setpoint setpoint) {
  setpoint.velocity_mps.setZero();
  setpoint.acceleration_mps2.setZero();
  setpoint.yaw_rate_radps = 0.0;
  return setpoint;
}

// What a gate that has just passed moving() makes of it.
std::optional<Setpoint> answer_to(const Setpoint& setpoint) {
  SetpointGate gate(config(), kBox_m);
  EXPECT_TRUE(gate.pass(moving(), tick(0)));
  return gate.pass(setpoint, tick(1));
}

TEST(SetpointGate, WhatKeepsEveryLimitPassesUnchanged) {
  SetpointGate gate(config(), kBox_m);

  EXPECT_TRUE(same(gate.pass(moving(), tick(0)), moving()));
  EXPECT_EQ(gate.violations(), 0U);
}

TEST(SetpointGate, AnySingleValueThatIsNotFiniteIsHeldBack) {
  const std::vector<std::function<void(Setpoint&, double)>> fields{
      [](Setpoint& s, double value) { s.position_m.x() = value; },
      [](Setpoint& s, double value) { s.position_m.y() = value; },
      [](Setpoint& s, double value) { s.position_m.z() = value; },
      [](Setpoint& s, double value) { s.velocity_mps.x() = value; },
      [](Setpoint& s, double value) { s.velocity_mps.y() = value; },
      [](Setpoint& s, double value) { s.velocity_mps.z() = value; },
      [](Setpoint& s, double value) { s.acceleration_mps2.x() = value; },
      [](Setpoint& s, double value) { s.acceleration_mps2.y() = value; },
      [](Setpoint& s, double value) { s.acceleration_mps2.z() = value; },
      [](Setpoint& s, double value) { s.yaw_rad = value; },
      [](Setpoint& s, double value) { s.yaw_rate_radps = value; },
  };
  for (std::size_t i = 0; i < fields.size(); ++i) {
    for (const double value : {kNan, std::numeric_limits<double>::infinity()}) {
      Setpoint bad = moving();
      fields[i](bad, value);

      EXPECT_TRUE(same(answer_to(bad), held(moving()))) << "field " << i << " is " << value;
    }
  }
}

TEST(SetpointGate, FenceIsTheBoxAndItsMarginOnEverySide) {
  const double inside_m = 1e-6;
  const Vector3d low(-5.3, -5.3, -0.3);
  const Vector3d high(5.3, 5.3, 2.3);
  for (int axis = 0; axis < 3; ++axis) {
    for (const bool is_high : {false, true}) {
      const double side_m = is_high ? high[axis] : low[axis];
      const double outward = is_high ? 1.0 : -1.0;
      Setpoint just_in = at(0.0);
      just_in.position_m[axis] = side_m - outward * inside_m;
      Setpoint just_out = at(0.0);
      just_out.position_m[axis] = side_m + outward * inside_m;
      SetpointGate gate(config(), kBox_m);

      EXPECT_TRUE(same(gate.pass(just_in, tick(0)), just_in)) << axis << is_high;
      EXPECT_TRUE(same(gate.pass(just_out, tick(1)), just_in)) << axis << is_high;
      EXPECT_EQ(gate.violations(), 1U);
    }
  }
}

TEST(SetpointGate, SpeedIsLimitedByItsNorm) {
  Setpoint fast = moving();
  fast.velocity_mps = {2.4, 3.19, 0.0};  // norm 3.992
  EXPECT_TRUE(same(answer_to(fast), fast));

  fast.velocity_mps = {2.4, 3.21, 0.0};  // norm 4.008, each part below the limit

  EXPECT_TRUE(same(answer_to(fast), held(moving())));
}

TEST(SetpointGate, AccelerationIsLimitedByItsNorm) {
  Setpoint hard = moving();
  hard.acceleration_mps2 = {0.0, 3.6, -4.79};
  EXPECT_TRUE(same(answer_to(hard), hard));

  hard.acceleration_mps2 = {0.0, 3.6, -4.81};

  EXPECT_TRUE(same(answer_to(hard), held(moving())));
}

TEST(SetpointGate, StepIsLimitedToWhatTheSpeedLimitExplainsAndTheConfiguredJump) {
  const double most_m = 0.2 + 4.0 * 0.01;
  Setpoint ahead = moving();
  ahead.position_m.x() += most_m - 1e-6;
  EXPECT_TRUE(same(answer_to(ahead), ahead));

  ahead.position_m.x() += 2e-6;

  EXPECT_TRUE(same(answer_to(ahead), held(moving())));
}

TEST(SetpointGate, WhatIsJustAtEveryLimitPasses) {
  GateConfig exact = config();
  exact.max_step_m = 0.25;
  SetpointGate gate(exact, kBox_m);
  ASSERT_TRUE(gate.pass(at(1.0), tick(0)));
  Setpoint limit = at(1.25);
  limit.velocity_mps = {0.0, -4.0, 0.0};
  limit.acceleration_mps2 = {0.0, 0.0, 6.0};

  EXPECT_TRUE(same(gate.pass(limit, tick(0)), limit));
}

TEST(SetpointGate, HoldRepeatsTheLastGoodPositionForAsLongAsNothingPasses) {
  SetpointGate gate(config(), kBox_m);
  ASSERT_TRUE(gate.pass(at(0.9), tick(0)));
  ASSERT_TRUE(gate.pass(moving(), tick(1)));

  for (int i = 2; i < 500; ++i) {
    ASSERT_TRUE(same(gate.pass(at(4.0), tick(i)), held(moving()))) << "tick " << i;
  }
}

TEST(SetpointGate, EveryViolationIsCountedOnce) {
  SetpointGate gate(config(), kBox_m);
  for (int i = 0; i < 30; ++i) {
    const bool is_bad = i % 3 == 2;
    static_cast<void>(gate.pass(is_bad ? at(4.0) : at(1.0), tick(i)));
  }

  EXPECT_EQ(gate.violations(), 10U);
}

TEST(SetpointGate, WhatIsGoodAgainPassesAtOnce) {
  SetpointGate gate(config(), kBox_m);
  ASSERT_TRUE(gate.pass(moving(), tick(0)));
  ASSERT_TRUE(gate.pass(at(kNan), tick(1)));
  Setpoint further = moving();
  further.position_m.x() += 0.02;

  EXPECT_TRUE(same(gate.pass(further, tick(2)), further));
  EXPECT_EQ(gate.violations(), 1U);
}

TEST(SetpointGate, HoldingOnDoesNotAddUpToALicenceToJump) {
  SetpointGate gate(config(), kBox_m);
  ASSERT_TRUE(gate.pass(moving(), tick(0)));
  Setpoint far = moving();
  far.position_m.x() += 0.3;  // 0.2 m and 4 m/s would explain it after 25 ms

  for (int i = 1; i < 100; ++i) {
    ASSERT_TRUE(same(gate.pass(far, tick(i)), held(moving()))) << "tick " << i;
  }
}

TEST(SetpointGate, LongSilenceExplainsNoMoreThanASecond) {
  for (const int silence_s : {2, 60, 86400}) {
    SetpointGate gate(config(), kBox_m);
    ASSERT_TRUE(gate.pass(at(-4.0), tick(0)));

    const Time later = tick(0) + std::chrono::seconds(silence_s);

    EXPECT_TRUE(same(gate.pass(at(0.25), later), at(-4.0))) << silence_s << " s for 4.25 m";
  }
}

TEST(SetpointGate, ClockThatGoesBackExplainsNoStepAndForbidsNone) {
  for (const double step_m : {0.19, 0.21}) {  // around what is let through at once
    SetpointGate gate(config(), kBox_m);
    ASSERT_TRUE(gate.pass(at(0.0), tick(100)));

    EXPECT_TRUE(same(gate.pass(at(step_m), tick(0)), at(step_m < 0.2 ? step_m : 0.0))) << step_m;
  }
}

TEST(SetpointGate, NoHoldIsMadeUpBeforeThereWasAGoodPosition) {
  SetpointGate gate(config(), kBox_m);

  EXPECT_FALSE(gate.pass(at(kNan), tick(0)).has_value());
  EXPECT_FALSE(gate.pass(at(9.0), tick(1)).has_value());
  EXPECT_EQ(gate.violations(), 2U);
  EXPECT_TRUE(same(gate.pass(at(4.0), tick(2)), at(4.0)));
}

}  // namespace
}  // namespace understory
