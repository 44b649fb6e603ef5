// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <set>
#include <string>

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

// The pair's vehicle, but its heartbeat says something else.
void let_vehicle_say(StationPair& pair, std::uint32_t major, std::uint32_t hash) {
  pair.down_filter = [&pair, major, hash](const Frame& frame) {
    const auto heartbeat = decode<VehHb>(frame);
    if (!heartbeat) {
      return true;
    }
    VehHb other = heartbeat->message;
    other.veh_proto_major = major;
    other.veh_dbc_hash = hash;
    pair.host.on_frame(*encode(other, heartbeat->counter), pair.now);
    return false;
  };
}

class OtherProtocol : public ::testing::TestWithParam<std::pair<std::uint32_t, std::uint32_t>> {};

TEST_P(OtherProtocol, OfTheVehicleIsToldAndNothingIsFlown) {
  StationPair pair;
  let_vehicle_say(pair, GetParam().first, GetParam().second);
  pair.run(seconds(1));
  pair.forget_records();

  pair.host.ask_arm();
  pair.run(seconds(2));

  EXPECT_EQ(pair.problem(), LinkProblem::kOtherProtocol);
  EXPECT_EQ(pair.host_state(), HostState::kFault);
  EXPECT_FALSE(pair.host.is_arm_wanted());
  EXPECT_TRUE(messages_in<SpCommit>(pair.from_host).empty());
  EXPECT_EQ(pair.vehicle_state(), State::kDisarmed);
}

INSTANTIATE_TEST_SUITE_P(Host,
                         OtherProtocol,
                         ::testing::Values(std::pair(kProtocolMajor + 1, kDbcHash),
                                           std::pair(kProtocolMajor, kDbcHash ^ 0x100U)));

TEST(HostLink, AnotherHostOnTheBusIsToldAndNothingIsFlown) {
  StationPair pair;
  ASSERT_TRUE(pair.take_off());

  pair.host.on_other_host();
  pair.run(seconds(2));

  EXPECT_EQ(pair.problem(), LinkProblem::kOtherHost);
  EXPECT_EQ(pair.host_state(), HostState::kFault);
  EXPECT_EQ(pair.vehicle_state(), State::kLand);
}

// The vehicle knows best: it hears what it has not sent.
TEST(HostLink, AVehicleThatHearsAnotherIsToldAndNothingIsFlown) {
  StationPair pair;
  pair.run(seconds(1));

  pair.vehicle->on_foreign_vehicle();
  pair.host.ask_arm();
  pair.run(seconds(2));

  EXPECT_EQ(pair.vehicle_state(), State::kFault);
  EXPECT_EQ(pair.problem(), LinkProblem::kOtherVehicle);
  EXPECT_FALSE(pair.host.is_arm_wanted());
}

TEST(HostLink, ANonceThatChangesAllTheTimeIsTwoVehicles) {
  StationPair pair;
  pair.run(seconds(1));

  for (std::uint64_t i = 0; i < 6; ++i) {
    pair.restart_vehicle(10 + i);
    pair.run(milliseconds(100));
  }

  EXPECT_EQ(pair.problem(), LinkProblem::kOtherVehicle);
}

TEST(HostLink, FlightsOneAfterTheOtherAreOneVehicle) {
  StationPair pair;
  pair.run(seconds(1));
  for (int flight = 0; flight < 10; ++flight) {
    pair.host.ask_arm();
    ASSERT_TRUE(
        pair.run_until([&] { return pair.host_state() == HostState::kFlying; }, seconds(5)));
    pair.host.ask_disarm();
    ASSERT_TRUE(pair.run_until([&] { return pair.host_state() == HostState::kReady; }, seconds(5)));
  }

  EXPECT_EQ(pair.problem(), LinkProblem::kNone);
}

TEST(HostLink, ABusThatIsDownIsToldAndEndsTheWishToFly) {
  StationPair pair;
  ASSERT_TRUE(pair.take_off());

  pair.host.set_bus(false);
  pair.run(milliseconds(20));

  EXPECT_EQ(pair.problem(), LinkProblem::kBus);
  EXPECT_FALSE(pair.host.is_arm_wanted());
}

TEST(HostLink, KillIsRepeatedUntilItIsConfirmed) {
  StationPair pair;
  ASSERT_TRUE(pair.take_off());
  pair.up_filter = [](const Frame& frame) { return frame.id != Kill::kId; };
  pair.host.kill(KillReason::kOperator);
  pair.run(milliseconds(500));
  EXPECT_EQ(messages_in<Kill>(pair.from_host).size(), 50U);
  EXPECT_EQ(messages_in<ArmCmd>(pair.from_host).back().arm_request, ArmRequest::kDisarm);

  pair.up_filter = nullptr;
  pair.run(milliseconds(50));
  pair.forget_records();
  pair.run(seconds(2));

  EXPECT_EQ(pair.vehicle_state(), State::kKilled);
  EXPECT_TRUE(messages_in<Kill>(pair.from_host).empty());
  EXPECT_EQ(pair.commands, MotorCommands{});
}

TEST(HostLink, KillGoesOutEvenWhereNoVehicleIsHeard) {
  StationPair pair;
  pair.is_down_on = false;

  pair.host.kill(KillReason::kSoftware);
  pair.run(milliseconds(20));

  EXPECT_EQ(pair.vehicle_state(), State::kKilled);
}

TEST(HostLink, EverySetThatIsSentIsAnsweredWithItsNumberAndResult) {
  StationPair pair;
  pair.run(seconds(1));
  ASSERT_TRUE(pair.host.last_ack().has_value());
  EXPECT_EQ(pair.host.last_ack()->result, AckResult::kNotArmed);
  const std::uint64_t not_flown = pair.host.counters().sets_not_flown;
  EXPECT_EQ(not_flown, pair.host.counters().sets_sent);

  pair.host.ask_arm();
  pair.run(seconds(1));

  EXPECT_EQ(pair.host.last_ack()->result, AckResult::kFlown);
  EXPECT_EQ(pair.host.last_ack()->set, pair.host.counters().sets_sent);
}

TEST(HostLink, AnAnswerToNoSetOfOursIsNotTakenForOne) {
  StationPair pair;
  ASSERT_TRUE(pair.take_off());
  const std::uint64_t acked = pair.host.last_ack()->set;
  ASSERT_GT(acked, 0U);
  ASSERT_LT(pair.host.counters().sets_sent, 200U);
  SpAck ack;
  ack.ack_seq = 200;  // so far no set had this number

  for (std::uint8_t counter = 0; counter < 4; ++counter) {  // whatever the last one was
    pair.host.on_frame(*encode(ack, counter), pair.now);
  }

  EXPECT_EQ(pair.host.last_ack()->set, acked);
}

TEST(HostLink, OnlyTheAnswerToTheOpenPingCounts) {
  StationPair pair;
  pair.down_filter = [](const Frame& frame) { return frame.id != Pong::kId; };
  pair.run(milliseconds(500));
  ASSERT_FALSE(pair.host.clock().is_set());
  const std::uint32_t open = messages_in<Ping>(pair.from_host).back().ping_seq;
  Pong pong;
  pong.pong_seq = open - 1U;
  pair.host.on_frame(*encode(pong, 0), pair.now);
  EXPECT_FALSE(pair.host.clock().is_set());

  pong.pong_seq = open;
  pair.host.on_frame(*encode(pong, 1), pair.now);

  EXPECT_TRUE(pair.host.clock().is_set());
}

TEST(HostLink, APingIsTimedFromWhenItWasOnTheBus) {
  HostStation host(HostStationConfig{}, 1);
  FrameList sent;
  const Time now = Time(hours(10));
  host.tick(std::nullopt, SpMode::kHold, now, sent);
  const Ping ping = messages_in<Ping>(sent.frames).at(0);
  for (const PortFrame& frame : sent.frames) {
    host.on_sent(frame.frame, now + milliseconds(7));
  }
  Pong pong;
  pong.pong_seq = ping.ping_seq;

  host.on_frame(*encode(pong, 0), now + milliseconds(8));

  EXPECT_EQ(host.clock().round_trip(), milliseconds(1));
}

// Wall clocks are set back while they run.
TEST(HostLink, WhenItsClockIsSetBackHeartbeatsAndPingsGoOn) {
  StationPair pair;
  pair.run(seconds(1));
  pair.now -= hours(1);
  pair.next_tick = pair.now;
  pair.vehicle_ahead += hours(1);
  pair.forget_records();

  pair.run(seconds(1));

  EXPECT_GE(messages_in<HostHb>(pair.from_host).size(), 10U);
  EXPECT_GE(messages_in<Ping>(pair.from_host).size(), 5U);
  EXPECT_GE(messages_in<ArmCmd>(pair.from_host).size(), 10U);
}

TEST(HostLink, EveryProblemHasItsOwnWords) {
  std::set<std::string> words;
  for (int i = 0; i <= static_cast<int>(LinkProblem::kBus); ++i) {
    words.insert(to_string(static_cast<LinkProblem>(i)));
  }

  EXPECT_EQ(words.size(), 8U);
  EXPECT_EQ(words.count("?"), 0U);
}

TEST(HostLink, TooManyWrongFramesAreToldAndFlownOn) {
  StationPair pair;
  ASSERT_TRUE(pair.take_off());
  Frame broken = pair.from_host.empty() ? Frame{} : pair.from_host[0].frame;
  broken.id = VehState::kId;

  for (int i = 0; i < 8; ++i) {
    pair.host.on_frame(broken, pair.now);
  }

  EXPECT_EQ(pair.problem(), LinkProblem::kErrors);
  EXPECT_EQ(pair.host_state(), HostState::kFlying);
}

// What a file with this one line gives; an error if it is refused.
HostStationConfig config_of(const std::string& line) {
  HostStationConfig config;
  visit_document(config, *config_text_reader(line, "host.yaml"));
  return config;
}

TEST(HostStationConfig, HalfASecondIsTheLongestSilence) {
  EXPECT_EQ(config_of("link_timeout_s: 0.2").link_timeout_s, 0.2);
  EXPECT_THROW(config_of("link_timeout_s: 0.6"), ConfigError);
  EXPECT_THROW(config_of("odometry_timeout_s: 0.6"), ConfigError);
}

}  // namespace
}  // namespace understory::can
