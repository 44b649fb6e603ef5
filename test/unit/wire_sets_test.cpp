// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/link/wire_sets.hpp"

#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "support/fake_can_port.hpp"
#include "understory/base/rng.hpp"

namespace understory::can {
namespace {

using test::at_ms;
using test::at_us;

// Every value tells which set it is of.
WireSetpoint numbered(int number) {
  WireSetpoint wire;
  wire.setpoint.position_m = Vector3d::Constant(number);
  wire.setpoint.velocity_mps = Vector3d::Constant(0.1 * number);
  wire.setpoint.acceleration_mps2 = Vector3d::Constant(0.2 * number);
  wire.setpoint.yaw_rad = 0.01 * number;
  wire.setpoint.yaw_rate_radps = 0.1 * number;
  wire.seq = static_cast<std::uint8_t>(number);
  wire.time_wire_us = static_cast<std::uint32_t>(number);
  return wire;
}

FrameSet frames_of(int number) {
  return *encode_setpoint(numbered(number), static_cast<std::uint8_t>(number & 0xF));
}

bool is_whole(const WireSetpoint& wire, int number) {
  const WireSetpoint sent = numbered(number);
  return wire.seq == sent.seq && wire.time_wire_us == sent.time_wire_us &&
         wire.setpoint.position_m.isApprox(sent.setpoint.position_m, 1e-3) &&
         wire.setpoint.velocity_mps.isApprox(sent.setpoint.velocity_mps, 1e-3) &&
         wire.setpoint.acceleration_mps2.isApprox(sent.setpoint.acceleration_mps2, 1e-2) &&
         std::abs(wire.setpoint.yaw_rad - sent.setpoint.yaw_rad) < 1e-4;
}

struct Receiver {
  // Whether the set is complete with this frame.
  bool take(const Frame& frame, Time now) {
    const bool is_complete = inbox.add(frame, now);
    sets += is_complete ? 1 : 0;
    return is_complete;
  }
  void take_all(const FrameSet& frames, Time now) {
    for (const Frame& frame : frames) {
      take(frame, now);
    }
  }
  [[nodiscard]] bool has(int number) const {
    const std::optional<WireSetpoint> wire = inbox.setpoint();
    return wire && is_whole(*wire, number);
  }

  SetpointReceiver inbox;
  int sets = 0;
};

TEST(SetpointFrames, AreTheBytesOfTheProtocol) {
  WireSetpoint wire;
  wire.setpoint.position_m = {1.0, -2.0, 1.5};
  wire.setpoint.velocity_mps = {1.0, 0.0, -1.0};
  wire.setpoint.acceleration_mps2 = {2.0, 0.0, -2.0};
  wire.setpoint.yaw_rad = 1.0;
  wire.setpoint.yaw_rate_radps = -0.5;
  wire.seq = 7;
  wire.time_wire_us = 0x123456;

  const FrameSet frames = *encode_setpoint(wire, 3);

  const auto bytes_of = [](const Frame& frame) {
    return to_candump(frame).substr(0, 4) + to_candump(frame).substr(6);
  };
  EXPECT_EQ(bytes_of(frames[0]), "100#03E8038030F87F");
  EXPECT_EQ(bytes_of(frames[1]), "101#03DC0580563412");
  EXPECT_EQ(bytes_of(frames[2]), "102#03E803000018FC");
  EXPECT_EQ(bytes_of(frames[3]), "103#03E803000018FC");
  EXPECT_EQ(bytes_of(frames[4]), "104#0310270CFE1F07");
}

TEST(SetpointSet, IsGivenOnceInEveryOrderOfItsFrames) {
  std::array<std::size_t, 5> order{0, 1, 2, 3, 4};
  int orders = 0;
  do {
    Receiver receiver;
    const FrameSet frames = frames_of(5);
    for (std::size_t i = 0; i < order.size(); ++i) {
      ASSERT_EQ(receiver.take(frames[order[i]], at_ms(0)), i == 4);
    }
    ASSERT_TRUE(receiver.has(5));
    ++orders;
  } while (std::next_permutation(order.begin(), order.end()));

  EXPECT_EQ(orders, 120);
}

TEST(SetpointSet, IsNotGivenAgainForFramesThatComeTwice) {
  Receiver receiver;
  const FrameSet frames = frames_of(1);

  for (const Frame& frame : frames) {
    receiver.take(frame, at_ms(0));
    receiver.take(frame, at_ms(0));
  }
  receiver.take_all(frames, at_ms(1));

  EXPECT_EQ(receiver.sets, 1);
}

TEST(SetpointSet, IsNotGivenWithoutAnyOneOfItsFrames) {
  for (std::size_t missing = 0; missing < 5; ++missing) {
    Receiver receiver;
    for (int number = 0; number < 40; ++number) {
      const FrameSet frames = frames_of(number);
      for (std::size_t i = 0; i < frames.size(); ++i) {
        if (i != missing) {
          receiver.take(frames[i], Time(number * std::chrono::milliseconds(10)));
        }
      }
    }
    EXPECT_EQ(receiver.sets, 0) << "frame " << missing;
    EXPECT_EQ(receiver.inbox.assembly().torn(), 39U);
  }
}

TEST(SetpointSet, IsNotMadeOfTheFramesOfTwo) {
  for (std::size_t split = 1; split < 5; ++split) {
    Receiver receiver;
    const FrameSet first = frames_of(1);
    const FrameSet second = frames_of(2);
    for (std::size_t i = 0; i < 5; ++i) {
      receiver.take(i < split ? first[i] : second[i], at_ms(0));
    }
    EXPECT_EQ(receiver.sets, 0) << split;
  }
}

// Sixteen sets later a counter comes again.
TEST(SetpointSet, IsNotMadeOfTheFramesOfTwoWithTheSameCounter) {
  Receiver receiver;
  const FrameSet early = frames_of(1);
  const FrameSet late = frames_of(17);
  for (std::size_t i = 0; i < 3; ++i) {
    receiver.take(early[i], at_ms(0));
  }
  receiver.take(late[3], at_ms(160));
  receiver.take(late[4], at_ms(160));

  EXPECT_EQ(receiver.sets, 0);
}

TEST(SetpointSet, OfAnOlderCounterThatComesLateIsIgnored) {
  Receiver receiver;
  const FrameSet old = frames_of(1);
  receiver.take(old[0], at_ms(0));
  const FrameSet current = frames_of(2);
  for (std::size_t i = 1; i < 5; ++i) {
    receiver.take(current[i], at_ms(1));
  }

  EXPECT_FALSE(receiver.take(old[1], at_ms(2)));
  EXPECT_TRUE(receiver.take(current[0], at_ms(3)));
  EXPECT_TRUE(receiver.has(2));
}

TEST(SetpointSet, KeepsItsValuesWhenALateFrameOfTheLastOneComes) {
  Receiver receiver;
  const FrameSet old = frames_of(1);
  receiver.take(old[0], at_ms(0));
  receiver.take(old[1], at_ms(0));
  receiver.take_all(frames_of(2), at_ms(1));
  ASSERT_EQ(receiver.sets, 1);

  receiver.take(old[4], at_ms(2));

  EXPECT_TRUE(receiver.has(2));
  EXPECT_EQ(receiver.sets, 1);
}

TEST(SetpointSet, MustBeCompleteWithinTwentyMilliseconds) {
  for (const auto& [last_us, is_given] : {std::pair(20'000, true), std::pair(20'001, false)}) {
    Receiver receiver;
    const FrameSet frames = frames_of(4);
    for (std::size_t i = 0; i < 4; ++i) {
      receiver.take(frames[i], at_us(0));
    }
    EXPECT_EQ(receiver.take(frames[4], at_us(last_us)), is_given) << last_us;
  }
}

TEST(SetpointSet, AfterATornOneTheNextIsWhole) {
  Receiver receiver;
  const FrameSet torn = frames_of(1);
  receiver.take(torn[0], at_ms(0));
  receiver.take(torn[3], at_ms(0));

  receiver.take_all(frames_of(2), at_ms(10));

  EXPECT_EQ(receiver.sets, 1);
  EXPECT_TRUE(receiver.has(2));
  EXPECT_EQ(receiver.inbox.assembly().torn(), 1U);
}

TEST(SetpointSet, WithAFrameThatIsAlteredIsNotGiven) {
  for (std::size_t bad = 0; bad < 5; ++bad) {
    Receiver receiver;
    FrameSet frames = frames_of(9);
    frames[bad].data[5] ^= 0x10U;

    receiver.take_all(frames, at_ms(0));

    EXPECT_EQ(receiver.sets, 0) << bad;
    EXPECT_EQ(receiver.inbox.counters().errors, 1U);
  }
}

// Whatever is lost, doubled and late, what is given out was sent as it is.
TEST(SetpointSet, IsWholeOrNotGivenWhateverTheBusDoes) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Rng rng(seed);
    Receiver receiver;
    std::vector<std::pair<Time, Frame>> arrivals;
    for (int number = 0; number < 200; ++number) {
      for (const Frame& frame : frames_of(number)) {
        for (std::uint64_t copies = rng.below(10) == 0 ? rng.below(3) : 1; copies > 0; --copies) {
          const auto delay_ms = rng.below(5) == 0 ? rng.below(30) : 0;
          arrivals.emplace_back(
              Time(number * std::chrono::milliseconds(10) + std::chrono::milliseconds(delay_ms)),
              frame);
        }
      }
    }
    std::stable_sort(arrivals.begin(), arrivals.end(), [](const auto& a, const auto& b) {
      return a.first < b.first;
    });

    for (const auto& [now, frame] : arrivals) {
      if (receiver.take(frame, now)) {
        ASSERT_TRUE(receiver.has(receiver.inbox.setpoint()->seq)) << "seed " << seed;
      }
    }
    EXPECT_GT(receiver.sets, 20) << "seed " << seed;
  }
}

}  // namespace
}  // namespace understory::can
