// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// The log's own thread. Real time: whatever is waited for has seconds to come.
#include "understory/port/candump_log.hpp"

#include <fstream>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/fake_can_port.hpp"
#include "support/temporary_folder.hpp"
#include "understory/port/candump_writer.hpp"

namespace understory::can {
namespace {

using test::at_us;
using test::frame_of;

CandumpLogConfig config_in(const TemporaryFolder& folder) {
  CandumpLogConfig config;
  config.path = folder.path_of("flight.log");
  return config;
}

std::size_t frames_in(const std::string& path) {
  std::ifstream input(path);
  CandumpReader reader(input);
  std::size_t frames = 0;
  while (const auto entry = reader.next()) {
    EXPECT_TRUE(*entry);
    ++frames;
  }
  return frames;
}

// False if it does not come in time.
template <class Condition>
bool comes_true(const Condition& condition) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (!condition() && std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return condition();
}

TEST(CandumpWriter, WritesEverythingBeforeItEnds) {
  const TemporaryFolder folder;
  {
    CandumpWriter writer(config_in(folder));
    for (int i = 0; i < 10'000; ++i) {
      writer.on_port_frame({frame_of(0x101), at_us(i), false});
    }
  }

  EXPECT_EQ(frames_in(folder.path_of("flight.log")), 10'000U);
}

TEST(CandumpWriter, WritesWhileFramesStillCome) {
  const TemporaryFolder folder;
  CandumpWriter writer(config_in(folder));
  std::int64_t sent = 0;

  EXPECT_TRUE(comes_true([&] {
    writer.on_port_frame({frame_of(0x101), at_us(++sent), false});
    return writer.counters().lines > 3;
  }));

  EXPECT_GT(frames_in(folder.path_of("flight.log")), 3U);
  EXPECT_EQ(writer.counters().lost, 0U);
}

TEST(CandumpWriter, WhatDoesNotFitIsCountedAndNothingWaits) {
  const TemporaryFolder folder;
  CandumpLogConfig config = config_in(folder);
  config.queued_frames = 16;
  std::uint64_t lost = 0;
  {
    CandumpWriter writer(config);
    for (int i = 0; i < 10'000; ++i) {
      writer.on_port_frame({frame_of(0x101), at_us(i), false});
    }
    lost = writer.counters().lost;
  }

  EXPECT_GT(lost, 0U);
  EXPECT_EQ(frames_in(folder.path_of("flight.log")), 10'000U - lost);
}

TEST(CandumpWriter, AFullDiskIsToldToTheOtherThreads) {
  CandumpLogConfig config;
  config.path = "/dev/full";
  CandumpWriter writer(config);

  writer.on_port_frame({frame_of(0x101), at_us(1), false});

  EXPECT_TRUE(comes_true([&] { return writer.counters().failed == 1; }));
  EXPECT_TRUE(writer.take_error().has_value());
}

}  // namespace
}  // namespace understory::can
