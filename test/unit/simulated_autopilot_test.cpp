// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/simulated_autopilot.hpp"

#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

namespace understory {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr Duration kTick = milliseconds(10);
const Time kBegin = Time(seconds(1'700'000'000));  // wall-clock times are large
const Vector3d kStart_m(1.0, -2.0, 1.2);

SimulatedAutopilot autopilot(const VehicleConfig& vehicle = {}) {
  return {vehicle, ControlConfig{}, kStart_m, 0.4, Rng(1)};
}

VehicleConfig in_gusts() {
  VehicleConfig vehicle;
  vehicle.wind.mean_x_mps = 1.0;
  vehicle.wind.gust_deviation_mps = 0.5;
  return vehicle;
}

// East at 1 m/s from the start.
Setpoint east(Time now) {
  Setpoint setpoint;
  setpoint.position_m = kStart_m + Vector3d(to_seconds(now - kBegin), 0.0, 0.0);
  setpoint.velocity_mps = {1.0, 0.0, 0.0};
  setpoint.yaw_rad = 0.4;
  return setpoint;
}

Setpoint hold_at(const Vector3d& position_m) {
  Setpoint setpoint;
  setpoint.position_m = position_m;
  setpoint.yaw_rad = 0.4;
  return setpoint;
}

TEST(SimulatedAutopilot, StaysAtItsStartWhileNoSetpointComes) {
  SimulatedAutopilot stays = autopilot();

  for (Time now = kBegin; now < kBegin + seconds(20); now += kTick) {
    const VehicleState state = stays.receive(now).state;
    // Its motors stand still at first.
    const double most_m = now < kBegin + seconds(1) ? 0.03 : 0.01;
    ASSERT_LT((state.position_m - kStart_m).norm(), most_m) << to_seconds(now - kBegin) << " s";
    ASSERT_NEAR(yaw_of(state.world_from_body), 0.4, 0.01);
  }
}

TEST(SimulatedAutopilot, FollowsAStreamOfSetpoints) {
  SimulatedAutopilot follows = autopilot();

  Time now = kBegin;
  for (; now < kBegin + seconds(3); now += kTick) {
    follows.send(east(now), now);
  }
  const Telemetry telemetry = follows.receive(now);

  EXPECT_LT((telemetry.state.position_m - east(now).position_m).norm(), 0.05);
  EXPECT_LT((telemetry.state.velocity_mps - Vector3d(1.0, 0.0, 0.0)).norm(), 0.05);
  EXPECT_EQ(telemetry.rejected_inputs, 0U);
}

TEST(SimulatedAutopilot, LastSetpointIsNotFlownOnForEver) {
  SimulatedAutopilot follows = autopilot();
  Time now = kBegin;
  for (; now < kBegin + seconds(2); now += kTick) {
    follows.send(east(now), now);
  }
  const Vector3d last_m = east(now).position_m;

  for (const Time end = now + seconds(5); now < end; now += kTick) {
    static_cast<void>(follows.receive(now));
  }

  EXPECT_LT((follows.receive(now).state.position_m - last_m).norm(), 1.0) << "not 5 m";
}

TEST(SimulatedAutopilot, TelemetryIsAtMostAPhysicsStepOld) {
  SimulatedAutopilot stays = autopilot();
  static_cast<void>(stays.receive(kBegin));

  for (int i = 1; i < 500; ++i) {
    const Time now = kBegin + i * Duration(3333);
    const Duration age = now - stays.receive(now).time;
    ASSERT_GE(age, Duration(0));
    ASSERT_LT(age, milliseconds(2));
  }
}

TEST(SimulatedAutopilot, LandsWhereItIsAndStaysDown) {
  SimulatedAutopilot lands = autopilot();
  Time now = kBegin;
  for (; now < kBegin + seconds(1); now += kTick) {
    lands.send(hold_at(kStart_m), now);
    ASSERT_FALSE(lands.receive(now).is_down);
  }

  lands.land();
  for (const Time end = now + seconds(10); now < end; now += kTick) {
    lands.send(hold_at(kStart_m + Vector3d(1.0, 0.0, 0.5)), now);  // of no account any more
  }

  const Telemetry telemetry = lands.receive(now);
  EXPECT_TRUE(telemetry.is_down);
  EXPECT_LT(telemetry.state.velocity_mps.norm(), 1e-3);
  EXPECT_LT((telemetry.state.position_m - kStart_m).head<2>().norm(), 0.05);
  EXPECT_LT(telemetry.state.position_m.z(), 0.3);
}

TEST(SimulatedAutopilot, EqualCallsAtEqualTimesGiveEqualFlights) {
  std::vector<Vector3d> ends_m;
  for (int flight = 0; flight < 2; ++flight) {
    SimulatedAutopilot flown = autopilot(in_gusts());
    Rng jitter(5);
    Time now = kBegin;
    for (int i = 0; i < 300; ++i) {
      now += milliseconds(5) + Duration(static_cast<Duration::rep>(jitter.below(10000)));
      flown.send(east(now), now);
    }
    ends_m.push_back(flown.receive(now).state.position_m);
  }

  EXPECT_EQ(ends_m[0], ends_m[1]);
}

TEST(SimulatedAutopilot, HowOftenItIsAskedChangesNothing) {
  SimulatedAutopilot seldom = autopilot(in_gusts());
  SimulatedAutopilot often = autopilot(in_gusts());
  static_cast<void>(seldom.receive(kBegin));
  static_cast<void>(often.receive(kBegin));

  const Time end = kBegin + milliseconds(800);
  for (Time now = kBegin; now < end; now += milliseconds(1)) {
    static_cast<void>(often.receive(now));
  }

  EXPECT_EQ(seldom.receive(end).state.position_m, often.receive(end).state.position_m);
}

TEST(SimulatedAutopilot, WorldStandsStillWhileTheProcessWasSuspended) {
  SimulatedAutopilot flown = autopilot();
  Time now = kBegin;
  for (; now < kBegin + seconds(2); now += kTick) {
    flown.send(east(now), now);
  }
  const VehicleState before = flown.receive(now).state;

  const Time woken = now + seconds(10);
  const Telemetry telemetry = flown.receive(woken);

  EXPECT_EQ(telemetry.time, woken);
  EXPECT_EQ(telemetry.state.position_m, before.position_m);
  EXPECT_EQ(telemetry.state.velocity_mps, before.velocity_mps);
}

TEST(SimulatedAutopilot, ShortStallIsCaughtUpWith) {
  SimulatedAutopilot stalled = autopilot();
  SimulatedAutopilot prompt = autopilot();
  for (SimulatedAutopilot* flown : {&stalled, &prompt}) {
    for (Time now = kBegin; now < kBegin + seconds(1); now += kTick) {
      flown->send(hold_at(kStart_m + Vector3d(0.3, 0.0, 0.0)), now);
    }
  }
  const Time later = kBegin + seconds(1) + milliseconds(500);
  for (Time now = kBegin + seconds(1); now < later; now += kTick) {
    static_cast<void>(prompt.receive(now));
  }

  const Telemetry telemetry = stalled.receive(later);

  EXPECT_EQ(telemetry.time, later);
  EXPECT_EQ(telemetry.state.position_m, prompt.receive(later).state.position_m);
}

TEST(SimulatedAutopilot, ClockThatGoesBackHoldsTheWorldUntilItsTimeIsReached) {
  SimulatedAutopilot flown = autopilot();
  Time now = kBegin;
  for (; now < kBegin + seconds(1); now += kTick) {
    flown.send(east(now), now);
  }
  const Telemetry before = flown.receive(now);

  const Telemetry earlier = flown.receive(kBegin);

  EXPECT_EQ(earlier.time, before.time);
  EXPECT_EQ(earlier.state.position_m, before.state.position_m);
}

}  // namespace
}  // namespace understory
