// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "support/supervisor_bench.hpp"

namespace understory::can {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using test::SupervisorBench;

// Motors turn; `now` is when the last command came.
struct SupervisorDirect : public ::testing::Test {
  SupervisorDirect() {
    EXPECT_TRUE(bench.take_off());
    bench.is_zero = false;
    bench.send_esc_command(false);
    bench.next_setpoint = bench.now + milliseconds(10);
  }

  SupervisorBench bench{true};
};

TEST_F(SupervisorDirect, CommandsAreCarriedOut) {
  EXPECT_TRUE(bench.is_output_on);
  EXPECT_FALSE(bench.leaves(State::kArmed, seconds(5)).has_value());
  EXPECT_TRUE(bench.supervisor.is_command_fresh(bench.now));
  EXPECT_TRUE(bench.supervisor.report(bench.now).flag_direct);
}

TEST_F(SupervisorDirect, ATenthSecondOfSilenceStopsTheMotors) {
  bench.has_setpoints = false;

  bench.run(milliseconds(98));
  EXPECT_TRUE(bench.supervisor.is_command_fresh(bench.now));
  bench.run(milliseconds(2));

  EXPECT_FALSE(bench.supervisor.is_command_fresh(bench.now));
  EXPECT_TRUE(bench.is_armed());
}

TEST_F(SupervisorDirect, ASecondOfSilenceDisarmsInFlightToo) {
  bench.has_setpoints = false;

  EXPECT_EQ(bench.leaves(State::kArmed, seconds(2)), seconds(1));

  EXPECT_EQ(bench.supervisor.state(), State::kDisarmed);
  EXPECT_EQ(bench.supervisor.reason(), StateReason::kEscCmdSilence);
}

TEST_F(SupervisorDirect, AfterASilenceTheMotorsStartFromAStandstill) {
  bench.has_setpoints = false;
  bench.run(milliseconds(100));
  bench.send_esc_command(false);
  ASSERT_FALSE(bench.is_output_on);
  EXPECT_FALSE(bench.supervisor.is_command_fresh(bench.now));

  bench.send_esc_command(true);
  EXPECT_TRUE(bench.is_output_on);
  bench.send_esc_command(false);

  EXPECT_TRUE(bench.is_output_on);
}

TEST_F(SupervisorDirect, CommandsThatAreNotZeroAfterASilenceFeedNoWatchdog) {
  bench.has_setpoints = false;
  bench.run(milliseconds(100));
  bench.has_setpoints = true;

  EXPECT_EQ(bench.leaves(State::kArmed, seconds(2)), milliseconds(900));
}

TEST_F(SupervisorDirect, ASilenceJustBelowATenthSecondIsNone) {
  bench.has_setpoints = false;
  bench.run(milliseconds(98));

  bench.send_esc_command(false);

  EXPECT_TRUE(bench.is_output_on);
}

TEST_F(SupervisorDirect, WithoutAHeartbeatItDisarms) {
  bench.has_heartbeat = false;

  bench.run(milliseconds(1100));

  EXPECT_EQ(bench.supervisor.state(), State::kDisarmed);
  EXPECT_EQ(bench.supervisor.reason(), StateReason::kHostSilence);
  EXPECT_FALSE(bench.supervisor.is_command_fresh(bench.now));
}

TEST_F(SupervisorDirect, AFaultyLinkCannotBeHeldAndChangesNothing) {
  bench.facts.is_link_faulty = true;

  EXPECT_FALSE(bench.leaves(State::kArmed, seconds(2)).has_value());
}

TEST_F(SupervisorDirect, KillStopsTheMotors) {
  Kill kill;
  kill.kill_magic = KillMagic::kMagic;

  bench.supervisor.on_kill(kill);

  EXPECT_FALSE(bench.supervisor.is_command_fresh(bench.now));
  bench.send_esc_command(true);
  EXPECT_FALSE(bench.is_output_on);
}

TEST(Supervisor, InDirectModeNothingTurnsBeforeArming) {
  SupervisorBench bench(true);

  bench.run(seconds(2));

  EXPECT_FALSE(bench.is_output_on);
  EXPECT_FALSE(bench.supervisor.is_command_fresh(bench.now));
}

// What a file with this one line gives; an error if it is refused.
SupervisorConfig config_of(const std::string& line) {
  SupervisorConfig config;
  visit_document(config, *config_text_reader(line, "supervisor.yaml"));
  return config;
}

TEST(SupervisorConfig, TimeOutsMayBeShortenedButNotLengthened) {
  const SupervisorConfig defaults;
  for (const auto& [name, most_s] :
       {std::pair("late_s", defaults.late_s),
        std::pair("hold_s", defaults.hold_s),
        std::pair("land_s", defaults.land_s),
        std::pair("esc_zero_s", defaults.esc_zero_s),
        std::pair("reach_m", defaults.reach_m),
        std::pair("max_error_m", defaults.max_error_m),
        std::pair("max_speed_mps", defaults.max_speed_mps),
        std::pair("max_acceleration_mps2", defaults.max_acceleration_mps2)}) {
    const std::string key = std::string(name) + ": ";
    EXPECT_NO_THROW(config_of(key + std::to_string(0.5 * most_s))) << name;
    EXPECT_THROW(config_of(key + std::to_string(1.01 * most_s)), ConfigError) << name;
  }
}

TEST(SupervisorConfig, TheDefaultsAreThoseOfTheProtocol) {
  const SupervisorConfig config;

  EXPECT_EQ(config.late_s, 0.05);
  EXPECT_EQ(config.hold_s, 0.25);
  EXPECT_EQ(config.land_s, 1.0);
  EXPECT_EQ(config.esc_zero_s, 0.1);
  EXPECT_EQ(config.steady_s, 0.5);
  EXPECT_EQ(config.reach_m, 1.0);
}

TEST(SupervisorConfig, TheTimeOfSetpointsBeforeArmingMayOnlyBeLengthened) {
  EXPECT_EQ(config_of("steady_s: 2.0").steady_s, 2.0);
  EXPECT_THROW(config_of("steady_s: 0.4"), ConfigError);
}

TEST(SupervisorConfig, AShorterTimeOutActsSooner) {
  SupervisorConfig config;
  config.hold_s = 0.1;
  SupervisorBench bench(false, config);
  ASSERT_TRUE(bench.take_off());
  ASSERT_EQ(bench.send_setpoint(), AckResult::kFlown);
  bench.has_setpoints = false;

  EXPECT_EQ(bench.leaves(State::kArmed, seconds(1)), milliseconds(100));
}

}  // namespace
}  // namespace understory::can
