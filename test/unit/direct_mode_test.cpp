// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "support/station_pair.hpp"

namespace understory::can {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using test::messages_in;
using test::StationPair;

// The host's station does the handshake; ESC_CMD comes from here, every 2 ms.
struct DirectMode : public ::testing::Test {
  DirectMode() {
    pair.setpoint.reset();
    command.esc_cmd_mode = EscCmdMode::kDirect;
    set({0.0, 0.0, 0.0, 0.0});
  }

  void set(const std::array<double, 4>& percent) {
    command.esc_cmd0_percent = percent[0];
    command.esc_cmd1_percent = percent[1];
    command.esc_cmd2_percent = percent[2];
    command.esc_cmd3_percent = percent[3];
  }
  void run(Duration duration) {
    for (const Time end = pair.now + duration; pair.now < end;) {
      pair.pass_up(encode(command, outbox.next()).value());
      pair.step();
    }
  }
  [[nodiscard]] bool arm() {
    run(seconds(1));
    pair.host.ask_arm();
    run(seconds(1));
    pair.readings.is_on_ground = false;
    return pair.vehicle_state() == State::kArmed;
  }
  static VehicleStationConfig config() {
    VehicleStationConfig config;
    config.is_direct = true;
    return config;
  }

  StationPair pair{config()};
  EscCmd command;
  Outbox outbox;
};

TEST_F(DirectMode, CommandsReachTheMotorsOnceArmed) {
  ASSERT_TRUE(arm());

  set({10.0, 20.0, 30.0, 40.0});
  run(milliseconds(10));

  const MotorCommands wanted{0.1, 0.2, 0.3, 0.4};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(pair.commands[i], wanted[i], 2e-4);
  }
}

TEST_F(DirectMode, NothingTurnsBeforeArming) {
  set({10.0, 20.0, 30.0, 40.0});

  run(seconds(1));

  EXPECT_EQ(pair.commands, MotorCommands{});
}

TEST_F(DirectMode, OffIsZeroWhateverTheValuesSay) {
  ASSERT_TRUE(arm());
  set({50.0, 50.0, 50.0, 50.0});
  run(milliseconds(10));
  command.esc_cmd_mode = EscCmdMode::kOff;

  run(milliseconds(10));

  EXPECT_EQ(pair.commands, MotorCommands{});
}

TEST_F(DirectMode, AValueThatIsNotThereIsZero) {
  ASSERT_TRUE(arm());
  set({50.0, kNotAvailable, 50.0, 50.0});

  run(milliseconds(10));

  EXPECT_EQ(pair.commands[1], 0.0);
  EXPECT_NEAR(pair.commands[0], 0.5, 2e-4);
}

TEST_F(DirectMode, ATenthSecondOfSilenceStopsTheMotorsAndASecondDisarms) {
  ASSERT_TRUE(arm());
  set({50.0, 50.0, 50.0, 50.0});
  run(milliseconds(10));

  pair.run(milliseconds(96));
  EXPECT_NE(pair.commands, MotorCommands{});
  pair.run(milliseconds(4));
  EXPECT_EQ(pair.commands, MotorCommands{});
  EXPECT_EQ(pair.vehicle_state(), State::kArmed);
  pair.run(milliseconds(900));

  EXPECT_EQ(pair.vehicle_state(), State::kDisarmed);
}

TEST_F(DirectMode, AfterASilenceOldThrottleIsNotTakenUpAgain) {
  ASSERT_TRUE(arm());
  set({50.0, 50.0, 50.0, 50.0});
  run(milliseconds(10));
  pair.run(milliseconds(200));

  run(milliseconds(100));

  EXPECT_EQ(pair.commands, MotorCommands{});
}

TEST_F(DirectMode, SetpointsAreNotFlown) {
  pair.setpoint.emplace();
  pair.setpoint->position_m = pair.readings.state.position_m;
  ASSERT_TRUE(arm());

  pair.run(milliseconds(100));

  EXPECT_EQ(pair.commands, MotorCommands{});
  EXPECT_TRUE(messages_in<SpAck>(pair.from_vehicle).empty());
}

TEST_F(DirectMode, BrokenSetpointsDoNotForbidArming) {
  Frame broken;
  broken.id = SpVel::kId;
  for (int i = 0; i < 20; ++i) {
    pair.pass_up(broken);
  }

  EXPECT_TRUE(arm());
}

}  // namespace
}  // namespace understory::can
