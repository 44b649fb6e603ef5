// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <fstream>
#include <map>
#include <memory>
#include <regex>
#include <string>

#include <gtest/gtest.h>

#include "support/fake_can_port.hpp"
#include "understory/base/rng.hpp"
#include "understory/can/bus_load.hpp"
#include "understory/can/messages.hpp"
#include "understory/can/wire_length.hpp"
#include "understory/port/memory_can_bus.hpp"

namespace understory::can {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

constexpr int kBitsPerSecond = 1'000'000;
constexpr Duration kJitter = milliseconds(1);  // of a thread that is woken to send

// The frame as a string of bits, and a polynomial division on it: slow, and not our code.
std::string bits_of(unsigned value, int count) {
  std::string bits;
  for (int i = count - 1; i >= 0; --i) {
    bits += ((value >> static_cast<unsigned>(i)) & 1U) != 0 ? '1' : '0';
  }
  return bits;
}

std::string remainder_of(std::string bits) {
  const std::string divisor = "1100010110011001";  // 0xC599, that is 0x4599 and x^15
  const std::size_t size = bits.size();
  bits += std::string(15, '0');
  for (std::size_t i = 0; i < size; ++i) {
    const bool divides = bits[i] == '1';
    for (std::size_t k = 0; divides && k < divisor.size(); ++k) {
      bits[i + k] = bits[i + k] == divisor[k] ? '0' : '1';
    }
  }
  return bits.substr(size);
}

std::size_t slow_wire_bits(const Frame& frame) {
  std::string bits = "0" + bits_of(frame.id, 11) + "000" + bits_of(frame.length, 4);
  for (std::size_t i = 0; i < frame.length; ++i) {
    bits += bits_of(frame.data[i], 8);
  }
  bits += remainder_of(bits);
  std::string stuffed;
  for (const char bit : bits) {
    stuffed += bit;
    if (stuffed.size() >= 5 && stuffed.substr(stuffed.size() - 5) == std::string(5, bit)) {
      stuffed += bit == '0' ? '1' : '0';
    }
  }
  return stuffed.size() + 10;
}

TEST(WireLength, IsThatOfAFrameBuiltBitByBit) {
  Rng rng(17);
  for (int i = 0; i < 2000; ++i) {
    Frame frame;
    frame.id = static_cast<std::uint16_t>(rng.below(2048));
    frame.length = static_cast<std::uint8_t>(rng.below(9));
    // Few ones or few zeros are stuffed most.
    const std::uint64_t kind = rng.below(3);
    for (std::uint8_t& byte : frame.data) {
      const auto few = static_cast<std::uint8_t>(rng.below(256) & rng.below(256) & rng.below(256));
      const auto many = static_cast<std::uint8_t>(0xFFU - few);
      const auto any = static_cast<std::uint8_t>(rng.below(256));
      byte = kind == 0 ? few : (kind == 1 ? many : any);
    }
    ASSERT_EQ(static_cast<std::size_t>(wire_bits(frame)), slow_wire_bits(frame)) << i;
    ASSERT_LE(wire_bits(frame) + kInterframeBits, worst_case_bits(frame.length)) << i;
  }
}

TEST(WireLength, TheWorstCasesAreThoseOfThePaper) {
  EXPECT_EQ(worst_case_bits(0), 55);
  EXPECT_EQ(worst_case_bits(1), 65);
  EXPECT_EQ(worst_case_bits(8), 135);
}

// The example of Davis et al. 2007 that refutes the older analysis: the second instance of the last
// message is its worst.
TEST(WorstResponse, AllInstancesOfABusyPeriodAreLookedAt) {
  const int bits_per_s = 135'000;  // a frame takes 1 ms
  const std::vector<PeriodicMessage> messages = {
      {1, microseconds(2500)}, {2, microseconds(3500)}, {3, microseconds(3500)}};

  EXPECT_EQ(worst_response(messages, 1, bits_per_s), microseconds(2000));
  EXPECT_EQ(worst_response(messages, 2, bits_per_s), microseconds(3000));
  EXPECT_EQ(worst_response(messages, 3, bits_per_s), microseconds(3500));
}

TEST(WorstResponse, OfTheOnlyMessageIsItsLength) {
  EXPECT_EQ(worst_response({{1, milliseconds(5)}}, 1, kBitsPerSecond), microseconds(135));
}

TEST(WorstResponse, WithoutEnoughRoomThereIsNone) {
  const std::vector<PeriodicMessage> messages = {{1, microseconds(200)}, {2, microseconds(300)}};

  EXPECT_TRUE(worst_response(messages, 1, kBitsPerSecond).has_value());
  EXPECT_FALSE(worst_response(messages, 2, kBitsPerSecond).has_value());
}

// The periods of the DBC, which are the shortest.
std::map<std::uint16_t, Duration> dbc_periods() {
  std::map<std::uint16_t, Duration> periods;
  std::ifstream file(std::string(UNDERSTORY_SOURCE_DIR) + "/firmware_bridge/can/understory.dbc");
  const std::regex pattern("BA_ \"GenMsgCycleTime\" BO_ ([0-9]+) ([0-9]+);.*");
  std::smatch found;
  for (std::string line; std::getline(file, line);) {
    if (std::regex_match(line, found, pattern)) {
      periods[static_cast<std::uint16_t>(std::stoi(found[1]))] = milliseconds(std::stoi(found[2]));
    }
  }
  return periods;
}

enum class Mode { kNormal, kFast, kDirect };

// KILL is repeated every 10 ms until confirmed; ESC_CMD is sent at 400 Hz, in direct mode only.
std::vector<PeriodicMessage> messages_of(Mode mode) {
  std::vector<PeriodicMessage> messages;
  for (const auto& [id, fastest] : dbc_periods()) {
    Duration period = fastest;
    const bool is_halved = mode == Mode::kNormal && fastest == milliseconds(5);
    if (id == Kill::kId || is_halved) {
      period = milliseconds(10);
    } else if (id == EscCmd::kId) {
      period = microseconds(2500);
    }
    if (id != EscCmd::kId || mode == Mode::kDirect) {
      messages.push_back({id, period, kJitter});
    }
  }
  return messages;
}

TEST(BusLoad, OfOurMessagesIsAsDocumented) {
  ASSERT_EQ(dbc_periods().size(), 27U);

  EXPECT_NEAR(worst_load(messages_of(Mode::kNormal), kBitsPerSecond), 0.194, 0.0005);
  EXPECT_NEAR(worst_load(messages_of(Mode::kFast), kBitsPerSecond), 0.356, 0.0005);
  EXPECT_NEAR(worst_load(messages_of(Mode::kDirect), kBitsPerSecond), 0.410, 0.0005);
}

// Of random payloads, because worst cases are rare.
TEST(BusLoad, OfABusInMemoryIsBelowTheWorstAndNotFarBelow) {
  MemoryCanBus bus(kBitsPerSecond, Rng(2));
  const std::unique_ptr<MemoryCanPort> port = bus.open(64);
  const std::vector<PeriodicMessage> messages = messages_of(Mode::kFast);
  Rng rng(3);
  const Duration length = std::chrono::seconds(4);

  for (Time now; now < Time() + length; now += milliseconds(1)) {
    bus.advance(now);
    for (const PeriodicMessage& message : messages) {
      if (now.time_since_epoch() % message.period == Duration(0)) {
        Frame frame = test::frame_of(message.id);
        for (std::uint8_t& byte : frame.data) {
          byte = static_cast<std::uint8_t>(rng.below(256));
        }
        ASSERT_EQ(port->send(frame), SendResult::kSent);
      }
    }
  }

  const double load = to_seconds(bus.busy()) / to_seconds(length);
  const double worst = worst_load(messages, kBitsPerSecond);
  EXPECT_LT(load, worst);
  EXPECT_GT(load, 0.8 * worst);
}

TEST(WorstResponse, OfOurMessagesIsAsDocumented) {
  const std::vector<PeriodicMessage> messages = messages_of(Mode::kDirect);
  const auto response_ms = [&](std::uint16_t id) {
    return 1e3 * to_seconds(worst_response(messages, id, kBitsPerSecond).value());
  };

  EXPECT_NEAR(response_ms(Kill::kId), 1.3, 0.05);
  EXPECT_NEAR(response_ms(SpCommit::kId), 2.4, 0.05);
  EXPECT_NEAR(response_ms(OdoRate::kId), 3.6, 0.05);
}

TEST(WorstResponse, OfEverySetIsLessThanItsPeriod) {
  const std::vector<PeriodicMessage> messages = messages_of(Mode::kDirect);

  for (const PeriodicMessage& message : messages) {
    const std::optional<Duration> response = worst_response(messages, message.id, kBitsPerSecond);
    ASSERT_TRUE(response) << message.id;
    EXPECT_LT(*response, milliseconds(5)) << message.id;
  }
}

}  // namespace
}  // namespace understory::can
