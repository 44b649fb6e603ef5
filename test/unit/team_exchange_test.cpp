// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "support/team_exchange.hpp"

#include <algorithm>
#include <limits>

#include <gtest/gtest.h>

namespace understory::team {
namespace {

using namespace test;  // NOLINT(google-build-using-namespace)

TEST(TeamExchange, TellsWhereAVehicleIsAndWhatItDoes) {
  Exchange sender = exchange_of(1);
  Exchange receiver = exchange_of(0);

  deliver(sender.due(own_state(), at(5.0)), receiver, at(5.0));

  const Peers peers = receiver.peers(at(5.1));
  ASSERT_EQ(peers.size(), 1U);
  const Peer& peer = peers[0];
  EXPECT_EQ(peer.id, 1);
  EXPECT_EQ(peer.heard_at, at(5.0));
  EXPECT_EQ(peer.stated_at, at(5.0));
  EXPECT_TRUE(peer.position_m.isApprox(own_state().position_m, 1e-3));
  EXPECT_TRUE(peer.velocity_mps.isApprox(own_state().velocity_mps, 1e-3));
  EXPECT_NEAR(peer.yaw_rad, -2.5, 1e-4);
  EXPECT_EQ(peer.mode, FlightMode::kCollector);
  EXPECT_EQ(peer.state, MissionState::kExplore);
  ASSERT_TRUE(peer.target_m.has_value());
  EXPECT_TRUE(peer.target_m->isApprox(*own_state().target_m, 1e-3));
  EXPECT_EQ(peer.trajectory, nullptr);
  EXPECT_TRUE(peer.in_contact);
  EXPECT_EQ(rejections(receiver.counters()), 0U);
}

TEST(TeamExchange, ATrajectoryIsFlownTheSameAtTheOtherEnd) {
  Exchange sender = exchange_of(1);
  Exchange receiver = exchange_of(0);
  OwnState own = own_state();
  own.trajectory = straight_flight(77, {-1.0, -2.0, 1.0}, {5.0, 2.0, 1.3}, at(5.0));

  deliver(sender.due(own, at(5.0)), receiver, at(5.0));

  const Peers peers = receiver.peers(at(5.0));
  ASSERT_EQ(peers.size(), 1U);
  ASSERT_NE(peers[0].trajectory, nullptr);
  const Trajectory& told = *peers[0].trajectory;
  EXPECT_EQ(told.id, 77U);
  EXPECT_EQ(told.mode, FlightMode::kCollector);
  EXPECT_EQ(told.duration(), own.trajectory->duration());
  for (int i = 400; i < 900; ++i) {
    const double time_s = 0.01 * i;
    const TrajectoryPoint expected = own.trajectory->sample(at(time_s));
    const TrajectoryPoint actual = told.sample(at(time_s));
    ASSERT_LT((actual.position_m - expected.position_m).norm(), 1e-3) << time_s;
    ASSERT_LT((actual.velocity_mps - expected.velocity_mps).norm(), 0.02) << time_s;
    ASSERT_NEAR(actual.yaw_rad, expected.yaw_rad, 1e-4) << time_s;
  }
}

TEST(TeamExchange, ATrajectoryEndsAtRestWhateverWasTold) {
  TrajectorySample moving;
  moving.header = state_sample(1).header;
  moving.trajectory.position.control_points = {{0, 0, 1}, {1, 0, 1}, {2, 0, 1}, {3, 0, 1}};
  moving.trajectory.yaw.control_points = {0.0, 0.5, 1.0, 1.5};

  const auto told = decode_trajectory(encode(moving));

  ASSERT_TRUE(told.has_value());
  const TrajectoryPoint end = told->trajectory.sample(told->trajectory.end());
  EXPECT_TRUE(end.position_m.isApprox(Vector3d(3, 0, 1)));
  EXPECT_TRUE(end.velocity_mps.isZero(0.0));
  EXPECT_TRUE(end.acceleration_mps2.isZero(0.0));
  EXPECT_EQ(end.yaw_rate_radps, 0.0);
}

TEST(TeamExchange, ATrajectoryIsToldOnce) {
  Exchange sender = exchange_of(1);
  OwnState own = own_state();
  own.trajectory = straight_flight(77, {-1.0, -2.0, 1.0}, {5.0, 2.0, 1.3}, at(5.0));

  const std::vector<Sample> first = sender.due(own, at(5.0));
  const std::vector<Sample> second = sender.due(own, at(6.0));
  own.trajectory = straight_flight(78, {-1.0, -2.0, 1.0}, {5.0, 2.0, 1.3}, at(6.0));
  const std::vector<Sample> third = sender.due(own, at(7.0));

  EXPECT_EQ(of_kind(SampleKind::kTrajectory, first).size(), 1U);
  EXPECT_EQ(of_kind(SampleKind::kTrajectory, second).size(), 0U);
  EXPECT_EQ(of_kind(SampleKind::kTrajectory, third).size(), 1U);
}

TEST(TeamExchange, APositionThatIsNotFiniteIsNotTold) {
  Exchange sender = exchange_of(1);
  OwnState own = own_state();
  own.position_m.x() = std::numeric_limits<double>::quiet_NaN();

  EXPECT_TRUE(sender.due(own, at(1.0)).empty());
}

TEST(TeamExchange, StatesAreToldAtTheirRate) {
  Exchange sender = exchange_of(1);

  std::size_t states = 0;
  for (int frame = 0; frame < 150; ++frame) {  // ten seconds at 15 Hz
    states += sender.due(own_state(), at(frame / 15.0)).size();
  }

  EXPECT_EQ(states, 50U);
}

TEST(TeamExchange, ATileIsToldOnceItHasSettled) {
  Exchange sender = exchange_of(1);
  MapSnapshot map = unknown_map();
  Rng rng(1);

  std::vector<double> told_at_s;
  for (int i = 0; i < 100; ++i) {
    const double now_s = 0.1 * i;
    if (i < 30) {  // it changes until 2.9 s
      change_tile(map, 5, rng);
      (void)sender.on_map(map, at(now_s));
    }
    const std::size_t tiles =
        of_kind(SampleKind::kTileBlock, sender.due(own_state(), at(now_s))).size();
    told_at_s.insert(told_at_s.end(), tiles, now_s);
  }

  ASSERT_EQ(told_at_s.size(), 1U);
  EXPECT_NEAR(told_at_s[0], 4.9, 1e-9);
}

TEST(TeamExchange, ATileThatNeverSettlesIsToldAfterTheLongestWait) {
  Exchange sender = exchange_of(1);
  MapSnapshot map = unknown_map();
  Rng rng(1);

  std::vector<double> told_at_s;
  for (int i = 0; i < 250; ++i) {
    const double now_s = 0.1 * i;
    change_tile(map, 5, rng);
    (void)sender.on_map(map, at(now_s));
    const std::size_t tiles =
        of_kind(SampleKind::kTileBlock, sender.due(own_state(), at(now_s))).size();
    told_at_s.insert(told_at_s.end(), tiles, now_s);
  }

  ASSERT_EQ(told_at_s.size(), 2U);
  EXPECT_NEAR(told_at_s[0], 10.0, 1e-9);
  EXPECT_NEAR(told_at_s[1], 20.1, 1e-9);
}

TEST(TeamExchange, ATileThatChangedBackIsNotToldAgain) {
  Exchange sender = exchange_of(1);
  MapSnapshot map = unknown_map();
  Rng rng(1);
  change_tile(map, 5, rng);
  const TilePtr first = map.tiles[5];
  (void)sender.on_map(map, at(0.0));
  ASSERT_EQ(of_kind(SampleKind::kTileBlock, sender.due(own_state(), at(3.0))).size(), 1U);

  change_tile(map, 5, rng);
  (void)sender.on_map(map, at(4.0));
  map.tiles[5] = first;
  ++map.revision;
  (void)sender.on_map(map, at(4.1));

  EXPECT_TRUE(of_kind(SampleKind::kTileBlock, sender.due(own_state(), at(20.0))).empty());
}

TEST(TeamExchange, NoMoreOfTheMapIsToldThanTheRateAllowsAndTheOldestFirst) {
  const std::size_t blocks = TileBlocks(geometry()).count();
  TeamConfig config = team_of(3, 1);
  config.exchange.tile_rate_bytes_per_s = 3000.0;
  Exchange sender(config, geometry(), model(), kSession);
  MapSnapshot map = unknown_map();
  Rng rng(1);
  for (TileSlot slot = geometry().slot_count(); slot-- > 0;) {  // from the last to the first
    change_tile(map, slot, rng);
    (void)sender.on_map(map, at(0.01 * static_cast<double>(map.revision)));
  }

  std::vector<std::uint32_t> told;
  std::size_t bytes = 0;
  for (int i = 0; i < 300; ++i) {
    const double since_s = 0.1 * i;
    for (const Sample& sample :
         of_kind(SampleKind::kTileBlock, sender.due(own_state(), at(3.0 + since_s)))) {
      told.push_back(sample.key.item);
      bytes += sample.payload.size();
    }
    ASSERT_LE(static_cast<double>(bytes), 3000.0 * (1.0 + since_s) + 8500.0);
  }

  EXPECT_EQ(told.size(), blocks);
  EXPECT_TRUE(std::is_sorted(told.rbegin(), told.rend()));
  EXPECT_GT(bytes, 20000U);
}

TEST(TeamExchange, TilesOfABlockAreToldTogether) {
  Exchange sender = exchange_of(1);
  MapSnapshot map = unknown_map();
  Rng rng(1);
  const TileBlocks blocks(geometry());
  const std::vector<TileSlot>& slots = blocks.slots_of(2);
  for (const TileSlot slot : slots) {
    change_tile(map, slot, rng);
    (void)sender.on_map(map, at(0.0));
  }

  const std::vector<Sample> told =
      of_kind(SampleKind::kTileBlock, sender.due(own_state(), at(2.0)));

  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].key.item, 2U);
  EXPECT_EQ(decode_tile_block(told[0].payload)->layers.size(), slots.size());
}

TEST(TeamExchange, ATileThatWasToldIsPartOfTheMap) {
  Exchange sender = exchange_of(1);
  Exchange receiver = exchange_of(0);
  MapSnapshot map = unknown_map();
  Rng rng(1);
  change_tile(map, 5, rng);
  const MapSnapshotPtr sent = sender.on_map(map, at(0.0));
  deliver(sender.due(own_state(), at(2.0)), receiver, at(2.0));

  const MapSnapshotPtr received = receiver.on_map(unknown_map(), at(2.1));

  EXPECT_EQ(received->changed_tiles, (std::vector<TileSlot>{5}));
  EXPECT_EQ(digest_of(*received), digest_of(*sent));
  EXPECT_EQ(receiver.counters().accepted[2].samples, 1U);
}

}  // namespace
}  // namespace understory::team
