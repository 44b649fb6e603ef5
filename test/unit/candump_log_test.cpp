// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/port/candump_log.hpp"

#include <filesystem>
#include <fstream>
#include <sstream>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/fake_can_port.hpp"
#include "support/temporary_folder.hpp"
#include "understory/base/config.hpp"
#include "understory/base/rng.hpp"
#include "understory/port/candump_writer.hpp"

namespace understory::can {
namespace {

using test::at_ms;
using test::at_us;
using test::frame_of;
using ::testing::HasSubstr;

using Entry = Result<CandumpEntry, CandumpError>;

const Frame kFrame = {0x101, 8, {0xE8, 0x03, 0x00, 0x00, 0x30, 0xF8, 0xFF, 0xFF}};
const std::string kLine = "(1700000000.123456) vcan0 101#E803000030F8FFFF\n";
constexpr std::size_t kLineBytes = 47;

std::vector<Entry> read_all(const std::string& text) {
  std::istringstream input(text);
  CandumpReader reader(input);
  std::vector<Entry> entries;
  while (std::optional<Entry> entry = reader.next()) {
    entries.push_back(*std::move(entry));
  }
  return entries;
}

std::string problem_of(const std::string& text) {
  const std::vector<Entry> entries = read_all(text);
  return entries.empty() || entries.back() ? "none" : to_string(entries.back().error());
}

std::string content_of(const std::string& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

CandumpLogConfig config_in(const TemporaryFolder& folder) {
  CandumpLogConfig config;
  config.path = folder.path_of("flight.log");
  config.interface = "vcan0";
  return config;
}

TEST(CandumpLine, IsWhatCandumpWrites) {
  std::string text;
  append_candump_line(kFrame, at_us(1'700'000'000'123'456), "vcan0", text);

  EXPECT_EQ(text, kLine);
}

TEST(CandumpLine, ShortTimesAndFramesAreFilledUp) {
  std::string text;
  Frame frame = kFrame;
  frame.id = 0x10;
  frame.length = 1;
  append_candump_line(frame, at_us(42), "can0", text);
  frame.length = 0;
  append_candump_line(frame, at_us(1'000'000), "can0", text);

  EXPECT_EQ(text, "(0000000000.000042) can0 010#E8\n(0000000001.000000) can0 010#\n");
}

TEST(CandumpReader, ReadsStampInterfaceAndFrame) {
  const std::vector<Entry> entries = read_all(kLine);

  ASSERT_EQ(entries.size(), 1U);
  ASSERT_TRUE(entries[0]);
  EXPECT_EQ(entries[0]->stamp, at_us(1'700'000'000'123'456));
  EXPECT_EQ(entries[0]->interface, "vcan0");
  EXPECT_EQ(entries[0]->frame, kFrame);
}

TEST(CandumpReader, AnEmptyLogHasNoEntries) {
  EXPECT_TRUE(read_all("").empty());
}

TEST(CandumpReader, OtherKindsOfFramesAreEntriesWithoutAFrame) {
  for (const char* const frame : {"00000101#E803",
                                  "101#R",
                                  "101#R8",
                                  "101##1E803000030F8FFFF",
                                  "00000101##3",
                                  "20000040#0000000000000000"}) {
    const std::vector<Entry> entries =
        read_all(std::string("(1700000000.123456) vcan0 ") + frame + "\n");
    ASSERT_EQ(entries.size(), 1U) << frame;
    ASSERT_TRUE(entries[0]) << frame;
    EXPECT_EQ(entries[0]->frame, std::nullopt) << frame;
  }
}

TEST(CandumpReader, VariantsOfOtherWritersAreRead) {
  for (const char* const line : {"(1700000000.123456) vcan0 101#e803000030f8ffff\n",
                                 "(1700000000.123456) vcan0 101#E803000030F8FFFF R\n",
                                 "(1700000000.123456) vcan0 101#E803000030F8FFFF_9\n",
                                 "(1700000000.123456) vcan0 101#E803000030F8FFFF\r\n"}) {
    const std::vector<Entry> entries = read_all(line);
    ASSERT_EQ(entries.size(), 1U) << line;
    ASSERT_TRUE(entries[0]) << line;
    EXPECT_EQ(entries[0]->frame, kFrame) << line;
  }
}

TEST(CandumpReader, SaysInWhichLineWhatIsWrongAndGoesOn) {
  const std::vector<Entry> entries = read_all(kLine + "(17x) vcan0 101#00\n" + kLine);

  ASSERT_EQ(entries.size(), 3U);
  EXPECT_TRUE(entries[0]);
  ASSERT_FALSE(entries[1]);
  EXPECT_EQ(to_string(entries[1].error()), "line 2: no time stamp with six fraction digits");
  EXPECT_TRUE(entries[2]);
}

TEST(CandumpReader, ALineCutOffAtTheEndIsTold) {
  for (std::size_t length = 1; length < kLine.size(); ++length) {
    EXPECT_THAT(problem_of(kLine + kLine.substr(0, length)), HasSubstr("line 2: cut off"))
        << length;
  }
}

TEST(CandumpReader, NamesEachKindOfMistake) {
  EXPECT_THAT(problem_of("\n"), HasSubstr("no time stamp"));
  EXPECT_THAT(problem_of("1700000000.123456 vcan0 101#00\n"), HasSubstr("no time stamp"));
  EXPECT_THAT(problem_of("(1700000000.123456789) vcan0 101#00\n"), HasSubstr("no time stamp"));
  EXPECT_THAT(problem_of("(-1.123456) vcan0 101#00\n"), HasSubstr("no time stamp"));
  EXPECT_THAT(problem_of("(99999999999999999999.123456) vcan0 101#00\n"),
              HasSubstr("no time stamp"));
  EXPECT_THAT(problem_of("(1700000000.123456) 101#00\n"), HasSubstr("no interface"));
  EXPECT_THAT(problem_of("(1700000000.123456) vcan0 \n"), HasSubstr("no frame"));
  EXPECT_THAT(problem_of("(1700000000.123456) vcan0 101\n"), HasSubstr("no frame"));
  EXPECT_THAT(problem_of("(1700000000.123456) vcan0 801#00\n"), HasSubstr("no frame"));
  EXPECT_THAT(problem_of("(1700000000.123456) vcan0 1001#00\n"), HasSubstr("no frame"));
  EXPECT_THAT(problem_of("(1700000000.123456) vcan0 101#0\n"), HasSubstr("no frame"));
  EXPECT_THAT(problem_of("(1700000000.123456) vcan0 101#0G\n"), HasSubstr("no frame"));
  EXPECT_THAT(problem_of("(1700000000.123456) vcan0 101#001122334455667788\n"),
              HasSubstr("no frame"));
  EXPECT_THAT(problem_of(std::string(100'000, 'x') + "\n"), HasSubstr("too long"));
}

TEST(CandumpReader, GarbageIsNeverAFrame) {
  Rng rng(11);
  std::string garbage;
  for (int i = 0; i < 200'000; ++i) {
    garbage += static_cast<char>(rng.below(256));
  }

  for (const Entry& entry : read_all(garbage)) {
    EXPECT_FALSE(entry);
  }
}

TEST(CandumpFile, WritesWholeLinesWhenFlushed) {
  const TemporaryFolder folder;
  CandumpFile file(config_in(folder));
  file.add({kFrame, at_us(1'700'000'000'123'456), false});
  EXPECT_EQ(content_of(folder.path_of("flight.log")), "");

  file.flush();

  EXPECT_EQ(content_of(folder.path_of("flight.log")), kLine);
  EXPECT_EQ(file.counters().lines, 1U);
}

TEST(CandumpFile, WhatItWritesIsReadBack) {
  const TemporaryFolder folder;
  Rng rng(5);
  std::vector<PortFrame> frames(5000);
  {
    CandumpFile file(config_in(folder));
    for (std::size_t i = 0; i < frames.size(); ++i) {
      frames[i].frame.id = static_cast<std::uint16_t>(rng.below(2048));
      frames[i].frame.length = static_cast<std::uint8_t>(rng.below(9));
      for (std::size_t at = 0; at < frames[i].frame.length; ++at) {
        frames[i].frame.data[at] = static_cast<std::uint8_t>(rng.below(256));
      }
      frames[i].stamp = at_us(static_cast<std::int64_t>(1'700'000'000'000'000 + 777 * i));
      file.add(frames[i]);
    }
  }

  const std::vector<Entry> entries = read_all(content_of(folder.path_of("flight.log")));

  ASSERT_EQ(entries.size(), frames.size());
  for (std::size_t i = 0; i < frames.size(); ++i) {
    ASSERT_TRUE(entries[i]);
    EXPECT_EQ(entries[i]->frame, frames[i].frame);
    EXPECT_EQ(entries[i]->stamp, frames[i].stamp);
  }
}

TEST(CandumpFile, RotatesBySize) {
  const TemporaryFolder folder;
  CandumpLogConfig config = config_in(folder);
  config.largest_bytes = 10 * kLineBytes;
  {
    CandumpFile file(config);
    for (int i = 0; i < 25; ++i) {
      file.add({kFrame, at_ms(i), false});
    }
  }

  EXPECT_EQ(content_of(folder.path_of("flight.log")).size(), 10 * kLineBytes);
  EXPECT_EQ(content_of(folder.path_of("flight.1.log")).size(), 10 * kLineBytes);
  EXPECT_EQ(content_of(folder.path_of("flight.2.log")).size(), 5 * kLineBytes);
}

TEST(CandumpFile, RotatesByTimeAndWhenTheClockIsSetBack) {
  const TemporaryFolder folder;
  CandumpLogConfig config = config_in(folder);
  config.longest = std::chrono::seconds(10);
  {
    CandumpFile file(config);
    file.add({kFrame, at_ms(100'000), false});
    file.add({kFrame, at_ms(109'999), false});
    file.add({kFrame, at_ms(110'000), false});
    file.add({kFrame, at_ms(5'000), false});
  }

  EXPECT_EQ(content_of(folder.path_of("flight.log")).size(), 2 * kLineBytes);
  EXPECT_EQ(content_of(folder.path_of("flight.1.log")).size(), kLineBytes);
  EXPECT_EQ(content_of(folder.path_of("flight.2.log")).size(), kLineBytes);
}

TEST(CandumpFile, RemovesAnOlderLogOfThatName) {
  const TemporaryFolder folder;
  static_cast<void>(folder.write("flight.log", "old"));
  static_cast<void>(folder.write("flight.1.log", "old"));

  { const CandumpFile file(config_in(folder)); }

  EXPECT_EQ(content_of(folder.path_of("flight.log")), "");
  EXPECT_FALSE(std::filesystem::exists(folder.path_of("flight.1.log")));
}

TEST(CandumpFile, AFullDiskIsToldAndCounted) {
  CandumpLogConfig config;
  config.path = "/dev/full";
  CandumpFile file(config);

  for (int i = 0; i < 3; ++i) {
    file.add({kFrame, at_ms(i), false});
  }
  file.flush();

  EXPECT_EQ(file.counters().failed, 3U);
  EXPECT_EQ(file.counters().lines, 0U);
  EXPECT_THAT(file.take_error().value_or("none"), HasSubstr("/dev/full"));
  EXPECT_EQ(file.take_error(), std::nullopt);
}

TEST(CandumpFile, WhenNoFurtherFileCanBeOpenedTheLastOneGoesOn) {
  const TemporaryFolder folder;
  CandumpLogConfig config = config_in(folder);
  config.largest_bytes = kLineBytes;
  std::filesystem::create_directory(folder.path_of("flight.1.log"));
  CandumpFile file(config);

  for (int i = 0; i < 3; ++i) {
    file.add({kFrame, at_ms(i), false});
  }
  file.flush();

  EXPECT_EQ(content_of(folder.path_of("flight.log")).size(), 3 * kLineBytes);
  EXPECT_THAT(file.take_error().value_or("none"), HasSubstr("flight.1.log"));
}

TEST(CandumpFile, AFolderThatDoesNotExistIsAnErrorAtOnce) {
  CandumpLogConfig config;
  config.path = "/nonexistent/flight.log";

  EXPECT_THROW(CandumpFile{config}, ConfigError);
}

TEST(CandumpFile, InterfaceNamesAreWrittenWithoutWhatReadersStumbleOver) {
  const TemporaryFolder folder;
  CandumpLogConfig config = config_in(folder);
  config.interface = "can-fd_0";
  {
    CandumpFile file(config);
    file.add({kFrame, at_ms(0), false});
  }

  EXPECT_THAT(content_of(folder.path_of("flight.log")), HasSubstr(" canfd0 "));
}

}  // namespace
}  // namespace understory::can
