// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/link/host_station.hpp"

#include <gtest/gtest.h>

#include "support/station_pair.hpp"

namespace understory::can {
namespace {

using std::chrono::hours;
using std::chrono::milliseconds;
using std::chrono::seconds;
using test::messages_in;
using test::StationPair;

constexpr bool is_setpoint(const Frame& frame) {
  return frame.id >= SpPosXy::kId && frame.id <= SpCommit::kId;
}

std::size_t setpoints_in(const std::vector<PortFrame>& frames) {
  return messages_in<SpCommit>(frames).size();
}

TEST(HostStation, BeforeItHearsAVehicleItSendsOnlyHeartbeatsPingsAndDisarming) {
  StationPair pair;
  pair.is_down_on = false;
  pair.host.ask_arm();

  pair.run(seconds(3));

  EXPECT_EQ(pair.problem(), LinkProblem::kNoVehicle);
  EXPECT_EQ(pair.host_state(), HostState::kWaiting);
  EXPECT_EQ(setpoints_in(pair.from_host), 0U);
  EXPECT_EQ(messages_in<HostHb>(pair.from_host).size(), 30U);
  EXPECT_EQ(messages_in<Ping>(pair.from_host).size(), 15U);
  EXPECT_EQ(messages_in<HostLink>(pair.from_host).size(), 3U);
  for (const ArmCmd& command : messages_in<ArmCmd>(pair.from_host)) {
    EXPECT_EQ(command.arm_request, ArmRequest::kDisarm);
    EXPECT_EQ(command.arm_token, 0U);
  }
}

TEST(HostStation, IsReadyWithinHalfASecondOfHearingTheVehicle) {
  StationPair pair;

  const auto ready =
      pair.run_until([&] { return pair.host_state() == HostState::kReady; }, seconds(2));

  ASSERT_TRUE(ready.has_value());
  EXPECT_LE(*ready, milliseconds(500));
  EXPECT_EQ(pair.problem(), LinkProblem::kNone);
}

TEST(HostStation, ArmsOnlyWhenAskedAndThenWithinASecond) {
  StationPair pair;
  pair.run(seconds(5));
  ASSERT_EQ(pair.vehicle_state(), State::kDisarmed);

  pair.host.ask_arm();
  pair.run(milliseconds(20));
  EXPECT_EQ(pair.host_state(), HostState::kArming);
  const auto armed =
      pair.run_until([&] { return pair.host_state() == HostState::kFlying; }, seconds(2));

  ASSERT_TRUE(armed.has_value());
  EXPECT_LE(*armed, seconds(1));
  EXPECT_EQ(pair.vehicle_state(), State::kArmed);
}

TEST(HostStation, ArmCommandIsSentTenTimesASecondAndAtOnceOnAChange) {
  StationPair pair;
  pair.run(milliseconds(1030));
  pair.forget_records();

  pair.host.ask_arm();
  pair.run(milliseconds(10));
  ASSERT_EQ(messages_in<ArmCmd>(pair.from_host).size(), 1U);
  EXPECT_EQ(messages_in<ArmCmd>(pair.from_host)[0].arm_request, ArmRequest::kArm);
  pair.run(seconds(1));
  EXPECT_EQ(messages_in<ArmCmd>(pair.from_host).size(), 11U);
  pair.run(milliseconds(50));
  pair.host.ask_disarm();
  pair.forget_records();
  pair.run(milliseconds(10));

  ASSERT_EQ(messages_in<ArmCmd>(pair.from_host).size(), 1U);
  EXPECT_EQ(messages_in<ArmCmd>(pair.from_host)[0].arm_request, ArmRequest::kDisarm);
}

TEST(HostStation, ArmCommandCarriesSessionAndTokenOfTheVehiclesNonce) {
  StationPair pair;
  pair.run(seconds(1));
  pair.host.ask_arm();
  pair.forget_records();

  pair.run(milliseconds(10));

  const ArmCmd command = messages_in<ArmCmd>(pair.from_host).at(0);
  EXPECT_EQ(command.arm_session, 40U);
  EXPECT_EQ(command.arm_token, arm_token(pair.host.vehicle()->state_nonce, 40));
}

class HostWithVehicleClock : public ::testing::TestWithParam<Duration> {};

TEST_P(HostWithVehicleClock, KnowsTheTimeOfOdometryByItsOwn) {
  StationPair pair({}, GetParam());
  pair.run(seconds(1));

  for (const Time end = pair.now + seconds(20); pair.now < end;) {
    pair.step();
    const Duration age = pair.now - pair.host.odometry().value().time;
    ASSERT_GE(age, Duration(0));
    ASSERT_LE(age, milliseconds(10));
  }
}

TEST_P(HostWithVehicleClock, StampsSetpointsSoThatTheVehicleFliesThem) {
  StationPair pair({}, GetParam());
  ASSERT_TRUE(pair.take_off());

  pair.run(seconds(20));

  EXPECT_EQ(pair.vehicle_state(), State::kArmed);
  for (const SpAck& ack : messages_in<SpAck>(pair.from_vehicle)) {
    ASSERT_EQ(ack.ack_result, AckResult::kFlown);
    ASSERT_EQ(ack.ack_delay_us, 0U);
  }
}

INSTANTIATE_TEST_SUITE_P(Clocks,
                         HostWithVehicleClock,
                         ::testing::Values(hours(0), hours(5), -hours(5), -hours(469'999)));

TEST(HostStation, OdometryIsInvalidATenthSecondAfterTheLastAndSetpointsGoOn) {
  StationPair pair;
  ASSERT_TRUE(pair.take_off());
  ASSERT_TRUE(pair.run_until([&] { return pair.host.odometry()->time == pair.now; }, seconds(1)));
  pair.down_filter = [](const Frame& frame) { return frame.id != OdoVel::kId; };

  pair.run(milliseconds(98));
  EXPECT_TRUE(pair.host.is_odometry_valid(pair.now));
  pair.run(milliseconds(2));
  EXPECT_FALSE(pair.host.is_odometry_valid(pair.now));
  pair.forget_records();
  pair.run(milliseconds(390));

  EXPECT_EQ(pair.problem(), LinkProblem::kNone);
  EXPECT_EQ(setpoints_in(pair.from_host), 39U);
}

TEST(HostStation, OdometryOfASensorThatIsLostIsInvalid) {
  StationPair pair;
  pair.run(seconds(1));
  ASSERT_TRUE(pair.host.is_odometry_valid(pair.now));

  pair.readings.has_sensors = false;
  pair.run(milliseconds(20));

  EXPECT_FALSE(pair.host.is_odometry_valid(pair.now));
}

TEST(HostStation, WhileTheVehiclesClockIsNotKnownThereIsNoValidOdometry) {
  StationPair pair;
  pair.down_filter = [](const Frame& frame) { return frame.id != Pong::kId; };

  pair.run(seconds(1));

  ASSERT_FALSE(pair.host.clock().is_set());
  EXPECT_FALSE(pair.host.is_odometry_valid(pair.now));
  EXPECT_EQ(setpoints_in(pair.from_host), 0U);
}

class HostSilence : public ::testing::TestWithParam<std::uint16_t> {};

TEST_P(HostSilence, OfHalfASecondEndsTheSetpointsAndTheWishToFly) {
  StationPair pair;
  ASSERT_TRUE(pair.take_off());
  ASSERT_TRUE(pair.run_until([&] { return messages_in<VehState>(pair.from_vehicle).size() == 2; },
                             seconds(1)));
  pair.down_filter = [](const Frame& frame) { return frame.id != GetParam(); };

  const auto lost =
      pair.run_until([&] { return pair.problem() == LinkProblem::kLost; }, seconds(1));
  ASSERT_TRUE(lost.has_value());
  EXPECT_NEAR(to_seconds(*lost), 0.5, 0.011);
  pair.run(milliseconds(10));
  pair.forget_records();
  pair.run(seconds(2));

  EXPECT_EQ(pair.host_state(), HostState::kFault);
  EXPECT_FALSE(pair.host.is_arm_wanted());
  EXPECT_EQ(setpoints_in(pair.from_host), 0U);
  EXPECT_EQ(messages_in<HostHb>(pair.from_host).size(), 20U);
  EXPECT_EQ(pair.vehicle_state(), State::kLand);
}

INSTANTIATE_TEST_SUITE_P(Of, HostSilence, ::testing::Values(VehState::kId, OdoAtt::kId));

TEST(HostStation, AfterALostLinkItIsReadyAgainInANewSessionButDoesNotArm) {
  StationPair pair;
  ASSERT_TRUE(pair.take_off());
  pair.touch_down();
  pair.is_down_on = false;
  pair.run(seconds(2));
  ASSERT_EQ(pair.problem(), LinkProblem::kLost);

  pair.is_down_on = true;
  pair.run(seconds(5));

  EXPECT_EQ(pair.host_state(), HostState::kReady);
  EXPECT_EQ(pair.vehicle_state(), State::kDisarmed);
  EXPECT_EQ(pair.host.counters().sessions, 2U);
  EXPECT_EQ(messages_in<ArmCmd>(pair.from_host).back().arm_session, 41U);
}

TEST(HostStation, AfterALostLinkItArmsWhenAskedAnew) {
  StationPair pair;
  ASSERT_TRUE(pair.take_off());
  pair.touch_down();
  pair.is_down_on = false;
  pair.run(seconds(2));
  pair.is_down_on = true;
  pair.run(seconds(1));

  pair.host.ask_arm();
  pair.run(seconds(1));

  EXPECT_EQ(pair.vehicle_state(), State::kArmed);
}

TEST(HostStation, EverySessionHasAnotherNumberWhateverEndedTheLast) {
  StationPair pair;
  ASSERT_TRUE(pair.take_off());
  pair.is_down_on = false;
  pair.run(seconds(2));
  const std::uint32_t lost = messages_in<ArmCmd>(pair.from_host).back().arm_session;

  pair.host.begin_session();
  pair.run(seconds(1));

  EXPECT_NE(messages_in<ArmCmd>(pair.from_host).back().arm_session, lost);
}

TEST(HostStation, WhenTheVehicleEndsTheFlightNobodyAsksForAnother) {
  StationPair pair;
  ASSERT_TRUE(pair.take_off());
  pair.readings.battery.status = BattStatus::kEmpty;
  pair.run(milliseconds(100));
  ASSERT_EQ(pair.host_state(), HostState::kLanding);
  pair.touch_down();
  pair.run(seconds(5));
  ASSERT_EQ(pair.vehicle_state(), State::kDisarmed);

  pair.readings.battery.status = BattStatus::kGood;
  pair.run(seconds(5));

  EXPECT_EQ(pair.vehicle_state(), State::kDisarmed);
  EXPECT_FALSE(pair.host.is_arm_wanted());
}

TEST(HostStation, AVehicleThatRestartsInFlightIsNotArmedAgain) {
  StationPair pair;
  ASSERT_TRUE(pair.take_off());

  pair.restart_vehicle(2);
  pair.vehicle_ahead = -hours(3);
  pair.run(seconds(10));

  EXPECT_EQ(pair.vehicle_state(), State::kDisarmed);
  EXPECT_EQ(pair.host_state(), HostState::kReady);
  EXPECT_EQ(pair.commands, MotorCommands{});
  EXPECT_TRUE(pair.host.is_odometry_valid(pair.now));
}

TEST(HostStation, ItsOwnRestartInFlightLandsTheVehicle) {
  StationPair pair;
  ASSERT_TRUE(pair.take_off());

  pair.host = HostStation(HostStationConfig{}, 99);
  pair.run(seconds(2));

  EXPECT_EQ(pair.vehicle_state(), State::kLand);
}

TEST(HostStation, SetpointsThatCannotBeSentAreCountedAndNoPartOfThemIs) {
  StationPair pair;
  ASSERT_TRUE(pair.take_off());

  pair.setpoint->velocity_mps.x() = 33.0;
  pair.run(milliseconds(100));

  EXPECT_EQ(pair.host.counters().sets_refused, 10U);
  EXPECT_EQ(std::count_if(pair.from_host.begin(),
                          pair.from_host.end(),
                          [](const PortFrame& frame) { return is_setpoint(frame.frame); }),
            0);
}

}  // namespace
}  // namespace understory::can
