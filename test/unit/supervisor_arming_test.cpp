// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <functional>
#include <string>

#include <gtest/gtest.h>

#include "support/supervisor_bench.hpp"

namespace understory::can {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using test::SupervisorBench;

struct Lack {
  std::string name;
  std::function<void(SupervisorBench&)> take_away;
  State state{};
  StateReason reason{};
  bool is_direct = false;
};

std::string name_of(const ::testing::TestParamInfo<Lack>& info) {
  return info.param.name;
}

const std::vector<Lack> kLacks = {
    {"Heartbeat",
     [](SupervisorBench& bench) { bench.has_heartbeat = false; },
     State::kArming,
     StateReason::kArmNoHeartbeat},
    {"MajorVersion",
     [](SupervisorBench& bench) { ++bench.heartbeat.host_proto_major; },
     State::kArming,
     StateReason::kArmVersion},
    {"DbcHash",
     [](SupervisorBench& bench) { bench.heartbeat.host_dbc_hash ^= 1U; },
     State::kArming,
     StateReason::kArmDbcHash},
    {"Token",
     [](SupervisorBench& bench) { bench.token = arm_token(bench.nonce(), 77) ^ 1U; },
     State::kArming,
     StateReason::kArmToken},
    {"TokenOfThisSession",
     [](SupervisorBench& bench) { bench.token = arm_token(bench.nonce(), 78); },
     State::kArming,
     StateReason::kArmToken},
    {"Setpoints",
     [](SupervisorBench& bench) { bench.has_setpoints = false; },
     State::kArming,
     StateReason::kArmNoSetpoints},
    {"SetpointNearby",
     [](SupervisorBench& bench) { bench.wire.setpoint.position_m.x() += 1.001; },
     State::kArming,
     StateReason::kArmSetpointFar},
    {"Sensors",
     [](SupervisorBench& bench) { bench.facts.has_sensors = false; },
     State::kFault,
     StateReason::kArmSensors},
    {"Escs",
     [](SupervisorBench& bench) { bench.facts.has_escs = false; },
     State::kFault,
     StateReason::kArmEsc},
    {"BatteryThatIsNotLow",
     [](SupervisorBench& bench) { bench.facts.battery = BattStatus::kLow; },
     State::kArming,
     StateReason::kArmBattery},
    {"BatteryThatIsNotEmpty",
     [](SupervisorBench& bench) { bench.facts.battery = BattStatus::kEmpty; },
     State::kArming,
     StateReason::kArmBattery},
    {"SoundLink",
     [](SupervisorBench& bench) { bench.facts.is_link_faulty = true; },
     State::kArming,
     StateReason::kArmLinkFault},
    {"BusOfItsOwn",
     [](SupervisorBench& bench) { bench.facts.has_foreign_vehicle = true; },
     State::kFault,
     StateReason::kArmForeignVehicle},
    {"ZeroThrottle",
     [](SupervisorBench& bench) { bench.is_zero = false; },
     State::kArming,
     StateReason::kArmThrottle,
     true},
    {"EscCommands",
     [](SupervisorBench& bench) { bench.has_setpoints = false; },
     State::kArming,
     StateReason::kArmNoSetpoints,
     true},
    {"Request",
     [](SupervisorBench& bench) { bench.request.reset(); },
     State::kDisarmed,
     StateReason::kPowerOn},
};

class ArmingWithout : public ::testing::TestWithParam<Lack> {};

TEST_P(ArmingWithout, DoesNotHappenAndTellsWhy) {
  SupervisorBench bench(GetParam().is_direct);
  bench.request = ArmRequest::kArm;

  GetParam().take_away(bench);
  const std::optional<Duration> armed = [&]() -> std::optional<Duration> {
    for (const Time end = bench.now + seconds(3); bench.now < end;) {
      bench.step();
      if (bench.is_armed()) {
        return bench.now - (end - seconds(3));
      }
    }
    return std::nullopt;
  }();

  EXPECT_FALSE(armed.has_value());
  EXPECT_EQ(bench.supervisor.state(), GetParam().state);
  EXPECT_EQ(bench.supervisor.reason(), GetParam().reason);
}

INSTANTIATE_TEST_SUITE_P(Supervisor, ArmingWithout, ::testing::ValuesIn(kLacks), name_of);

TEST(SupervisorArming, WithEverythingThereItArms) {
  SupervisorBench bench;
  bench.request = ArmRequest::kArm;

  bench.run(seconds(1));

  EXPECT_EQ(bench.supervisor.state(), State::kArmed);
  EXPECT_EQ(bench.supervisor.reason(), StateReason::kNone);
  EXPECT_EQ(bench.supervisor.report(bench.now).state_arm_seq, 1U);
}

TEST(SupervisorArming, InDirectModeZeroCommandsArm) {
  SupervisorBench bench(true);
  bench.request = ArmRequest::kArm;

  bench.run(seconds(1));

  EXPECT_EQ(bench.supervisor.state(), State::kArmed);
}

TEST(SupervisorArming, SetpointsMustHaveComeForHalfASecond) {
  SupervisorBench bench;
  bench.request = ArmRequest::kArm;
  bench.run(SupervisorBench::kStep);  // the first setpoint

  bench.run(milliseconds(498));
  ASSERT_FALSE(bench.is_armed());
  EXPECT_EQ(bench.supervisor.reason(), StateReason::kArmNoSetpoints);
  bench.run(milliseconds(2));

  EXPECT_TRUE(bench.is_armed());
}

TEST(SupervisorArming, AGapInTheSetpointsBeginsTheHalfSecondAnew) {
  SupervisorBench bench;
  bench.run(milliseconds(490));
  bench.has_setpoints = false;
  bench.run(milliseconds(250));
  bench.has_setpoints = true;
  bench.request = ArmRequest::kArm;

  bench.run(milliseconds(490));
  ASSERT_FALSE(bench.is_armed());
  bench.run(milliseconds(20));

  EXPECT_TRUE(bench.is_armed());
}

TEST(SupervisorArming, OneSetpointFartherThanAMetreBeginsTheHalfSecondAnew) {
  SupervisorBench bench;
  bench.run(milliseconds(490));
  bench.wire.setpoint.position_m.z() += 1.001;
  bench.run(milliseconds(10));
  bench.wire.setpoint.position_m.z() -= 1.001;
  bench.request = ArmRequest::kArm;

  bench.run(milliseconds(480));
  ASSERT_FALSE(bench.is_armed());
  bench.run(milliseconds(40));

  EXPECT_TRUE(bench.is_armed());
}

TEST(SupervisorArming, ASetpointAMetreOffIsNear) {
  SupervisorBench bench;
  bench.wire.setpoint.position_m.x() += 1.0;
  bench.request = ArmRequest::kArm;

  bench.run(seconds(1));

  EXPECT_TRUE(bench.is_armed());
}

TEST(SupervisorArming, SetpointsThatEndedAQuarterSecondAgoDoNotArm) {
  SupervisorBench bench;
  bench.run(seconds(1));
  bench.has_setpoints = false;
  bench.run(milliseconds(60));
  bench.request = ArmRequest::kArm;

  bench.run(milliseconds(400));

  EXPECT_FALSE(bench.is_armed());
}

TEST(SupervisorArming, TwoCommandsAreTooFewAndTheThirdArms) {
  SupervisorBench bench;
  bench.run(seconds(1));

  for (int i = 0; i < 2; ++i) {
    bench.send_arm(ArmRequest::kArm);
    bench.run(milliseconds(100));
    ASSERT_EQ(bench.supervisor.state(), State::kArming);
    ASSERT_EQ(bench.supervisor.reason(), StateReason::kNone);
  }
  bench.send_arm(ArmRequest::kArm);
  bench.run(milliseconds(2));

  EXPECT_TRUE(bench.is_armed());
}

// Three good ones, but not in a row.
class ArmingInARow : public ::testing::TestWithParam<ArmRequest> {
 public:
  SupervisorBench bench;
};

TEST_P(ArmingInARow, IsBrokenByAnotherCommandInBetween) {
  const bool is_wrong_token = GetParam() == ArmRequest::kArm;
  bench.run(seconds(1));
  bench.send_arm(ArmRequest::kArm);
  bench.send_arm(ArmRequest::kArm);
  bench.step();

  bench.token = is_wrong_token ? std::optional<std::uint32_t>(1U) : std::nullopt;
  bench.send_arm(GetParam());
  bench.token.reset();
  bench.send_arm(ArmRequest::kArm);
  bench.step();
  bench.send_arm(ArmRequest::kArm);
  bench.step();
  ASSERT_FALSE(bench.is_armed());
  bench.send_arm(ArmRequest::kArm);
  bench.step();

  EXPECT_TRUE(bench.is_armed());
}

INSTANTIATE_TEST_SUITE_P(Supervisor,
                         ArmingInARow,
                         ::testing::Values(ArmRequest::kDisarm, ArmRequest::kArm));

TEST(SupervisorArming, ARowThatStoppedHalfASecondAgoBeginsAnew) {
  SupervisorBench bench;
  bench.run(seconds(1));
  bench.send_arm(ArmRequest::kArm);
  bench.send_arm(ArmRequest::kArm);
  bench.run(milliseconds(500));
  ASSERT_EQ(bench.supervisor.state(), State::kDisarmed);

  bench.send_arm(ArmRequest::kArm);
  bench.step();

  EXPECT_FALSE(bench.is_armed());
}

TEST(SupervisorArming, ARowWithAGapJustBelowHalfASecondStillCounts) {
  SupervisorBench bench;
  bench.run(seconds(1));
  bench.send_arm(ArmRequest::kArm);
  bench.send_arm(ArmRequest::kArm);
  bench.run(milliseconds(498));

  bench.send_arm(ArmRequest::kArm);
  bench.step();

  EXPECT_TRUE(bench.is_armed());
}

TEST(SupervisorArming, WhatIsNoLongerAskedForIsForgotten) {
  SupervisorBench bench;
  bench.has_setpoints = false;
  bench.request = ArmRequest::kArm;
  bench.run(seconds(1));
  ASSERT_EQ(bench.supervisor.state(), State::kArming);
  bench.request.reset();
  bench.run(milliseconds(600));
  ASSERT_EQ(bench.supervisor.state(), State::kDisarmed);

  bench.has_setpoints = true;
  bench.run(seconds(2));

  EXPECT_EQ(bench.supervisor.state(), State::kDisarmed);
}

TEST(SupervisorArming, CommandsBeforeTheFirstUpdateDoNotCount) {
  Supervisor supervisor({}, false, Rng(1));
  SupervisorBench bench;
  ArmCmd command;
  command.arm_request = ArmRequest::kArm;
  command.arm_token = arm_token(0, 0);  // before there is a nonce it reads so
  for (int i = 0; i < 3; ++i) {
    supervisor.on_arm(command, bench.now);
  }

  for (int i = 0; i < 1000; ++i) {
    bench.now += SupervisorBench::kStep;
    supervisor.on_heartbeat(bench.heartbeat, bench.now);
    bench.wire.time_wire_us = wire_time_us(bench.now);
    bench.wire.seq = static_cast<std::uint8_t>(i);
    static_cast<void>(supervisor.on_setpoint(bench.wire, bench.now));
    supervisor.update(bench.facts, bench.now);
    ASSERT_NE(supervisor.state(), State::kArmed);
  }
}

}  // namespace
}  // namespace understory::can
