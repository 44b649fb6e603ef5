// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "support/team_layers.hpp"
#include "understory/team/exchange.hpp"

namespace understory::team {
namespace {

constexpr std::uint64_t kSession = 1'790'000'000'000'000;  // microseconds since 1970, in 2026

Time at(double time_s) {
  return Time(duration_from_seconds(time_s));
}

GridGeometry geometry() {
  return {0.1, Box3d(Vector3d(-2.0, -3.0, 0.0), Vector3d(6.0, 3.0, 2.0))};
}

SensorModel model() {
  return SensorModel(SensorModelConfig{});
}

TeamConfig team_of(int size, int id) {
  TeamConfig config;
  config.size = size;
  config.id = id;
  return config;
}

Exchange exchange_of(int id, std::uint64_t session = kSession) {
  return {team_of(3, id), geometry(), model(), session};
}

OwnState own_state() {
  OwnState own;
  own.position_m = Vector3d(1.2345, -2.5, 1.0);
  own.velocity_mps = Vector3d(0.5, -1.25, 0.1);
  own.yaw_rad = -2.5;
  own.mode = FlightMode::kCollector;
  own.state = MissionState::kExplore;
  own.target_m = Vector3d(4.0, 2.0, 1.5);
  return own;
}

MapSnapshot unknown_map() {
  MapSnapshot map{geometry(), model(), 0, Time{}, {}, {}};
  map.tiles.resize(geometry().slot_count());
  return map;
}

void change_tile(MapSnapshot& map, TileSlot slot, Rng& rng) {
  ++map.revision;
  map.tiles[slot] = test::tile_of(test::random_layer(geometry(), slot, rng), map.sensor_model);
  map.changed_tiles.assign(1, slot);
}

std::vector<Sample> of_kind(SampleKind kind, const std::vector<Sample>& samples) {
  std::vector<Sample> found;
  std::copy_if(samples.begin(), samples.end(), std::back_inserter(found), [&](const Sample& s) {
    return s.key.kind == kind;
  });
  return found;
}

void deliver(const std::vector<Sample>& samples, Exchange& to, Time now) {
  for (const Sample& sample : samples) {
    to.receive(sample, now);
  }
}

StateSample state_sample(std::uint64_t count) {
  StateSample sample;
  sample.header = {kProtocolVersion, hash_of(geometry()), kSession, count};
  sample.stamp = at(1.0);
  sample.position_m = Vector3d(1.0, 2.0, 1.0);
  return sample;
}

template <class Content>
Sample sample_of(std::uint8_t vehicle,
                 SampleKind kind,
                 std::uint32_t item,
                 const Content& content) {
  return {{vehicle, kind, item}, version_of(content.header), encode(content)};
}

Sample state_of(std::uint8_t vehicle, const StateSample& state) {
  return sample_of(vehicle, SampleKind::kState, 0, state);
}

Sample tile_sample(std::uint32_t slot, const LayerTile& layer) {
  const TileSample tile{{kProtocolVersion, hash_of(geometry()), kSession, 1}, slot, layer};
  return sample_of(1, SampleKind::kTile, slot, tile);
}

std::uint64_t rejections(const Counters& counters) {
  std::uint64_t sum = 0;
  for (const std::uint64_t count : counters.rejected) {
    sum += count;
  }
  return sum;
}

// Of vehicle 0: that exactly this one sample is rejected, for this reason, and leaves no trace.
void expect_rejected(const Sample& sample, Rejection reason) {
  Exchange exchange = exchange_of(0);
  const std::uint64_t digest = exchange.map_digest();

  exchange.receive(sample, at(1.0));
  (void)exchange.on_map(unknown_map(), at(1.0));

  EXPECT_EQ(exchange.counters().rejected_for(reason), 1U) << to_string(reason);
  EXPECT_EQ(rejections(exchange.counters()), 1U);
  EXPECT_TRUE(exchange.peers(at(1.0)).empty());
  EXPECT_EQ(exchange.map_digest(), digest);
}

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
  own.trajectory = test::straight_flight(77, {-1.0, -2.0, 1.0}, {5.0, 2.0, 1.3}, at(5.0));

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
  own.trajectory = test::straight_flight(77, {-1.0, -2.0, 1.0}, {5.0, 2.0, 1.3}, at(5.0));

  const std::vector<Sample> first = sender.due(own, at(5.0));
  const std::vector<Sample> second = sender.due(own, at(6.0));
  own.trajectory = test::straight_flight(78, {-1.0, -2.0, 1.0}, {5.0, 2.0, 1.3}, at(6.0));
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
    const std::size_t tiles = of_kind(SampleKind::kTile, sender.due(own_state(), at(now_s))).size();
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
    const std::size_t tiles = of_kind(SampleKind::kTile, sender.due(own_state(), at(now_s))).size();
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
  ASSERT_EQ(of_kind(SampleKind::kTile, sender.due(own_state(), at(3.0))).size(), 1U);

  change_tile(map, 5, rng);
  (void)sender.on_map(map, at(4.0));
  map.tiles[5] = first;
  ++map.revision;
  (void)sender.on_map(map, at(4.1));

  EXPECT_TRUE(of_kind(SampleKind::kTile, sender.due(own_state(), at(20.0))).empty());
}

TEST(TeamExchange, NoMoreOfTheMapIsToldThanTheRateAllowsAndTheOldestFirst) {
  TeamConfig config = team_of(3, 1);
  config.exchange.tile_rate_bytes_per_s = 3000.0;
  Exchange sender(config, geometry(), model(), kSession);
  MapSnapshot map = unknown_map();
  Rng rng(1);
  for (TileSlot slot = geometry().slot_count(); slot-- > 0;) {  // from the last to the first
    change_tile(map, slot, rng);
    (void)sender.on_map(map, at(0.01 * static_cast<double>(map.revision)));
  }

  std::vector<std::uint32_t> slots;
  std::size_t bytes = 0;
  for (int i = 0; i < 300; ++i) {
    const double since_s = 0.1 * i;
    for (const Sample& sample :
         of_kind(SampleKind::kTile, sender.due(own_state(), at(3.0 + since_s)))) {
      slots.push_back(sample.key.item);
      bytes += sample.payload.size();
    }
    ASSERT_LE(static_cast<double>(bytes), 3000.0 * (1.0 + since_s) + 1300.0);
  }

  EXPECT_EQ(slots.size(), geometry().slot_count());
  EXPECT_TRUE(std::is_sorted(slots.rbegin(), slots.rend()));
  EXPECT_GT(bytes, 20000U);
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

TEST(TeamExchange, RejectsItsOwnId) {
  expect_rejected(state_of(0, state_sample(1)), Rejection::kOwnId);
}

TEST(TeamExchange, RejectsAnIdOutsideOfTheTeam) {
  expect_rejected(state_of(3, state_sample(1)), Rejection::kOutsideTeam);
  expect_rejected(state_of(254, state_sample(1)), Rejection::kOutsideTeam);
}

TEST(TeamExchange, RejectsWhatIsOversized) {
  for (const SampleKind kind : {SampleKind::kState, SampleKind::kTrajectory, SampleKind::kTile}) {
    Sample sample = state_of(1, state_sample(1));
    sample.key.kind = kind;
    sample.payload.resize(max_payload_bytes(kind) + 1);
    expect_rejected(sample, Rejection::kOversized);
  }
}

TEST(TeamExchange, RejectsWhatCannotBeRead) {
  Sample empty = state_of(1, state_sample(1));
  empty.payload.clear();
  expect_rejected(empty, Rejection::kMalformed);
  Sample cut_off = state_of(1, state_sample(1));
  cut_off.payload.pop_back();
  expect_rejected(cut_off, Rejection::kMalformed);
  Sample of_no_kind = state_of(1, state_sample(1));
  of_no_kind.key.kind = static_cast<SampleKind>(4);
  expect_rejected(of_no_kind, Rejection::kMalformed);
  Sample of_another_kind = state_of(1, state_sample(1));
  of_another_kind.key.kind = SampleKind::kTrajectory;
  expect_rejected(of_another_kind, Rejection::kMalformed);
}

TEST(TeamExchange, RejectsAVersionThatIsNotThatOfItsContent) {
  Sample sample = state_of(1, state_sample(1));
  ++sample.version;

  expect_rejected(sample, Rejection::kMalformed);
}

TEST(TeamExchange, RejectsValuesThatThereAreNot) {
  StateSample mode = state_sample(1);
  mode.mode = static_cast<FlightMode>(4);
  expect_rejected(state_of(1, mode), Rejection::kMalformed);
  StateSample mission = state_sample(1);
  mission.state = static_cast<MissionState>(8);
  expect_rejected(state_of(1, mission), Rejection::kMalformed);
  StateSample stamp = state_sample(1);
  stamp.stamp = Time(Duration(std::numeric_limits<std::int64_t>::max()));
  expect_rejected(state_of(1, stamp), Rejection::kMalformed);
}

TEST(TeamExchange, RejectsATrajectoryThatCannotBeFlown) {
  const auto rejected_with = [](auto change) {
    TrajectorySample sample{state_sample(1).header,
                            *test::straight_flight(1, Vector3d::Zero(), Vector3d::Ones(), at(0.0))};
    change(sample.trajectory);
    expect_rejected(sample_of(1, SampleKind::kTrajectory, 0, sample), Rejection::kMalformed);
  };

  rejected_with([](Trajectory& t) { t.position.knot_s = 0.0; });
  rejected_with([](Trajectory& t) { t.position.knot_s = std::nan(""); });
  rejected_with([](Trajectory& t) { t.yaw.knot_s = -0.1; });
  rejected_with([](Trajectory& t) { t.yaw.knot_s = 1e9; });
  rejected_with([](Trajectory& t) { t.position.control_points.clear(); });
  rejected_with([](Trajectory& t) { t.yaw.control_points.clear(); });
  rejected_with([](Trajectory& t) { t.yaw.control_points.resize(5000); });
  rejected_with([](Trajectory& t) { t.mode = static_cast<FlightMode>(4); });
}

TEST(TeamExchange, RejectsATileThatIsNotOfTheMap) {
  LayerTile all_known;
  all_known.maybe_solid_rows.fill(0xFFFF);
  const auto slots = static_cast<std::uint32_t>(geometry().slot_count());

  expect_rejected(tile_sample(slots, LayerTile{}), Rejection::kMalformed);
  expect_rejected(tile_sample(slots - 1, all_known), Rejection::kMalformed);  // beyond the box
  Sample of_another_slot = tile_sample(3, LayerTile{});
  of_another_slot.key.item = 4;
  expect_rejected(of_another_slot, Rejection::kMalformed);
}

TEST(TeamExchange, RejectsAForeignProtocol) {
  StateSample state = state_sample(1);
  state.header.protocol = kProtocolVersion + 1;

  expect_rejected(state_of(1, state), Rejection::kForeignProtocol);
}

TEST(TeamExchange, RejectsAForeignGeometry) {
  for (const GridGeometry& other :
       {GridGeometry(0.15, geometry().box_m()),
        GridGeometry(0.1, Box3d(Vector3d(-2.0, -3.0, 0.0), Vector3d(6.0, 3.0, 2.1)))}) {
    StateSample state = state_sample(1);
    state.header.geometry_hash = hash_of(other);
    expect_rejected(state_of(1, state), Rejection::kForeignGeometry);
  }
}

TEST(TeamExchange, RejectsWhatIsRepeatedOrSuperseded) {
  Exchange receiver = exchange_of(0);
  StateSample old = state_sample(4);
  old.position_m = Vector3d(9.0, 9.0, 9.0);
  receiver.receive(state_of(1, state_sample(5)), at(1.0));

  receiver.receive(state_of(1, state_sample(5)), at(1.1));
  receiver.receive(state_of(1, old), at(1.2));

  EXPECT_EQ(receiver.counters().rejected_for(Rejection::kStale), 2U);
  EXPECT_EQ(rejections(receiver.counters()), 2U);
  EXPECT_EQ(receiver.peers(at(1.2))[0].heard_at, at(1.0));
  EXPECT_TRUE(receiver.peers(at(1.2))[0].position_m.isApprox(state_sample(5).position_m));
}

TEST(TeamExchange, RejectsASessionThatDoesNotFitAVersion) {
  EXPECT_THROW(exchange_of(0, std::uint64_t{1} << 51U), ConfigError);
}

TEST(TeamExchange, SilenceEndsContactAndAWordBringsItBack) {
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
      own.trajectory =
          test::straight_flight(77, {-1.0, -2.0, 1.0}, {5.0, 2.0, 1.3}, at(10.0 + ahead_s_));
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

TEST(TeamExchange, AClockHalfASecondOffIsDetectedEitherWay) {
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

TEST(TeamExchange, AClockThatIsALittleOffIsCorrected) {
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
TEST(TeamExchange, ALateWordIsNotAClockThatIsOff) {
  Exchange sender = exchange_of(1);
  Exchange receiver = exchange_of(0);
  for (int i = 0; i < 10; ++i) {
    const double now_s = 1.0 + 0.2 * i;
    const double delay_s = i == 5 ? 3.0 : 0.05;
    deliver(sender.due(own_state(), at(now_s)), receiver, at(now_s + delay_s));
  }

  EXPECT_EQ(receiver.counters().rejected_for(Rejection::kClockOff), 0U);
}

TEST(TeamExchange, AVehicleThatRestartsIsHeardAtOnceAndItsFormerTrajectoryForgotten) {
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

TEST(TeamExchange, ARestartedClockIsEstimatedAnew) {
  TwoClocks team(0.0);
  team.talk(1.0, 10.0);

  team.restart_one(kSession + 10'000'000, 0.5);
  team.talk(10.0, 11.0);

  EXPECT_NEAR(to_seconds(*team.zero().clock_offset(1)), 0.5, 0.0101);
}

TEST(TeamExchange, TilesOfARestartedVehicleReplaceItsFormerOnes) {
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

// Real samples, altered bit by bit, cut, extended and spliced, most with a version that fits.
class NoisySamples {
 public:
  NoisySamples() {
    Exchange sender = exchange_of(1);
    MapSnapshot map = unknown_map();
    OwnState own = own_state();
    for (std::uint64_t i = 0; i < 20; ++i) {
      change_tile(map, i, rng_);
      (void)sender.on_map(map, at(static_cast<double>(i)));
      own.trajectory = test::straight_flight(i, {-1.0, -2.0, 1.0}, {5.0, 2.0, 1.3}, at(5.0));
      const std::vector<Sample> due = sender.due(own, at(static_cast<double>(i) + 0.5));
      real_.insert(real_.end(), due.begin(), due.end());
    }
  }

  Sample next() {
    Sample sample = real_[rng_.below(real_.size())];
    const std::uint64_t damage = rng_.below(8);
    if (damage == 0) {
      sample.payload.assign(rng_.below(200), 0);
      std::generate(sample.payload.begin(), sample.payload.end(), [&] { return byte(); });
    } else if (damage == 1) {
      sample.payload.resize(rng_.below(sample.payload.size() + 1));
    } else if (damage == 2) {
      const std::vector<std::uint8_t>& other = real_[rng_.below(real_.size())].payload;
      const auto from = static_cast<std::ptrdiff_t>(rng_.below(other.size()));
      sample.payload.insert(sample.payload.end(), other.begin() + from, other.end());
    }
    for (std::uint64_t left = rng_.below(4); left > 0 && !sample.payload.empty(); --left) {
      sample.payload[rng_.below(sample.payload.size())] = byte();
    }
    if (rng_.below(8) == 0) {
      sample.key = {byte(),
                    static_cast<SampleKind>(rng_.below(6)),
                    static_cast<std::uint32_t>(rng_.below(60))};
    }
    const std::optional<SampleHeader> header = decode_header(sample.payload);
    sample.version = header && rng_.below(16) != 0 ? version_of(*header) : rng_.next();
    return sample;
  }

 private:
  std::uint8_t byte() { return static_cast<std::uint8_t>(rng_.below(256)); }

  Rng rng_{99};
  std::vector<Sample> real_;
};

bool is_sane(const Peer& peer) {
  if (!peer.position_m.allFinite() || !peer.velocity_mps.allFinite() ||
      !std::isfinite(peer.yaw_rad)) {
    return false;
  }
  if (!peer.trajectory) {
    return true;
  }
  const TrajectoryPoint end = peer.trajectory->sample(peer.trajectory->end());
  return end.position_m.allFinite() && std::isfinite(end.yaw_rad) && end.velocity_mps.isZero(0.0);
}

TEST(TeamExchange, BearsAHundredThousandDamagedSamples) {
  NoisySamples noise;
  Exchange receiver = exchange_of(0);
  MapSnapshot own = unknown_map();

  for (int i = 0; i < 100'000; ++i) {
    receiver.receive(noise.next(), at(1e-4 * i));
    for (const Peer& peer : receiver.peers(at(1e-4 * i))) {
      ASSERT_TRUE(is_sane(peer)) << i;
    }
    if (i % 1000 == 0) {
      ++own.revision;
      (void)receiver.on_map(own, at(1e-4 * i));
      (void)receiver.due(own_state(), at(1e-4 * i));
    }
  }

  const Counters& counters = receiver.counters();
  const std::uint64_t accepted =
      counters.accepted[0].samples + counters.accepted[1].samples + counters.accepted[2].samples;
  EXPECT_EQ(accepted + rejections(counters), 100'000U);
  EXPECT_GT(accepted, 20U);
  EXPECT_GT(counters.rejected_for(Rejection::kMalformed), 10'000U);
}

}  // namespace
}  // namespace understory::team
