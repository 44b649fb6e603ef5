// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <chrono>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "support/dds_networks.hpp"

namespace understory::dds {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using team::Sample;
using team::SampleKind;
using test::DdsEnd;
using test::sample;
using test::two_networks;
using test::versions;
using test::wait_until;

constexpr std::uint32_t kTiles = 300;

// Links of one machine, and no other traffic where the system allows it.
class DdsLinks : public ::testing::Test {
 protected:
  void SetUp() override { test::enter_network_of_our_own(); }

  [[nodiscard]] static DdsConfig config() {
    DdsConfig config;
    config.interface = "lo";
    config.team = test::team_of_this_process();
    return config;
  }
};

TEST_F(DdsLinks, WhatOnePublishesTheOtherGets) {
  DdsEnd here(config());
  DdsEnd there(config());

  here.link().publish(sample({3, SampleKind::kTileBlock, 70'000}, 9, {1, 2, 255}));

  ASSERT_TRUE(wait_until([&] { return there.has({3, SampleKind::kTileBlock, 70'000}, 9); }));
  const std::vector<std::uint8_t> expected = {1, 2, 255};
  EXPECT_EQ(there.samples().begin()->second.payload, expected);
  EXPECT_EQ(there.samples().size(), 1U);
}

TEST_F(DdsLinks, OnesOwnSamplesDoNotComeBack) {
  DdsEnd here(config());
  DdsEnd there(config());

  here.link().publish(sample({1, SampleKind::kState, 0}, 1));
  ASSERT_TRUE(wait_until([&] { return there.has({1, SampleKind::kState, 0}, 1); }));
  there.link().publish(sample({2, SampleKind::kState, 0}, 1));
  ASSERT_TRUE(wait_until([&] { return here.has({2, SampleKind::kState, 0}, 1); }));

  EXPECT_EQ(here.samples().size(), 1U);
  EXPECT_EQ(here.link().counters().received, 1U);
}

TEST_F(DdsLinks, TheNewestOfEveryKeyArrivesThoughNobodyTookTheOlder) {
  DdsEnd here(config());
  DdsEnd there(config());
  ASSERT_TRUE(wait_until([&] { return here.link().mates() == 1; }));

  for (std::uint64_t version = 1; version <= 50; ++version) {
    here.link().publish(sample({1, SampleKind::kState, 0}, version));
    here.link().publish(sample({1, SampleKind::kTileBlock, 7}, 2 * version));
  }

  EXPECT_TRUE(wait_until([&] { return there.has({1, SampleKind::kState, 0}, 50); }));
  EXPECT_TRUE(wait_until([&] { return there.has({1, SampleKind::kTileBlock, 7}, 100); }));
  EXPECT_LT(there.link().counters().received, 100U) << "what was superseded must not pile up";
}

TEST_F(DdsLinks, ALateJoinerGetsTheNewestOfEveryKeyAndNothingOlder) {
  DdsEnd here(config());
  for (std::uint64_t version = 1; version <= 3; ++version) {
    for (std::uint32_t item = 0; item < kTiles; ++item) {
      here.link().publish(
          sample({1, SampleKind::kTileBlock, item}, version, test::noise(2000, item)));
    }
  }

  DdsEnd late(config());

  ASSERT_TRUE(wait_until([&] { return late.samples().size() == kTiles; }));
  EXPECT_EQ(versions(late.samples()), std::make_pair(std::uint64_t{3}, std::uint64_t{3}));
  EXPECT_EQ(late.link().counters().received, kTiles);
  for (const auto& [key, got] : late.samples()) {
    EXPECT_EQ(got.payload, test::noise(2000, key.item));
  }
}

TEST_F(DdsLinks, OneCallTakesSoManyAtMostAndTheNextTheRest) {
  DdsEnd here(config());
  DdsEnd there(config());
  std::uint64_t version = 0;

  EXPECT_TRUE(wait_until([&] {
    ++version;
    for (std::uint32_t item = 0; item < kTiles; ++item) {
      here.link().publish(sample({1, SampleKind::kTileBlock, item}, version));
    }
    std::this_thread::sleep_for(milliseconds(100));  // most have arrived by then
    const std::size_t first = there.link().take().size();
    EXPECT_LE(first, kMostPerTake);
    return first == kMostPerTake && !there.link().take().empty();
  }));
}

TEST_F(DdsLinks, ASampleThatIsTooLongStaysHereAndTheLongestArrives) {
  DdsEnd here(config());
  DdsEnd there(config());

  here.link().publish(
      sample({1, SampleKind::kTileBlock, 1}, 1, test::noise(kMaxPayloadBytes + 1, 1)));
  here.link().publish(sample({1, SampleKind::kTileBlock, 2}, 1, test::noise(kMaxPayloadBytes, 2)));

  ASSERT_TRUE(wait_until([&] { return there.has({1, SampleKind::kTileBlock, 2}, 1); }));
  EXPECT_EQ(there.samples().size(), 1U);
  EXPECT_EQ(there.samples().begin()->second.payload, test::noise(kMaxPayloadBytes, 2));
  EXPECT_EQ(here.link().counters().refused, 1U);
  EXPECT_EQ(here.link().counters().sent, 1U);
}

TEST_F(DdsLinks, KeysThatMeanNothingAreDroppedAndCounted) {
  DdsEnd here(config());
  DdsEnd there(config());

  here.link().publish(sample({255, SampleKind::kState, 0}, 1));
  here.link().publish(sample({1, static_cast<SampleKind>(0), 0}, 1));
  here.link().publish(sample({1, static_cast<SampleKind>(4), 0}, 1));
  here.link().publish(sample({1, SampleKind::kState, 0}, 1));

  ASSERT_TRUE(wait_until([&] {
    return there.has({1, SampleKind::kState, 0}, 1) && there.link().counters().malformed == 3;
  }));
  EXPECT_EQ(there.samples().size(), 1U);
}

TEST_F(DdsLinks, AnotherTeamIsNotHeard) {
  DdsConfig other = config();
  other.team += "_other";
  DdsEnd here(config());
  DdsEnd stranger(other);
  DdsEnd mate(config());

  stranger.link().publish(sample({9, SampleKind::kState, 0}, 1));
  here.link().publish(sample({1, SampleKind::kState, 0}, 1));

  ASSERT_TRUE(wait_until([&] { return mate.has({1, SampleKind::kState, 0}, 1); }));
  std::this_thread::sleep_for(milliseconds(1200));  // they would have met by now
  EXPECT_EQ(mate.samples().size(), 1U);
  EXPECT_EQ(stranger.link().mates(), 0U);
}

TEST_F(DdsLinks, WithoutMulticastTheyMeetAtTheAddressesOfPeers) {
  DdsConfig alone = config();
  alone.multicast = false;
  alone.peers = "127.0.0.1";
  DdsEnd here(alone);
  DdsEnd there(alone);

  here.link().publish(sample({1, SampleKind::kState, 0}, 1));

  EXPECT_TRUE(wait_until([&] { return there.has({1, SampleKind::kState, 0}, 1); }));
}

TEST_F(DdsLinks, AVehicleThatLeavesAndComesBackIsHeardAnew) {
  DdsEnd here(config());
  {
    DdsEnd first(config());
    first.link().publish(sample({2, SampleKind::kState, 0}, 5));
    ASSERT_TRUE(wait_until([&] { return here.has({2, SampleKind::kState, 0}, 5); }));
  }
  ASSERT_TRUE(wait_until([&] { return here.link().mates() == 0; }));
  here.forget();

  DdsEnd second(config());
  second.link().publish(sample({2, SampleKind::kState, 0}, 1));

  EXPECT_TRUE(wait_until([&] { return here.has({2, SampleKind::kState, 0}, 1); }));
}

TEST_F(DdsLinks, WrongSettingsAreRefusedInOneLineThatNamesThem) {
  const auto complaint = [](const DdsConfig& wrong) -> std::string {
    try {
      const DdsLink link(wrong);
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "it was accepted";
  };
  DdsConfig missing = config();
  missing.interface = "nowhere9";
  DdsConfig unquoted = config();
  unquoted.team = "a<b";
  DdsConfig nonsense = config();
  nonsense.peers = "127.0.0.1 300.0.0.1";
  DdsConfig lonely = config();
  lonely.multicast = false;

  EXPECT_NE(complaint(missing).find("interface: `nowhere9` does not exist"), std::string::npos)
      << complaint(missing);
  EXPECT_NE(complaint(unquoted).find("team: `a<b`"), std::string::npos) << complaint(unquoted);
  EXPECT_NE(complaint(nonsense).find("peers: `300.0.0.1`"), std::string::npos);
  EXPECT_NE(complaint(lonely).find("peers: without multicast"), std::string::npos);
  EXPECT_EQ(complaint(missing).find('\n'), std::string::npos);
}

TEST(DdsCut, WhatChangedInAShortCutArrivesAfterItAndNothingElse) {
  const auto networks = two_networks();
  if (!networks) {
    GTEST_SKIP() << "network namespaces need root";
  }
  DdsEnd here(networks->config());
  DdsEnd there(networks->config(), *networks);
  for (std::uint32_t item = 0; item < kTiles; ++item) {
    here.link().publish(sample({1, SampleKind::kTileBlock, item}, 1, test::noise(500, item)));
  }
  ASSERT_TRUE(wait_until([&] { return there.samples().size() == kTiles; }));

  networks->cut();
  for (std::uint64_t version = 2; version <= 20; ++version) {
    here.link().publish(sample({1, SampleKind::kTileBlock, 7}, version));
    std::this_thread::sleep_for(milliseconds(50));
  }
  networks->mend();

  EXPECT_TRUE(wait_until([&] { return there.has({1, SampleKind::kTileBlock, 7}, 20); }));
  EXPECT_LE(there.link().counters().received, kTiles + 2) << "what had arrived came again";
}

TEST(DdsCut, PublishingDoesNotWaitForAVehicleOutOfContact) {
  const auto networks = two_networks();
  if (!networks) {
    GTEST_SKIP() << "network namespaces need root";
  }
  DdsEnd here(networks->config());
  DdsEnd there(networks->config(), *networks);
  ASSERT_TRUE(wait_until([&] { return here.link().mates() == 1; }));
  const auto publish = [&] {
    const auto began = std::chrono::steady_clock::now();
    for (std::uint32_t item = 0; item < 1000; ++item) {  // 4 MB
      here.link().publish(sample({1, SampleKind::kTileBlock, item}, 1, test::noise(4000, item)));
    }
    return std::chrono::steady_clock::now() - began;
  };

  networks->cut();
  EXPECT_LT(publish(), seconds(2));
  networks->unplug();
  EXPECT_LT(publish(), seconds(2));

  EXPECT_EQ(here.link().counters().sent, 2000U);
  EXPECT_EQ(here.link().counters().refused, 0U);
}

}  // namespace
}  // namespace understory::dds
