// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "support/team_exchange.hpp"

namespace understory::team {
namespace {

using namespace test;  // NOLINT(google-build-using-namespace)

TEST(TeamClock, SilenceEndsContactAndAWordBringsItBack) {
  Exchange sender = exchange_of(1);
  Exchange receiver = exchange_of(0);
  deliver(sender.due(own_state(), at(1.0)), receiver, at(1.0));

  EXPECT_TRUE(receiver.peers(at(3.0))[0].in_contact);
  EXPECT_FALSE(receiver.peers(at(3.1))[0].in_contact);
  deliver(sender.due(own_state(), at(9.0)), receiver, at(9.0));
  EXPECT_TRUE(receiver.peers(at(9.0))[0].in_contact);
}

// Two that talk to each other; the clock of vehicle 1 is ahead. The way there takes 30 ms, the way
// back 50 ms.
class TwoClocks {
 public:
  explicit TwoClocks(double ahead_s) : ahead_s_(ahead_s) {}

  void talk(double from_s, double to_s) {
    for (int i = 0; from_s + 0.2 * i < to_s; ++i) {
      const double now_s = from_s + 0.2 * i;
      OwnState own = own_state();
      own.trajectory = straight_flight(77, {-1.0, -2.0, 1.0}, {5.0, 2.0, 1.3}, at(10.0 + ahead_s_));
      deliver(one_.due(own, at(now_s + ahead_s_)), zero_, at(now_s + 0.03));
      deliver(zero_.due(own_state(), at(now_s + 0.1)), one_, at(now_s + 0.15 + ahead_s_));
    }
  }
  void restart_one(std::uint64_t session, double ahead_s) {
    one_ = exchange_of(1, session);
    ahead_s_ = ahead_s;
  }
  [[nodiscard]] const Exchange& zero() const { return zero_; }
  [[nodiscard]] const Exchange& one() const { return one_; }

 private:
  Exchange zero_ = exchange_of(0);
  Exchange one_ = exchange_of(1);
  double ahead_s_;
};

TEST(TeamClock, AClockHalfASecondOffIsDetectedEitherWay) {
  for (const double ahead_s : {0.5, -0.5}) {
    TwoClocks team(ahead_s);

    team.talk(1.0, 4.0);

    EXPECT_NEAR(to_seconds(*team.zero().clock_offset(1)), ahead_s, 0.0101);
    EXPECT_NEAR(to_seconds(*team.one().clock_offset(0)), -ahead_s, 0.0101);
    EXPECT_GT(team.zero().counters().rejected_for(Rejection::kClockOff), 10U);
    const Peers peers = team.zero().peers(at(4.0));
    ASSERT_EQ(peers.size(), 1U);
    EXPECT_EQ(peers[0].trajectory, nullptr);
    EXPECT_TRUE(peers[0].in_contact);
    EXPECT_TRUE(peers[0].position_m.isApprox(own_state().position_m, 1e-3));
  }
}

TEST(TeamClock, AClockThatIsALittleOffIsCorrected) {
  for (const double ahead_s : {0.1, -0.1}) {
    TwoClocks team(ahead_s);

    team.talk(1.0, 4.0);

    EXPECT_EQ(rejections(team.zero().counters()), 0U);
    const Peer peer = team.zero().peers(at(4.0))[0];
    ASSERT_NE(peer.trajectory, nullptr);
    EXPECT_NEAR(to_seconds(peer.trajectory->start), 10.0, 0.0111);
    EXPECT_NEAR(to_seconds(peer.trajectory->depth_stamp), 10.0, 0.0111);
    EXPECT_NEAR(to_seconds(peer.stated_at), 3.8, 0.0111);
  }
}

// A frame that was long on its way says nothing of the clock.
TEST(TeamClock, ALateWordIsNotAClockThatIsOff) {
  Exchange sender = exchange_of(1);
  Exchange receiver = exchange_of(0);
  for (int i = 0; i < 10; ++i) {
    const double now_s = 1.0 + 0.2 * i;
    const double delay_s = i == 5 ? 3.0 : 0.05;
    deliver(sender.due(own_state(), at(now_s)), receiver, at(now_s + delay_s));
  }

  EXPECT_EQ(receiver.counters().rejected_for(Rejection::kClockOff), 0U);
}

TEST(TeamClock, AVehicleThatRestartsIsHeardAtOnceAndItsFormerTrajectoryForgotten) {
  TwoClocks team(0.0);
  team.talk(100.0, 110.0);
  ASSERT_NE(team.zero().peers(at(110.0))[0].trajectory, nullptr);
  const std::uint64_t states_before = team.zero().counters().accepted[0].samples;

  Exchange receiver = team.zero();
  Exchange restarted = exchange_of(1, kSession + 110'000'000);
  OwnState own = own_state();
  own.position_m = Vector3d(0.0, 0.0, 0.0);
  deliver(restarted.due(own, at(110.5)), receiver, at(110.55));

  EXPECT_EQ(receiver.counters().accepted[0].samples, states_before + 1);
  EXPECT_TRUE(receiver.peers(at(110.6))[0].position_m.isZero());
  EXPECT_EQ(receiver.peers(at(110.6))[0].trajectory, nullptr);
}

TEST(TeamClock, ARestartedClockIsEstimatedAnew) {
  TwoClocks team(0.0);
  team.talk(1.0, 10.0);

  team.restart_one(kSession + 10'000'000, 0.5);
  team.talk(10.0, 11.0);

  EXPECT_NEAR(to_seconds(*team.zero().clock_offset(1)), 0.5, 0.0101);
}

TEST(TeamClock, TilesOfARestartedVehicleReplaceItsFormerOnes) {
  Exchange receiver = exchange_of(0);
  Rng rng(3);
  MapSnapshot map = unknown_map();
  Exchange before = exchange_of(1);
  for (int i = 0; i < 100; ++i) {
    change_tile(map, 5, rng);
    (void)before.on_map(map, at(20.0 * i));
    deliver(before.due(own_state(), at(20.0 * i + 10.0)), receiver, at(20.0 * i + 10.0));
  }

  Exchange after = exchange_of(1, kSession + 1'000'000);
  change_tile(map, 5, rng);
  const MapSnapshotPtr newest = after.on_map(map, at(3000.0));
  deliver(after.due(own_state(), at(3010.0)), receiver, at(3010.0));

  EXPECT_EQ(digest_of(*receiver.on_map(unknown_map(), at(3010.0))), digest_of(*newest));
}

}  // namespace
}  // namespace understory::team
