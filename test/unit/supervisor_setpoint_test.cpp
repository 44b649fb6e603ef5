// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <functional>
#include <limits>
#include <string>

#include <gtest/gtest.h>

#include "support/supervisor_bench.hpp"

namespace understory::can {
namespace {

using std::chrono::milliseconds;
using test::SupervisorBench;

struct Refusal {
  std::string name;
  std::function<void(SupervisorBench&, WireSetpoint&)> spoil;
  AckResult answer{};
};

std::string name_of(const ::testing::TestParamInfo<Refusal>& info) {
  return info.param.name;
}

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

const std::vector<Refusal> kRefusals = {
    {"OlderThanATenthSecond",
     [](SupervisorBench& bench, WireSetpoint& wire) {
       wire.time_wire_us = wire_time_us(bench.now - Duration(100'001));
     },
     AckResult::kStale},
    {"OfTheFuture",
     [](SupervisorBench& bench, WireSetpoint& wire) {
       wire.time_wire_us = wire_time_us(bench.now + Duration(20'001));
     },
     AckResult::kStale},
    {"OfTheSameNumber",
     [](SupervisorBench&, WireSetpoint& wire) {
       wire.seq = static_cast<std::uint8_t>(wire.seq - 1);
     },
     AckResult::kSequence},
    {"HalfARoundAhead",
     [](SupervisorBench&, WireSetpoint& wire) {
       wire.seq = static_cast<std::uint8_t>(wire.seq + 127);
     },
     AckResult::kSequence},
    {"ThreeMetresOff",
     [](SupervisorBench& bench, WireSetpoint& wire) {
       wire.setpoint.position_m = bench.facts.position_m + Vector3d(0.0, 3.001, 0.0);
     },
     AckResult::kLimits},
    {"TooFast",
     [](SupervisorBench&, WireSetpoint& wire) {
       wire.setpoint.velocity_mps = {8.5, 8.5, 0.0};
     },
     AckResult::kLimits},
    {"TooHard",
     [](SupervisorBench&, WireSetpoint& wire) {
       wire.setpoint.acceleration_mps2 = {14.2, -14.2, 0.0};
     },
     AckResult::kLimits},
    {"WithoutAPosition",
     [](SupervisorBench&, WireSetpoint& wire) { wire.setpoint.position_m.z() = kNan; },
     AckResult::kLimits},
    {"WithoutAVelocity",
     [](SupervisorBench&, WireSetpoint& wire) { wire.setpoint.velocity_mps.x() = kNan; },
     AckResult::kLimits},
    {"WithoutAnAcceleration",
     [](SupervisorBench&, WireSetpoint& wire) { wire.setpoint.acceleration_mps2.y() = kNan; },
     AckResult::kLimits},
    {"OfOnlySomeParts",
     [](SupervisorBench&, WireSetpoint& wire) { wire.mask = static_cast<SpMask>(15); },
     AckResult::kUnsupported},
    {"OfAnotherFrame",
     [](SupervisorBench&, WireSetpoint& wire) { wire.frame = static_cast<SpXyFrame>(1); },
     AckResult::kUnsupported},
    {"OfAnotherMode",
     [](SupervisorBench&, WireSetpoint& wire) { wire.mode = static_cast<SpMode>(2); },
     AckResult::kUnsupported},
};

class SetpointThatIs : public ::testing::TestWithParam<Refusal> {
 public:
  // Every 10 ms one that is spoilt.
  AckResult send_spoilt() {
    bench.wire.seq = static_cast<std::uint8_t>(bench.wire.seq + 1U);
    WireSetpoint wire = bench.wire;
    wire.time_wire_us = wire_time_us(bench.now);
    GetParam().spoil(bench, wire);
    const AckResult answer = bench.supervisor.on_setpoint(wire, bench.now);
    if (answer == AckResult::kSequence) {
      bench.wire.seq = static_cast<std::uint8_t>(bench.wire.seq - 1U);
    }
    return answer;
  }

  SupervisorBench bench;
};

TEST_P(SetpointThatIs, IsRefusedAndFeedsNoWatchdog) {
  ASSERT_TRUE(bench.take_off());
  ASSERT_EQ(bench.send_setpoint(), AckResult::kFlown);
  bench.has_setpoints = false;
  const Time begin = bench.now;

  while (bench.now < begin + milliseconds(248)) {
    bench.run(milliseconds(8));
    ASSERT_EQ(send_spoilt(), GetParam().answer);
    ASSERT_TRUE(bench.is_armed());
  }
  bench.run(milliseconds(2));

  EXPECT_EQ(bench.supervisor.state(), State::kHold);
  EXPECT_EQ(bench.now - begin, milliseconds(250));
}

INSTANTIATE_TEST_SUITE_P(Supervisor, SetpointThatIs, ::testing::ValuesIn(kRefusals), name_of);

struct SupervisorSetpoint : public ::testing::Test {
  SupervisorSetpoint() { EXPECT_TRUE(bench.take_off()); }

  SupervisorBench bench;
};

TEST_F(SupervisorSetpoint, ASetpointJustAtEveryLimitIsFlown) {
  bench.wire.setpoint.position_m = bench.facts.position_m + Vector3d(0.0, 3.0, 0.0);
  bench.wire.setpoint.velocity_mps = {0.0, 12.0, 0.0};
  bench.wire.setpoint.acceleration_mps2 = {0.0, 0.0, -20.0};
  bench.wire.mode = SpMode::kHold;

  EXPECT_EQ(bench.send_setpoint(), AckResult::kFlown);
}

TEST_F(SupervisorSetpoint, ASetpointOfATenthSecondIsStillFlownAndOneAsFarAhead) {
  bench.wire.seq = static_cast<std::uint8_t>(bench.wire.seq + 1U);
  bench.wire.time_wire_us = wire_time_us(bench.now - milliseconds(100));
  EXPECT_EQ(bench.supervisor.on_setpoint(bench.wire, bench.now), AckResult::kFlown);

  bench.wire.seq = static_cast<std::uint8_t>(bench.wire.seq + 127U);
  bench.wire.time_wire_us = wire_time_us(bench.now + milliseconds(20));

  EXPECT_EQ(bench.supervisor.on_setpoint(bench.wire, bench.now), AckResult::kFlown);
}

TEST_F(SupervisorSetpoint, WhereItIsNotKnownNoSetpointIsNear) {
  bench.facts.position_m.x() = kNan;
  bench.step();

  EXPECT_EQ(bench.send_setpoint(), AckResult::kLimits);
}

TEST(Supervisor, SetpointsOnTheGroundAreAnsweredAsNotArmed) {
  SupervisorBench bench;
  bench.wire.setpoint.position_m.x() += 500.0;

  bench.run(milliseconds(100));

  EXPECT_EQ(bench.last_ack, AckResult::kNotArmed);
}

}  // namespace
}  // namespace understory::can
