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

// In flight; `now` is when the last setpoint came.
struct SupervisorFlight : public ::testing::Test {
  SupervisorFlight() {
    EXPECT_TRUE(bench.take_off());
    bench.supervisor.on_heartbeat(bench.heartbeat, bench.now);
    EXPECT_EQ(bench.send_setpoint(), AckResult::kFlown);
    bench.next_setpoint = bench.now + milliseconds(10);
    bench.next_heartbeat = bench.now + milliseconds(100);
  }

  SupervisorBench bench;
};

TEST_F(SupervisorFlight, FiftyMillisecondsWithoutASetpointAreLate) {
  bench.has_setpoints = false;

  bench.run(milliseconds(48));
  EXPECT_FALSE(bench.supervisor.report(bench.now).flag_late);
  bench.run(milliseconds(2));

  EXPECT_TRUE(bench.supervisor.report(bench.now).flag_late);
  EXPECT_TRUE(bench.is_armed());
}

TEST_F(SupervisorFlight, AQuarterSecondWithoutASetpointIsHeld) {
  bench.has_setpoints = false;

  EXPECT_EQ(bench.leaves(State::kArmed, seconds(1)), milliseconds(250));

  EXPECT_EQ(bench.supervisor.state(), State::kHold);
  EXPECT_EQ(bench.supervisor.reason(), StateReason::kSetpointSilence);
  EXPECT_EQ(bench.supervisor.report(bench.now).state_reason, StateReason::kSetpointSilence);
}

TEST_F(SupervisorFlight, ASecondWithoutASetpointLands) {
  bench.has_setpoints = false;
  bench.run(milliseconds(250));

  EXPECT_EQ(bench.leaves(State::kHold, seconds(2)), milliseconds(750));

  EXPECT_EQ(bench.supervisor.state(), State::kLand);
  EXPECT_EQ(bench.supervisor.reason(), StateReason::kSetpointSilence);
}

TEST_F(SupervisorFlight, ASecondWithoutAHeartbeatLandsThoughSetpointsCome) {
  bench.has_heartbeat = false;

  EXPECT_EQ(bench.leaves(State::kArmed, seconds(2)), seconds(1));

  EXPECT_EQ(bench.supervisor.state(), State::kLand);
  EXPECT_EQ(bench.supervisor.reason(), StateReason::kHostSilence);
  EXPECT_FALSE(bench.supervisor.report(bench.now).flag_host);
}

TEST_F(SupervisorFlight, AQuarterSecondLessOneStepIsFlownOn) {
  bench.has_setpoints = false;
  bench.run(milliseconds(248));
  bench.has_setpoints = true;

  EXPECT_FALSE(bench.leaves(State::kArmed, seconds(1)).has_value());
}

// A host that has started anew counts from anywhere.
TEST_F(SupervisorFlight, AfterAQuarterSecondAnyNumberIsTheNext) {
  bench.has_setpoints = false;
  bench.run(milliseconds(250));
  ASSERT_EQ(bench.supervisor.state(), State::kHold);
  bench.wire.seq = static_cast<std::uint8_t>(bench.wire.seq + 199U);

  EXPECT_EQ(bench.send_setpoint(), AckResult::kFlown);
  EXPECT_TRUE(bench.is_armed());
}

TEST_F(SupervisorFlight, AHoldEndsWithASetpointNearby) {
  bench.has_setpoints = false;
  bench.run(milliseconds(300));
  bench.wire.setpoint.position_m = bench.facts.position_m + Vector3d(0.999, 0.0, 0.0);

  EXPECT_EQ(bench.send_setpoint(), AckResult::kFlown);
  EXPECT_TRUE(bench.is_armed());
  EXPECT_EQ(bench.supervisor.reason(), StateReason::kNone);
}

TEST_F(SupervisorFlight, AHoldDoesNotEndWithSetpointsFartherOffButInLanding) {
  bench.has_setpoints = false;
  bench.run(milliseconds(250));
  bench.wire.setpoint.position_m = bench.facts.position_m + Vector3d(1.001, 0.0, 0.0);
  bench.has_setpoints = true;

  EXPECT_EQ(bench.leaves(State::kHold, seconds(2)), milliseconds(750));

  EXPECT_EQ(bench.last_ack, AckResult::kLimits);
  EXPECT_EQ(bench.supervisor.state(), State::kLand);
}

TEST_F(SupervisorFlight, ALandingIsNotLeftForSetpoints) {
  bench.has_setpoints = false;
  bench.run(milliseconds(1002));
  ASSERT_EQ(bench.supervisor.state(), State::kLand);
  bench.has_setpoints = true;
  bench.request = ArmRequest::kArm;

  bench.run(seconds(5));

  EXPECT_EQ(bench.supervisor.state(), State::kLand);
  EXPECT_EQ(bench.last_ack, AckResult::kOverruled);
}

TEST_F(SupervisorFlight, ALandingEndsDisarmedOnceItIsDown) {
  const std::uint32_t nonce = bench.nonce();
  bench.has_heartbeat = false;
  bench.run(milliseconds(1002));
  ASSERT_EQ(bench.supervisor.state(), State::kLand);

  bench.facts.is_down = true;
  bench.step();

  EXPECT_EQ(bench.supervisor.state(), State::kDisarmed);
  EXPECT_EQ(bench.supervisor.reason(), StateReason::kLanded);
  EXPECT_NE(bench.nonce(), nonce);
}

// Before the motors turn the control law says so.
TEST_F(SupervisorFlight, ToBeDownEndsALandingAndNothingElse) {
  bench.facts.is_down = true;

  EXPECT_FALSE(bench.leaves(State::kArmed, seconds(1)).has_value());
}

TEST_F(SupervisorFlight, AFaultyLinkHoldsUntilItIsSoundAndASetpointComes) {
  bench.facts.is_link_faulty = true;
  bench.step();
  ASSERT_EQ(bench.supervisor.state(), State::kHold);
  EXPECT_EQ(bench.supervisor.reason(), StateReason::kLinkFault);
  EXPECT_EQ(bench.send_setpoint(), AckResult::kOverruled);
  EXPECT_EQ(bench.supervisor.state(), State::kHold);

  bench.facts.is_link_faulty = false;
  bench.step();
  ASSERT_EQ(bench.supervisor.state(), State::kHold);

  EXPECT_EQ(bench.send_setpoint(), AckResult::kFlown);
  EXPECT_TRUE(bench.is_armed());
}

TEST_F(SupervisorFlight, ALinkThatIsFaultyForASecondLandsThoughSetpointsCome) {
  bench.facts.is_link_faulty = true;
  bench.step();

  const std::optional<Duration> held = bench.leaves(State::kHold, seconds(3));

  ASSERT_TRUE(held.has_value());
  EXPECT_LE(*held, seconds(1));
  EXPECT_EQ(bench.supervisor.state(), State::kLand);
}

TEST_F(SupervisorFlight, DisarmingInFlightIsALanding) {
  bench.request = ArmRequest::kDisarm;

  bench.run(milliseconds(300));

  EXPECT_EQ(bench.supervisor.state(), State::kLand);
  EXPECT_EQ(bench.supervisor.reason(), StateReason::kHostRequest);
}

TEST_F(SupervisorFlight, DisarmingOnTheGroundStopsTheMotors) {
  bench.facts.is_on_ground = true;
  bench.request = ArmRequest::kDisarm;

  bench.run(milliseconds(300));

  EXPECT_EQ(bench.supervisor.state(), State::kDisarmed);
  EXPECT_EQ(bench.supervisor.reason(), StateReason::kHostRequest);
}

TEST_F(SupervisorFlight, TwoDisarmingsAreTooFew) {
  bench.send_arm(ArmRequest::kDisarm);
  bench.send_arm(ArmRequest::kDisarm);

  EXPECT_FALSE(bench.leaves(State::kArmed, seconds(2)).has_value());
}

TEST_F(SupervisorFlight, ThreeDisarmingsWithAnArmingInBetweenDoNothing) {
  bench.send_arm(ArmRequest::kDisarm);
  bench.send_arm(ArmRequest::kDisarm);
  bench.send_arm(ArmRequest::kArm);
  bench.send_arm(ArmRequest::kDisarm);

  EXPECT_FALSE(bench.leaves(State::kArmed, seconds(2)).has_value());
}

TEST_F(SupervisorFlight, ThreeDisarmingsHalfASecondApartDoNothing) {
  for (int i = 0; i < 5; ++i) {
    bench.send_arm(ArmRequest::kDisarm);
    bench.run(milliseconds(500));
    ASSERT_TRUE(bench.is_armed());
  }
}

TEST_F(SupervisorFlight, NoArmCommandForAMinuteDisarmsNothing) {
  bench.request.reset();

  EXPECT_FALSE(bench.leaves(State::kArmed, seconds(60)).has_value());
}

TEST_F(SupervisorFlight, KillWithAnotherNumberDoesNothing) {
  Kill kill;
  kill.kill_magic = static_cast<KillMagic>(static_cast<std::uint32_t>(KillMagic::kMagic) ^ 1U);

  bench.supervisor.on_kill(kill);

  EXPECT_TRUE(bench.is_armed());
}

TEST_F(SupervisorFlight, KillIsFinal) {
  Kill kill;
  kill.kill_magic = KillMagic::kMagic;
  bench.supervisor.on_kill(kill);
  ASSERT_EQ(bench.supervisor.state(), State::kKilled);
  bench.request = ArmRequest::kArm;
  bench.facts.is_on_ground = true;
  bench.facts.is_down = true;

  EXPECT_FALSE(bench.leaves(State::kKilled, seconds(10)).has_value());
  EXPECT_EQ(bench.supervisor.reason(), StateReason::kKill);
  EXPECT_EQ(bench.last_ack, AckResult::kOverruled);
}

TEST(Supervisor, KillIsHeardOnTheGroundToo) {
  SupervisorBench bench;
  Kill kill;
  kill.kill_magic = KillMagic::kMagic;
  bench.supervisor.on_kill(kill);
  bench.request = ArmRequest::kArm;

  EXPECT_FALSE(bench.leaves(State::kKilled, seconds(3)).has_value());
}

struct Trouble {
  std::string name;
  std::function<void(VehicleFacts&)> happen;
  StateReason reason{};
};

std::string trouble_name(const ::testing::TestParamInfo<Trouble>& info) {
  return info.param.name;
}

class InFlightTroubleWith : public ::testing::TestWithParam<Trouble> {
 public:
  SupervisorBench bench;
};

TEST_P(InFlightTroubleWith, LandsAtOnceAndTellsWhy) {
  ASSERT_TRUE(bench.take_off());

  GetParam().happen(bench.facts);
  bench.step();

  EXPECT_EQ(bench.supervisor.state(), State::kLand);
  EXPECT_EQ(bench.supervisor.reason(), GetParam().reason);
}

TEST_P(InFlightTroubleWith, LandsFromAHoldToo) {
  ASSERT_TRUE(bench.take_off());
  bench.has_setpoints = false;
  bench.run(milliseconds(300));
  ASSERT_EQ(bench.supervisor.state(), State::kHold);

  GetParam().happen(bench.facts);
  bench.step();

  EXPECT_EQ(bench.supervisor.state(), State::kLand);
}

INSTANTIATE_TEST_SUITE_P(
    Supervisor,
    InFlightTroubleWith,
    ::testing::Values(
        Trouble{"Sensors", [](VehicleFacts& f) { f.has_sensors = false; }, StateReason::kSensors},
        Trouble{"Escs", [](VehicleFacts& f) { f.has_escs = false; }, StateReason::kEsc},
        Trouble{"AnEmptyBattery",
                [](VehicleFacts& f) { f.battery = BattStatus::kEmpty; },
                StateReason::kBattery},
        Trouble{"AnotherVehicle",
                [](VehicleFacts& f) { f.has_foreign_vehicle = true; },
                StateReason::kForeignVehicle}),
    trouble_name);

TEST_F(SupervisorFlight, ALowBatteryIsToldButFlownOn) {
  bench.facts.battery = BattStatus::kLow;

  EXPECT_FALSE(bench.leaves(State::kArmed, seconds(5)).has_value());
  EXPECT_TRUE(bench.supervisor.report(bench.now).flag_batt_low);
  EXPECT_FALSE(bench.supervisor.report(bench.now).flag_batt_empty);
}

TEST_F(SupervisorFlight, EscCommandsAreOfNoAccountOutsideOfDirectMode) {
  bench.has_setpoints = false;
  bool is_on = false;
  for (const Time end = bench.now + milliseconds(250); bench.now < end;) {
    bench.step();
    is_on = bench.supervisor.on_esc_command(true, bench.now) || is_on;
  }

  EXPECT_FALSE(is_on);
  EXPECT_EQ(bench.supervisor.state(), State::kHold);
}

TEST_F(SupervisorFlight, TheReportSaysWhatIsKnown) {
  const VehState report = bench.supervisor.report(bench.now);

  EXPECT_EQ(report.state, State::kArmed);
  EXPECT_TRUE(report.flag_setpoints);
  EXPECT_TRUE(report.flag_host);
  EXPECT_FALSE(report.flag_late);
  EXPECT_FALSE(report.flag_on_ground);
  EXPECT_FALSE(report.flag_direct);
  EXPECT_FALSE(report.flag_sensors || report.flag_batt_low || report.flag_batt_empty ||
               report.flag_esc_failed || report.flag_link_fault || report.flag_foreign);
}

TEST_F(SupervisorFlight, TheReportTellsOfEveryFault) {
  bench.facts.has_sensors = false;
  bench.facts.has_escs = false;
  bench.facts.battery = BattStatus::kEmpty;
  bench.facts.is_link_faulty = true;
  bench.facts.has_foreign_vehicle = true;
  bench.facts.is_on_ground = true;
  bench.step();

  const VehState report = bench.supervisor.report(bench.now);

  EXPECT_TRUE(report.flag_sensors && report.flag_batt_empty && report.flag_esc_failed);
  EXPECT_TRUE(report.flag_link_fault && report.flag_foreign && report.flag_on_ground);
}

TEST(Supervisor, SetpointsAreToldToBeThereAfterHalfASecond) {
  SupervisorBench bench;
  bench.run(SupervisorBench::kStep);

  bench.run(milliseconds(498));
  EXPECT_FALSE(bench.supervisor.report(bench.now).flag_setpoints);
  bench.run(milliseconds(2));

  EXPECT_TRUE(bench.supervisor.report(bench.now).flag_setpoints);
}

}  // namespace
}  // namespace understory::can
