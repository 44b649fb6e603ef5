// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "support/supervisor_bench.hpp"

namespace understory::can {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using test::SupervisorBench;

TEST(SupervisorNonce, WhatArmedItOnceDoesNotArmItAgain) {
  SupervisorBench bench;
  bench.token = arm_token(bench.nonce(), bench.session);
  bench.request = ArmRequest::kArm;
  bench.run(seconds(1));
  ASSERT_TRUE(bench.is_armed());
  bench.request = ArmRequest::kDisarm;
  bench.run(seconds(1));
  ASSERT_EQ(bench.supervisor.state(), State::kDisarmed);

  bench.request = ArmRequest::kArm;
  bench.run(seconds(3));

  EXPECT_EQ(bench.supervisor.state(), State::kArming);
  EXPECT_EQ(bench.supervisor.reason(), StateReason::kArmToken);
}

TEST(SupervisorNonce, WithTheNewNonceItArmsAgain) {
  SupervisorBench bench;
  ASSERT_TRUE(bench.take_off());
  bench.facts.is_on_ground = true;
  bench.request = ArmRequest::kDisarm;
  bench.run(seconds(1));

  bench.request = ArmRequest::kArm;
  bench.run(seconds(1));

  EXPECT_TRUE(bench.is_armed());
  EXPECT_EQ(bench.supervisor.report(bench.now).state_arm_seq, 2U);
}

// By faults on the ground, which disarm too.
TEST(SupervisorNonce, NoDisarmingLeavesTheNonceAsItWas) {
  SupervisorBench bench;
  int repeated = 0;
  for (int i = 0; i < 1'000'000; ++i) {
    const std::uint32_t before = bench.nonce();
    bench.facts.has_sensors = false;
    bench.supervisor.update(bench.facts, bench.now);
    bench.facts.has_sensors = true;
    bench.supervisor.update(bench.facts, bench.now);
    repeated += bench.nonce() == before ? 1 : 0;
  }

  EXPECT_EQ(repeated, 0);
}

// In flight the host repeats its wish, up to the step in which the vehicle is down.
TEST(SupervisorNonce, WhatWasAskedForInFlightDoesNotArmAfterTheLanding) {
  SupervisorBench bench;
  ASSERT_TRUE(bench.take_off());
  bench.request = ArmRequest::kArm;
  bench.facts.battery = BattStatus::kEmpty;
  bench.run(seconds(1));
  ASSERT_EQ(bench.supervisor.state(), State::kLand);
  bench.facts.battery = BattStatus::kGood;
  bench.request.reset();
  bench.facts.is_down = true;

  bench.step();
  ASSERT_EQ(bench.supervisor.state(), State::kDisarmed);

  EXPECT_FALSE(bench.leaves(State::kDisarmed, seconds(1)).has_value());
}

// Its frames are on the way when the flight ends; why it ended must stay readable all the same.
TEST(SupervisorNonce, TheTokenOfTheFlightThatHasJustEndedIsNotAWishForAnother) {
  SupervisorBench bench;
  bench.token = arm_token(bench.nonce(), bench.session);
  bench.request = ArmRequest::kArm;
  bench.run(seconds(1));
  ASSERT_TRUE(bench.is_armed());
  bench.facts.is_on_ground = false;
  bench.facts.battery = BattStatus::kEmpty;
  bench.run(milliseconds(100));
  ASSERT_EQ(bench.supervisor.state(), State::kLand);
  bench.facts.is_down = true;

  bench.run(milliseconds(400));

  EXPECT_EQ(bench.supervisor.state(), State::kDisarmed);
  EXPECT_EQ(bench.supervisor.reason(), StateReason::kLanded);
  bench.run(milliseconds(300));
  EXPECT_EQ(bench.supervisor.state(), State::kArming) << "half a second is time enough";
}

// What DISARM carries as a token is nobody's business.
TEST(SupervisorNonce, ADisarmWithTheTokenOfTheFlightThatHasJustEndedIsHeeded) {
  SupervisorBench bench;
  ASSERT_TRUE(bench.take_off());
  const std::uint32_t spent = arm_token(bench.nonce(), bench.session);
  bench.facts.is_on_ground = true;
  bench.facts.has_escs = false;
  bench.step();
  bench.facts.has_escs = true;
  bench.step();
  ASSERT_EQ(bench.supervisor.state(), State::kDisarmed);
  bench.send_arm(ArmRequest::kArm);
  bench.step();
  ASSERT_EQ(bench.supervisor.state(), State::kArming);
  bench.token = spent;

  bench.send_arm(ArmRequest::kDisarm);
  bench.step();

  EXPECT_EQ(bench.supervisor.state(), State::kDisarmed);
}

TEST(SupervisorNonce, AfterADisarmingSetpointsMustHaveComeForHalfASecondAgain) {
  SupervisorBench bench;
  ASSERT_TRUE(bench.take_off());
  bench.facts.is_on_ground = true;
  for (int i = 0; i < 3; ++i) {
    bench.send_arm(ArmRequest::kDisarm);
  }
  bench.step();
  ASSERT_EQ(bench.supervisor.state(), State::kDisarmed);
  bench.request = ArmRequest::kArm;

  bench.run(milliseconds(490));
  EXPECT_FALSE(bench.is_armed());
  bench.run(milliseconds(30));

  EXPECT_TRUE(bench.is_armed());
}

TEST(SupervisorNonce, FitsTheSixteenBitsThatItHasOnTheBusAndUsesAllOfThem) {
  SupervisorBench bench;
  std::uint32_t used = 0;
  for (int i = 0; i < 1000; ++i) {
    bench.facts.has_sensors = i % 2 == 0;
    bench.supervisor.update(bench.facts, bench.now);
    ASSERT_LE(bench.nonce(), 0xFFFFU);
    used |= bench.nonce();
  }

  EXPECT_EQ(used, 0xFFFFU);
}

TEST(SupervisorNonce, EveryStartHasANonceOfItsOwn) {
  const SupervisorBench first(false, {}, 1);
  const SupervisorBench second(false, {}, 2);

  EXPECT_NE(first.nonce(), second.nonce());
}

TEST(SupervisorNonce, TheTokenIsTheChecksumOfNonceSessionAndFourLetters) {
  // CRC-32C of 34 12 CD AB 41 52 4D 31.
  EXPECT_EQ(arm_token(0x1234, 0xABCD), 0xCC67E07AU);
}

TEST(SupervisorNonce, AFaultOnTheGroundEndsWithItsCauseButDoesNotArm) {
  SupervisorBench bench;
  bench.run(seconds(1));
  bench.facts.has_escs = false;
  bench.run(milliseconds(100));
  ASSERT_EQ(bench.supervisor.state(), State::kFault);
  EXPECT_EQ(bench.supervisor.reason(), StateReason::kArmEsc);

  bench.facts.has_escs = true;
  bench.run(milliseconds(100));

  EXPECT_EQ(bench.supervisor.state(), State::kDisarmed);
  EXPECT_EQ(bench.supervisor.reason(), StateReason::kNone);
}

TEST(SupervisorNonce, AFaultWhileArmingNeedsANewRow) {
  SupervisorBench bench;
  bench.has_setpoints = false;
  bench.request = ArmRequest::kArm;
  bench.run(seconds(1));
  bench.token = arm_token(bench.nonce(), bench.session);
  bench.facts.has_foreign_vehicle = true;
  bench.run(milliseconds(100));
  ASSERT_EQ(bench.supervisor.state(), State::kFault);

  bench.facts.has_foreign_vehicle = false;
  bench.has_setpoints = true;
  bench.run(seconds(2));

  EXPECT_FALSE(bench.is_armed()) << "the nonce is another one";
}

}  // namespace
}  // namespace understory::can
