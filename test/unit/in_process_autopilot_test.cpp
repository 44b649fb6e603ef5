// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "understory/sim/simulated_bus.hpp"

namespace understory {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr Duration kTick = milliseconds(10);
const Time kBegin = Time(seconds(1'700'000'000));  // wall-clock times are large
const Vector3d kStart_m(1.0, -2.0, 1.2);

SimulatedVehicleConfig in_gusts() {
  SimulatedVehicleConfig config;
  config.vehicle.wind.mean_x_mps = 1.0;
  config.vehicle.wind.gust_deviation_mps = 0.5;
  return config;
}

std::unique_ptr<InProcessAutopilot> autopilot(const SimulatedVehicleConfig& config = {}) {
  Pose start = Pose::Identity();
  start.translation() = kStart_m;
  return std::make_unique<InProcessAutopilot>(
      std::make_unique<SimulatedBus>(config, can::HostStationConfig{}, start, Rng(1), kBegin));
}

Setpoint hold_at(const Vector3d& position_m) {
  Setpoint setpoint;
  setpoint.position_m = position_m;
  return setpoint;
}

// From `here_m` at rest, east and up, to 1 m/s east.
struct Course {
  [[nodiscard]] Setpoint at(Time now) const {
    const double time_s = to_seconds(now - begin);
    Setpoint setpoint;
    setpoint.position_m = kStart_m;
    setpoint.position_m.x() += time_s < 1.0 ? 0.5 * time_s * time_s : time_s - 0.5;
    setpoint.position_m.z() += std::min(0.3, 0.3 * time_s);
    setpoint.velocity_mps = {std::min(1.0, time_s), 0.0, time_s < 1.0 ? 0.3 : 0.0};
    return setpoint;
  }
  Time begin{};
};

struct Flown {
  explicit Flown(const SimulatedVehicleConfig& config = {}) : pilot(autopilot(config)) {}

  // Holds where it is until it is armed; then follows the course.
  void tick() {
    telemetry = pilot->receive(now);
    if (telemetry.link.host == can::HostState::kReady && wants_to_fly) {
      pilot->arm();
    }
    if (telemetry.is_following && !course) {
      course = Course{now};
      wants_to_fly = false;
    }
    const Vector3d here_m = telemetry.is_valid ? telemetry.state.position_m : kStart_m;
    pilot->send(course ? course->at(now) : hold_at(here_m), !course, now);
    now += kTick;
  }
  void fly_for(Duration duration) {
    for (const Time end = now + duration; now < end;) {
      tick();
    }
  }

  std::unique_ptr<InProcessAutopilot> pilot;
  Telemetry telemetry;
  std::optional<Course> course;
  bool wants_to_fly = true;
  Time now = kBegin;
};

TEST(InProcessAutopilot, StaysAtItsStartWhileNobodyArmsIt) {
  Flown stays;
  stays.wants_to_fly = false;

  stays.fly_for(seconds(20));

  EXPECT_TRUE(stays.telemetry.is_valid);
  EXPECT_LT((stays.telemetry.state.position_m - kStart_m).norm(), 1e-3);
  EXPECT_EQ(stays.telemetry.link.vehicle, can::State::kDisarmed);
}

TEST(InProcessAutopilot, FollowsAStreamOfSetpoints) {
  Flown follows;

  follows.fly_for(seconds(6));

  const Telemetry telemetry = follows.pilot->receive(follows.now);
  ASSERT_TRUE(telemetry.is_following);
  const Setpoint wanted = follows.course->at(telemetry.time);
  EXPECT_LT((telemetry.state.position_m - wanted.position_m).norm(), 0.05);
  EXPECT_LT((telemetry.state.velocity_mps - wanted.velocity_mps).norm(), 0.05);
}

TEST(InProcessAutopilot, TheLastSetpointIsNotFlownOnForEver) {
  Flown follows;
  follows.fly_for(seconds(6));
  const Vector3d last_m = follows.course->at(follows.now).position_m;

  for (const Time end = follows.now + seconds(5); follows.now < end; follows.now += kTick) {
    static_cast<void>(follows.pilot->receive(follows.now));
  }

  const Telemetry telemetry = follows.pilot->receive(follows.now);
  EXPECT_LT((telemetry.state.position_m - last_m).head<2>().norm(), 1.0) << "not 5 m";
  EXPECT_FALSE(telemetry.is_following);
}

TEST(InProcessAutopilot, TelemetryIsAtMostTwelveMillisecondsOld) {
  Flown flown;
  flown.fly_for(seconds(1));

  for (int i = 1; i < 500; ++i) {
    const Time now = flown.now + i * Duration(3333);
    const Duration age = now - flown.pilot->receive(now).time;
    ASSERT_GE(age, Duration(0));
    ASSERT_LT(age, milliseconds(15));
  }
}

TEST(InProcessAutopilot, LandsWhereItIsAndStaysDown) {
  Flown lands;
  lands.fly_for(seconds(4));
  ASSERT_TRUE(lands.telemetry.is_following);
  const Vector3d above_m = lands.telemetry.state.position_m;

  lands.pilot->disarm();
  lands.fly_for(seconds(15));  // its course is of no account any more

  EXPECT_TRUE(lands.telemetry.is_down);
  EXPECT_LT(lands.telemetry.state.velocity_mps.norm(), 2e-3);
  EXPECT_LT((lands.telemetry.state.position_m - above_m).head<2>().norm(), 1.5) << "from 1 m/s";
  EXPECT_LT(lands.telemetry.state.position_m.z(), 0.11);
}

TEST(InProcessAutopilot, KillStopsItInFlight) {
  Flown killed;
  killed.fly_for(seconds(4));
  ASSERT_TRUE(killed.telemetry.is_following);

  killed.pilot->kill();
  killed.fly_for(milliseconds(100));

  EXPECT_EQ(killed.telemetry.link.vehicle, can::State::kKilled);
}

TEST(InProcessAutopilot, EqualCallsAtEqualTimesGiveEqualFlights) {
  std::vector<Vector3d> ends_m;
  for (int flight = 0; flight < 2; ++flight) {
    Flown flown(in_gusts());
    Rng jitter(5);
    for (int i = 0; i < 600; ++i) {
      flown.now += Duration(static_cast<Duration::rep>(jitter.below(5000)));
      flown.tick();
    }
    ASSERT_TRUE(flown.telemetry.is_following);
    ends_m.push_back(flown.telemetry.state.position_m);
  }

  EXPECT_EQ(ends_m[0], ends_m[1]);
}

TEST(InProcessAutopilot, HowOftenItIsAskedChangesNothing) {
  Flown seldom(in_gusts());
  Flown often(in_gusts());
  for (int i = 0; i < 400; ++i) {
    seldom.tick();
    often.tick();
    for (int ms = 1; ms < 10; ++ms) {
      static_cast<void>(often.pilot->receive(often.now - kTick + milliseconds(ms)));
    }
  }

  ASSERT_TRUE(seldom.telemetry.is_following);
  EXPECT_EQ(seldom.telemetry.state.position_m, often.telemetry.state.position_m);
  EXPECT_EQ(seldom.telemetry.time, often.telemetry.time);
}

TEST(InProcessAutopilot, TheWorldStandsStillWhileTheProcessWasSuspended) {
  Flown flown;
  flown.fly_for(seconds(4));
  const VehicleState before = flown.pilot->receive(flown.now).state;

  flown.now += seconds(10);
  flown.tick();
  flown.tick();

  EXPECT_LT((flown.telemetry.state.position_m - before.position_m).norm(), 0.05) << "not 10 m";
}

TEST(InProcessAutopilot, AfterASuspensionTheVehicleHasLandedByItselfOrDoesSo) {
  Flown flown;
  flown.fly_for(seconds(4));
  flown.now += seconds(10);

  flown.fly_for(seconds(1));

  EXPECT_EQ(flown.telemetry.link.vehicle, can::State::kLand);
  EXPECT_FALSE(flown.telemetry.is_following);
}

TEST(InProcessAutopilot, AShortStallIsCaughtUpWith) {
  Flown stalled;
  Flown prompt;
  stalled.fly_for(seconds(4));
  prompt.fly_for(seconds(4));
  const Time later = stalled.now + milliseconds(60);
  for (; prompt.now < later; prompt.now += kTick) {
    static_cast<void>(prompt.pilot->receive(prompt.now));
  }

  const Telemetry telemetry = stalled.pilot->receive(later);

  EXPECT_EQ(telemetry.time, prompt.pilot->receive(later).time);
  EXPECT_EQ(telemetry.state.position_m, prompt.pilot->receive(later).state.position_m);
}

TEST(InProcessAutopilot, AClockThatGoesBackHoldsTheWorldUntilItsTimeIsReached) {
  Flown flown;
  flown.fly_for(seconds(4));
  const Telemetry before = flown.pilot->receive(flown.now);

  const Telemetry earlier = flown.pilot->receive(kBegin);

  EXPECT_EQ(earlier.time, before.time);
  EXPECT_EQ(earlier.state.position_m, before.state.position_m);
}

TEST(InProcessAutopilot, TellsNothingOfLatency) {
  Flown flown;

  flown.fly_for(seconds(4));

  EXPECT_EQ(flown.telemetry.link.acked_set, 0U);
  EXPECT_GT(flown.telemetry.link.sets_sent, 100U);
}

}  // namespace
}  // namespace understory
