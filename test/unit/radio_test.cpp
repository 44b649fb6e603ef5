// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/radio.hpp"

#include <algorithm>
#include <map>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "understory/sim/forest_truth.hpp"

namespace understory {
namespace {

using team::Sample;
using team::SampleKind;

constexpr Duration kStep = std::chrono::milliseconds(10);

RadioConfig without_loss() {
  RadioConfig config;
  config.loss = 0.0;
  return config;
}

Sample sample_of(int vehicle, SampleKind kind, std::uint32_t item, std::uint64_t version) {
  return {{static_cast<std::uint8_t>(vehicle), kind, item}, version, {}};
}

Sample tile(std::uint32_t item, std::uint64_t version, std::size_t bytes = 936) {
  Sample sample = sample_of(0, SampleKind::kTileBlock, item, version);
  sample.payload.assign(bytes, static_cast<std::uint8_t>(version));
  return sample;
}

// Vehicles in a row along x, 10 m apart, until a test moves them.
struct Team {
  Team(const RadioConfig& config, int vehicles, std::uint64_t seed = 1, LineBlocked blocked = {})
      : radio(config, vehicles, Rng(seed), std::move(blocked)) {
    for (int i = 0; i < vehicles; ++i) {
      positions_m.emplace_back(10.0 * i, 0.0, 1.0);
    }
    radio.advance(now, positions_m);
  }

  void run(Duration duration, Duration step = kStep) {
    for (const Time end = now + duration; now < end;) {
      now += step;
      radio.advance(now, positions_m);
    }
  }

  Time now{};
  std::vector<Vector3d> positions_m;
  SimulatedRadio radio;
};

std::vector<std::uint64_t> versions_of(const std::vector<Sample>& samples) {
  std::vector<std::uint64_t> versions;
  for (const Sample& sample : samples) {
    versions.push_back(sample.version);
  }
  return versions;
}

std::vector<std::uint32_t> items_of(const std::vector<Sample>& samples) {
  std::vector<std::uint32_t> items;
  for (const Sample& sample : samples) {
    items.push_back(sample.key.item);
  }
  return items;
}

TEST(SimulatedRadio, SampleArrivesWholeAfterSendingAndDelay) {
  Team team(without_loss(), 2);
  team.radio.link(0).publish(tile(7, 42));  // 1000 bytes with the header: 8 ms, and 20 ms

  team.run(std::chrono::milliseconds(27), std::chrono::milliseconds(1));
  const std::vector<Sample> before = team.radio.link(1).take();
  team.run(std::chrono::milliseconds(1), std::chrono::milliseconds(1));
  const std::vector<Sample> after = team.radio.link(1).take();

  EXPECT_TRUE(before.empty());
  ASSERT_EQ(after.size(), 1U);
  EXPECT_EQ(after[0].key, tile(7, 42).key);
  EXPECT_EQ(after[0].version, 42U);
  EXPECT_EQ(after[0].payload, tile(7, 42).payload);
  EXPECT_TRUE(team.radio.link(1).take().empty());
  EXPECT_TRUE(team.radio.link(0).take().empty());
}

TEST(SimulatedRadio, OutOfRangeNothingIsSentAndAllOfItArrivesAfterContact) {
  Team team(without_loss(), 2);
  team.positions_m[1].x() = 50.01;
  for (std::uint32_t item = 0; item < 20; ++item) {
    team.radio.link(0).publish(tile(item, 1));
  }

  team.run(std::chrono::seconds(300), std::chrono::milliseconds(70));
  const bool apart = !team.radio.are_in_contact(0, 1);
  const std::uint64_t sent_apart = team.radio.use(0).bytes_sent;
  const std::size_t heard_apart = team.radio.link(1).take().size();
  team.positions_m[1].x() = 49.99;
  team.run(std::chrono::milliseconds(200));

  EXPECT_TRUE(apart);
  EXPECT_EQ(sent_apart, 0U);
  EXPECT_EQ(heard_apart, 0U);
  EXPECT_TRUE(team.radio.are_in_contact(0, 1) && team.radio.are_in_contact(1, 0));
  EXPECT_EQ(team.radio.link(1).take().size(), 20U);
}

TEST(SimulatedRadio, OnlyTheNewestOfAKeyIsSent) {
  Team team(without_loss(), 2);
  team.positions_m[1].x() = 1000.0;
  for (std::uint64_t version = 1; version <= 50; ++version) {
    team.radio.link(0).publish(tile(3, version));
    team.run(kStep);
  }

  team.positions_m[1].x() = 10.0;
  team.run(std::chrono::seconds(1));

  EXPECT_EQ(versions_of(team.radio.link(1).take()), std::vector<std::uint64_t>{50});
  EXPECT_EQ(team.radio.use(0).samples_sent, 1U);
}

TEST(SimulatedRadio, NewestNotYetTakenReplacesTheOneBefore) {
  Team team(without_loss(), 2);

  team.radio.link(0).publish(tile(3, 1));
  team.radio.link(0).publish(tile(4, 1));
  team.run(std::chrono::milliseconds(100));
  team.radio.link(0).publish(tile(3, 2));
  team.run(std::chrono::milliseconds(100));

  const std::vector<Sample> taken = team.radio.link(1).take();
  EXPECT_EQ(items_of(taken), (std::vector<std::uint32_t>{4, 3}));
  EXPECT_EQ(versions_of(taken), (std::vector<std::uint64_t>{1, 2}));
  EXPECT_EQ(team.radio.use(1).samples_delivered, 3U);
}

TEST(SimulatedRadio, SmallKindsOvertakeTilesAndTilesGoByAge) {
  Team team(without_loss(), 2);
  for (const std::uint32_t item : {5U, 2U, 9U}) {
    team.radio.link(0).publish(tile(item, 1));
  }
  team.radio.link(0).publish(tile(5, 2));  // now the youngest
  team.radio.link(0).publish(sample_of(0, SampleKind::kTrajectory, 100, 1));
  team.radio.link(0).publish(sample_of(0, SampleKind::kState, 200, 1));

  team.run(std::chrono::seconds(1));

  EXPECT_EQ(items_of(team.radio.link(1).take()), (std::vector<std::uint32_t>{200, 100, 2, 9, 5}));
}

TEST(SimulatedRadio, EveryLossIsMadeUpForAfterTheRetryTime) {
  RadioConfig config;
  config.loss = 0.5;
  Team team(config, 3);
  for (std::uint32_t item = 0; item < 500; ++item) {
    team.radio.link(0).publish(tile(item, 1, 36));
  }

  team.run(std::chrono::seconds(20));

  for (int receiver = 1; receiver < 3; ++receiver) {
    std::vector<std::uint32_t> items = items_of(team.radio.link(receiver).take());
    std::sort(items.begin(), items.end());
    ASSERT_EQ(items.size(), 500U);
    EXPECT_EQ(items.front(), 0U);
    EXPECT_EQ(items.back(), 499U);
    // On average one loss for every delivery, and nothing arrives twice.
    EXPECT_EQ(team.radio.use(receiver).samples_delivered, 500U);
    EXPECT_NEAR(static_cast<double>(team.radio.use(receiver).samples_lost), 500.0, 130.0);
  }
}

TEST(SimulatedRadio, LostPacketIsNotRepeatedBeforeTheRetryTime) {
  RadioConfig config;
  config.loss = 1.0;
  Team team(config, 2);
  team.radio.link(0).publish(tile(1, 1));

  // 8 ms of sending and 200 ms of waiting: sent at 0, 208, 416, 624 and 832 ms.
  team.run(std::chrono::milliseconds(1000), std::chrono::milliseconds(1));

  EXPECT_EQ(team.radio.use(0).samples_sent, 5U);
  EXPECT_EQ(team.radio.use(1).samples_lost, 5U);
  EXPECT_TRUE(team.radio.link(1).take().empty());
}

TEST(SimulatedRadio, NewVersionGoesAtOnceThoughTheOldOneWaitsToBeRepeated) {
  RadioConfig config;
  config.loss = 1.0;
  config.retry_s = 30.0;
  Team team(config, 2);
  team.radio.link(0).publish(tile(1, 1));
  team.run(std::chrono::milliseconds(100));

  team.radio.link(0).publish(tile(1, 2));
  team.run(std::chrono::milliseconds(100));
  const std::uint64_t sent_early = team.radio.use(0).samples_sent;
  team.run(std::chrono::milliseconds(29900), std::chrono::milliseconds(50));

  EXPECT_EQ(sent_early, 2U);
  EXPECT_EQ(team.radio.use(0).samples_sent, 2U);  // the first version's retry fell due unsent
}

TEST(SimulatedRadio, SendsNoMoreThanItsRateInAnySecond) {
  for (const int step_ms : {1, 10, 70}) {
    Team team(without_loss(), 2);
    for (std::uint32_t item = 0; item < 4000; ++item) {
      team.radio.link(0).publish(tile(item, 1));
    }

    // A pause must not be saved up for a burst.
    team.positions_m[1].x() = 1000.0;
    team.run(std::chrono::seconds(3), std::chrono::milliseconds(step_ms));
    team.positions_m[1].x() = 10.0;
    const Time begin = team.now;
    team.run(std::chrono::seconds(10), std::chrono::milliseconds(step_ms));
    const double sending_s = to_seconds(team.now - begin);

    const RadioUse& use = team.radio.use(0);
    EXPECT_LE(static_cast<double>(use.peak_bytes_in_a_second), 125000.0) << step_ms;
    EXPECT_NEAR(static_cast<double>(use.bytes_sent), 125000.0 * sending_s, 1000.0) << step_ms;
    EXPECT_EQ(use.bytes_sent, 1000U * use.samples_sent) << step_ms;
  }
}

TEST(SimulatedRadio, WhatIsSentWhenAContactBeginsIsNoSteadyPeak) {
  Team team(without_loss(), 2);
  team.positions_m[1].x() = 1000.0;
  team.run(std::chrono::seconds(1));
  for (std::uint32_t item = 0; item < 50; ++item) {
    team.radio.link(0).publish(tile(item, 1));
  }
  team.positions_m[1].x() = 10.0;
  team.run(kCatchUp + std::chrono::seconds(2));
  for (std::uint32_t item = 0; item < 7; ++item) {
    team.radio.link(0).publish(tile(item, 2));
  }
  team.run(std::chrono::seconds(1));

  EXPECT_EQ(team.radio.use(0).peak_bytes_in_a_second, 50000U);
  EXPECT_EQ(team.radio.use(0).steady_peak_bytes_in_a_second, 7000U);
}

TEST(SimulatedRadio, OneTransmissionServesAllInContactAndCountsOnce) {
  Team team(without_loss(), 5);
  team.positions_m[4].x() = 1000.0;
  team.radio.link(0).publish(tile(1, 1));

  team.run(std::chrono::seconds(1));

  EXPECT_EQ(team.radio.use(0).samples_sent, 1U);
  EXPECT_EQ(team.radio.use(0).bytes_sent, 1000U);
  for (int receiver = 1; receiver < 4; ++receiver) {
    EXPECT_EQ(team.radio.link(receiver).take().size(), 1U) << receiver;
  }
  EXPECT_TRUE(team.radio.link(4).take().empty());
}

TEST(SimulatedRadio, WhatALateComerNeedsIsNotDeliveredAgainToTheOthers) {
  Team team(without_loss(), 3);
  team.positions_m[2].x() = 1000.0;
  team.radio.link(0).publish(tile(1, 1));
  team.run(std::chrono::seconds(1));
  ASSERT_EQ(team.radio.link(1).take().size(), 1U);

  team.positions_m[2].x() = 20.0;
  team.run(std::chrono::seconds(1));

  EXPECT_EQ(team.radio.link(2).take().size(), 1U);
  EXPECT_TRUE(team.radio.link(1).take().empty());
  EXPECT_EQ(team.radio.use(0).samples_sent, 2U);
}

TEST(SimulatedRadio, NobodyHearsAnybodyDuringACut) {
  RadioConfig config = without_loss();
  config.cuts = {{1.0, 2.0}};
  Team team(config, 2);
  team.run(std::chrono::milliseconds(1000));
  const bool began = !team.radio.are_in_contact(0, 1);
  team.radio.link(0).publish(tile(1, 1));
  team.radio.link(1).publish(tile(2, 1));

  team.run(std::chrono::milliseconds(990));
  const std::size_t heard = team.radio.link(0).take().size() + team.radio.link(1).take().size();
  team.run(std::chrono::milliseconds(200));

  EXPECT_TRUE(began);
  EXPECT_EQ(heard, 0U);
  EXPECT_EQ(team.radio.link(1).take().size(), 1U);
  EXPECT_EQ(team.radio.link(0).take().size(), 1U);
}

TEST(SimulatedRadio, TrunkBetweenTwoVehiclesBreaksContactIfItIsToAndIsHighEnough) {
  Forest forest;
  forest.trunks = {{Vector2d(5.0, 0.1), 0.2}};
  forest.trunk_height_m = 3.0;
  const ForestTruth truth(forest);
  const LineBlocked blocked = [&](const Vector3d& from_m, const Vector3d& to_m) {
    return trunk_between(truth, from_m, to_m);
  };
  RadioConfig config = without_loss();
  const auto in_contact = [&](double y_m, double z0_m, double z1_m) {
    Team team(config, 2, 1, blocked);
    team.positions_m = {{0.0, y_m, z0_m}, {10.0, y_m, z1_m}};
    team.run(kStep);
    return team.radio.are_in_contact(0, 1);
  };

  EXPECT_TRUE(in_contact(0.0, 1.0, 1.0));  // off by default

  config.occlusion = true;
  EXPECT_FALSE(in_contact(0.0, 1.0, 1.0));
  EXPECT_FALSE(in_contact(0.29, 1.0, 1.0));
  EXPECT_TRUE(in_contact(0.31, 1.0, 1.0));
  EXPECT_TRUE(in_contact(-0.11, 1.0, 1.0));
  EXPECT_TRUE(in_contact(0.0, 3.1, 3.1));
  EXPECT_FALSE(in_contact(0.0, 1.0, 4.9));  // 2.95 m high at the trunk's axis
  EXPECT_TRUE(in_contact(0.0, 1.0, 5.3));   // 3.15 m, and 3.05 m where it begins
  EXPECT_THROW(SimulatedRadio(config, 2, Rng(1)), ConfigError);
}

// All that happens on a lossy, broken radio in a minute.
std::vector<std::tuple<Time, int, std::uint32_t, std::uint64_t>> log_of(std::uint64_t seed) {
  RadioConfig config;
  config.loss = 0.3;
  config.range_m = 15.0;
  config.cuts = {{20.0, 30.0}};
  Team team(config, 4, seed);
  std::vector<std::tuple<Time, int, std::uint32_t, std::uint64_t>> log;
  for (std::uint64_t round = 1; round <= 600; ++round) {
    for (int vehicle = 0; vehicle < 4; ++vehicle) {
      Sample sample = tile(static_cast<std::uint32_t>(round % 7), round, 200);
      sample.key.vehicle = static_cast<std::uint8_t>(vehicle);
      team.radio.link(vehicle).publish(sample);
      for (const Sample& taken : team.radio.link(vehicle).take()) {
        log.emplace_back(team.now, 10 * vehicle + taken.key.vehicle, taken.key.item, taken.version);
      }
    }
    team.run(std::chrono::milliseconds(100), std::chrono::milliseconds(20));
  }
  return log;
}

TEST(SimulatedRadio, SameSeedGivesTheSameDeliveriesAndAnotherSeedOthers) {
  const auto once = log_of(1);

  EXPECT_GT(once.size(), 1000U);
  EXPECT_EQ(log_of(1), once);
  EXPECT_NE(log_of(2), once);
}

TEST(SimulatedRadio, VersionsOfAKeyNeverGoBackward) {
  std::map<std::tuple<int, std::uint32_t>, std::uint64_t> newest;
  for (const auto& [time, pair, item, version] : log_of(3)) {
    std::uint64_t& before = newest[{pair, item}];
    ASSERT_GT(version, before) << "pair " << pair << ", item " << item;
    before = version;
  }
}

TEST(SimulatedRadio, SwitchedOffVehicleNeitherSendsNorHearsNorHoldsUpTheOthers) {
  Team team(without_loss(), 3);
  team.radio.link(1).publish(tile(1, 1));
  team.radio.link(0).publish(tile(2, 1));
  team.run(std::chrono::milliseconds(20));  // in the air

  team.radio.switch_off(1);
  team.radio.link(1).publish(tile(3, 1));
  team.radio.link(0).publish(tile(4, 1));
  team.run(std::chrono::seconds(1));

  EXPECT_FALSE(team.radio.are_in_contact(0, 1) || team.radio.are_in_contact(1, 2));
  EXPECT_TRUE(team.radio.are_in_contact(0, 2));
  EXPECT_TRUE(team.radio.link(1).take().empty());
  EXPECT_EQ(team.radio.use(1).samples_delivered, 0U);
  EXPECT_EQ(items_of(team.radio.link(2).take()), (std::vector<std::uint32_t>{2, 1, 4}));
  EXPECT_EQ(team.radio.use(0).samples_sent, 2U);
}

TEST(SimulatedRadio, RefusesWhatMakesNoSense) {
  RadioConfig backward;
  backward.cuts = {{2.0, 1.0}};

  EXPECT_THROW(SimulatedRadio(backward, 2, Rng(1)), ConfigError);
  EXPECT_THROW(SimulatedRadio(RadioConfig{}, 0, Rng(1)), ConfigError);
  EXPECT_THROW(SimulatedRadio(RadioConfig{}, 33, Rng(1)), ConfigError);
  EXPECT_NO_THROW(SimulatedRadio(RadioConfig{}, 32, Rng(1)));
}

}  // namespace
}  // namespace understory
