// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/link/vehicle_station.hpp"

#include <gtest/gtest.h>

#include "support/station_pair.hpp"

namespace understory::can {
namespace {

using std::chrono::hours;
using std::chrono::milliseconds;
using std::chrono::seconds;
using test::FrameList;
using test::messages_in;
using test::StationPair;

struct Rate {
  std::uint16_t id = 0;
  std::size_t in_ten_seconds = 0;
};

std::size_t count_of(std::uint16_t id, const std::vector<PortFrame>& frames) {
  return static_cast<std::size_t>(std::count_if(
      frames.begin(), frames.end(), [id](const PortFrame& frame) { return frame.frame.id == id; }));
}

TEST(VehicleStation, SendsEachMessageAsOftenAsTheProtocolSays) {
  StationPair pair;
  pair.has_host = false;

  pair.run(seconds(10));

  for (const Rate& rate : {Rate{OdoPosXy::kId, 1000},
                           Rate{OdoRate::kId, 1000},
                           Rate{EscRpm::kId, 1000},
                           Rate{VehState::kId, 500},
                           Rate{VehHb::kId, 100},
                           Rate{EscStat0::kId, 100},
                           Rate{EscStat3::kId, 100},
                           Rate{Battery::kId, 50},
                           Rate{VehLink::kId, 10}}) {
    EXPECT_EQ(count_of(rate.id, pair.from_vehicle), rate.in_ten_seconds) << rate.id;
  }
}

TEST(VehicleStation, SendsOdometryTwoHundredTimesASecondIfConfigured) {
  VehicleStationConfig config;
  config.rate_hz = 200.0;
  StationPair pair(config);

  pair.run(seconds(1));

  EXPECT_NEAR(static_cast<double>(count_of(OdoVel::kId, pair.from_vehicle)), 200.0, 34.0)
      << "steps of 2 ms";
}

TEST(VehicleStation, AfterAStandstillWhatWasMissedIsNotMadeUpFor) {
  StationPair pair;
  pair.has_host = false;
  pair.run(seconds(1));
  pair.forget_records();

  pair.now += seconds(10);
  pair.run(milliseconds(100));

  EXPECT_LE(count_of(OdoVel::kId, pair.from_vehicle), 11U);
}

TEST(VehicleStation, WhenItsClockIsSetBackTelemetryGoesOn) {
  StationPair pair;
  pair.has_host = false;
  pair.run(seconds(1));
  pair.forget_records();

  pair.now -= hours(2);
  pair.run(seconds(1));

  EXPECT_GE(count_of(OdoVel::kId, pair.from_vehicle), 99U);
  EXPECT_GE(count_of(VehState::kId, pair.from_vehicle), 49U);
}

TEST(VehicleStation, AnswersAPingAtOnceWithItsTime) {
  StationPair pair({}, -hours(2));
  pair.has_host = false;
  Ping ping;
  ping.ping_seq = 201;

  pair.pass_up(*encode(ping, 0));

  const auto pongs = messages_in<Pong>(pair.from_vehicle);
  ASSERT_EQ(pongs.size(), 1U);
  EXPECT_EQ(pongs[0].pong_seq, 201U);
  EXPECT_EQ(pongs[0].pong_t2_us, wire_time_us(pair.vehicle_now()));
}

TEST(VehicleStation, TellsTheDelayOfEverySetpoint) {
  StationPair pair;
  ASSERT_TRUE(pair.take_off());
  WireSetpoint wire;
  wire.setpoint = *pair.setpoint;
  wire.time_wire_us = wire_time_us(pair.now - milliseconds(37));
  wire.seq = 111;
  pair.has_host = false;
  pair.run(milliseconds(300));  // any number is the next
  pair.forget_records();
  wire.time_wire_us = wire_time_us(pair.now - milliseconds(37));

  for (std::uint8_t counter = 0; counter < 4; ++counter) {  // the counters are new too
    const FrameSet frames = encode_setpoint(wire, counter).value();
    for (const Frame& frame : frames) {
      pair.pass_up(frame);
    }
  }

  const auto acks = messages_in<SpAck>(pair.from_vehicle);
  ASSERT_FALSE(acks.empty());
  EXPECT_EQ(acks[0].ack_result, AckResult::kFlown);
  EXPECT_EQ(acks[0].ack_seq, 111U);
  EXPECT_EQ(acks[0].ack_delay_us, 37'000U);
}

TEST(VehicleStation, MotorsStandStillUntilItIsArmed) {
  StationPair pair;
  for (int i = 0; i < 1000; ++i) {
    pair.step();
    ASSERT_EQ(pair.commands, MotorCommands{});
  }
}

TEST(VehicleStation, MotorsTurnOnceItIsArmed) {
  StationPair pair;
  ASSERT_TRUE(pair.take_off());

  pair.step();

  for (const double command : pair.commands) {
    EXPECT_GT(command, 0.2);
  }
}

TEST(VehicleStation, MotorsStopInTheStepAfterAKill) {
  StationPair pair;
  ASSERT_TRUE(pair.take_off());
  Kill kill;
  kill.kill_magic = KillMagic::kMagic;
  pair.pass_up(*encode(kill, 9));

  pair.step();

  EXPECT_EQ(pair.commands, MotorCommands{});
}

TEST(VehicleStation, AKillIsHeardWhateverItsCounter) {
  StationPair pair;
  ASSERT_TRUE(pair.take_off());
  Kill kill;
  kill.kill_magic = static_cast<KillMagic>(0);
  pair.pass_up(*encode(kill, 2));
  kill.kill_magic = KillMagic::kMagic;
  Frame broken = *encode(kill, 3);
  broken.data[4] ^= 1U;
  pair.pass_up(broken);
  pair.step();
  ASSERT_EQ(pair.vehicle_state(), State::kArmed);

  pair.pass_up(*encode(kill, 3));
  pair.step();

  EXPECT_EQ(pair.vehicle_state(), State::kKilled);
}

// Nobody sends this message in this mode, so nothing would ever make good for the errors.
TEST(VehicleStation, BrokenFramesOfAMessageThatItDoesNotUseDoNotHoldIt) {
  StationPair pair;
  ASSERT_TRUE(pair.take_off());
  Frame broken;
  broken.id = EscCmd::kId;

  for (int i = 0; i < 20; ++i) {
    pair.pass_up(broken);
  }
  pair.run(seconds(1));

  EXPECT_EQ(pair.vehicle_state(), State::kArmed);
}

class BrokenFramesOf : public ::testing::TestWithParam<std::uint16_t> {};

TEST_P(BrokenFramesOf, WhatItNeedsHoldItUntilTheyEnd) {
  StationPair pair;
  ASSERT_TRUE(pair.take_off());
  Frame broken;
  broken.id = GetParam();
  for (int i = 0; i < 5; ++i) {
    pair.pass_up(broken);
  }
  pair.step();
  ASSERT_EQ(pair.vehicle_state(), State::kHold);
  EXPECT_TRUE(
      pair.host.vehicle()->flag_link_fault ||
      pair.run_until([&] { return pair.host.vehicle()->flag_link_fault; }, milliseconds(40)));

  const auto back =
      pair.run_until([&] { return pair.vehicle_state() == State::kArmed; }, milliseconds(500));

  EXPECT_TRUE(back.has_value());
}

INSTANTIATE_TEST_SUITE_P(VehicleStation,
                         BrokenFramesOf,
                         ::testing::Values(SpVel::kId, SpCommit::kId, ArmCmd::kId, HostHb::kId));

TEST(VehicleStation, ReportsWhatItHearsOfTheLink) {
  StationPair pair;
  ASSERT_TRUE(pair.take_off());
  pair.up_filter = [](const Frame& frame) {
    return frame.id != SpAcc::kId || frame.data[1] % 4 != 0;
  };

  pair.run(seconds(2));

  const VehLink link = messages_in<VehLink>(pair.from_vehicle).back();
  EXPECT_GT(link.vl_rx_ok, 500U);
  EXPECT_GT(link.vl_lost, 10U);
  EXPECT_GT(link.vl_torn, 10U);
  EXPECT_EQ(link.vl_crc_err, 0U);
}

TEST(VehicleStation, TellsOfAFailedEsc) {
  StationPair pair;
  pair.run(seconds(1));
  pair.readings.escs[2].error = EscErr::kFailed;
  pair.forget_records();

  pair.run(milliseconds(200));

  EXPECT_EQ(pair.vehicle_state(), State::kFault);
  EXPECT_EQ(messages_in<EscRpm>(pair.from_vehicle).back().esc_ok_mask, 0b1011U);
  EXPECT_EQ(messages_in<EscStat2>(pair.from_vehicle).back().esc_err2, EscErr::kFailed);
  EXPECT_EQ(messages_in<VehHb>(pair.from_vehicle).back().veh_health, VehHealth::kFault);
}

TEST(VehicleStation, AHotEscIsToldButFlownOn) {
  StationPair pair;
  ASSERT_TRUE(pair.take_off());
  pair.readings.escs[1].error = EscErr::kHot;

  pair.run(seconds(1));

  EXPECT_EQ(pair.vehicle_state(), State::kArmed);
  EXPECT_EQ(messages_in<EscStat1>(pair.from_vehicle).back().esc_err1, EscErr::kHot);
}

TEST(VehicleStation, AStateThatIsNotFiniteIsNotTold) {
  StationPair pair;
  pair.readings.state.velocity_mps.x() = std::numeric_limits<double>::quiet_NaN();

  pair.run(seconds(1));

  EXPECT_EQ(count_of(OdoVel::kId, pair.from_vehicle), 0U);
  EXPECT_EQ(pair.problem(), LinkProblem::kNoVehicle);
}

TEST(VehicleStation, AWarningIsPartOfItsHeartbeat) {
  StationPair pair;
  pair.run(seconds(1));
  EXPECT_EQ(messages_in<VehHb>(pair.from_vehicle).back().veh_health, VehHealth::kGood);

  pair.readings.battery.status = BattStatus::kLow;
  pair.run(milliseconds(200));

  EXPECT_EQ(messages_in<VehHb>(pair.from_vehicle).back().veh_health, VehHealth::kWarning);
}

}  // namespace
}  // namespace understory::can
