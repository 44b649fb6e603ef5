// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// A radio that is away for long. Takes its time; the rest is in unit/dds_link_test.cpp.
#include <chrono>
#include <iostream>
#include <thread>

#include <gtest/gtest.h>

#include "support/dds_networks.hpp"

namespace understory::dds {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using team::SampleKind;
using test::DdsEnd;
using test::TwoNetworks;
using test::versions;
using test::wait_until;

constexpr std::uint32_t kTiles = 300;
constexpr seconds kCut{30};
constexpr milliseconds kSoon{5000};

// Two links, each with tiles of its own.
class Pair {
 public:
  Pair(const TwoNetworks& networks, const DdsConfig& config)
      : here_(config), there_(config, networks) {}

  void publish(std::uint64_t version) {
    for (std::uint32_t item = 0; item < kTiles; ++item) {
      here_.link().publish({{1, SampleKind::kTileBlock, item}, version, test::noise(2000, item)});
      there_.link().publish({{2, SampleKind::kTileBlock, item}, version, test::noise(2000, item)});
    }
  }
  [[nodiscard]] bool has_all(std::uint64_t version) {
    for (DdsEnd* end : {&here_, &there_}) {
      if (end->samples().size() != kTiles || versions(end->samples()).first != version) {
        return false;
      }
    }
    return true;
  }
  [[nodiscard]] std::size_t mates() { return here_.link().mates() + there_.link().mates(); }

 private:
  DdsEnd here_;
  DdsEnd there_;
};

DdsConfig config_of(const std::string& team, double lease_s) {
  DdsConfig config = TwoNetworks::config();
  config.team = team;
  config.lease_s = lease_s;
  return config;
}

TEST(DdsCut, AfterHalfAMinuteTheNewestOfEveryKeyArrivesWithinSeconds) {
  const auto networks = test::two_networks();
  if (!networks) {
    GTEST_SKIP() << "network namespaces need root";
  }
  Pair remembered(*networks, config_of("remembered", 60.0));
  Pair forgotten(*networks, config_of("forgotten", 5.0));
  remembered.publish(1);
  forgotten.publish(1);
  ASSERT_TRUE(wait_until([&] { return remembered.has_all(1) && forgotten.has_all(1); }));

  networks->cut();
  const auto end = std::chrono::steady_clock::now() + kCut;
  std::uint64_t version = 1;
  while (std::chrono::steady_clock::now() < end) {
    ++version;
    remembered.publish(version);
    forgotten.publish(version);
    std::this_thread::sleep_for(seconds(1));
  }
  EXPECT_EQ(remembered.mates(), 2U);
  EXPECT_EQ(forgotten.mates(), 0U);
  networks->mend();
  const auto mended = std::chrono::steady_clock::now();

  const auto time_until_all = [&](Pair& pair) {
    EXPECT_TRUE(wait_until([&] { return pair.has_all(version); }, kSoon));
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - mended).count();
  };
  std::cout << "known anew after " << time_until_all(remembered) << " s where the mate was "
            << "remembered, " << time_until_all(forgotten) << " s where it was forgotten\n";
}

}  // namespace
}  // namespace understory::dds
