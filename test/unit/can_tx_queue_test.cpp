// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/fake_can_port.hpp"
#include "understory/base/rng.hpp"
#include "understory/port/tx_queue.hpp"

namespace understory::can {
namespace {

using test::at_ms;
using test::at_us;
using test::FakeCanPort;
using test::frame_of;
using ::testing::ElementsAre;

const std::vector<std::uint16_t> kSet = {0x100, 0x101, 0x102, 0x103, 0x104};

TxQueue host_queue() {
  return TxQueue(id_set({0x010, 0x020, 0x100, 0x101, 0x102, 0x103, 0x104, 0x400}),
                 id_set({0x100, 0x101, 0x102, 0x103, 0x104}));
}

void push_set(TxQueue& queue, std::uint8_t counter, Time now) {
  for (const std::uint16_t id : kSet) {
    queue.push(frame_of(id, counter), now);
  }
}

// Confirms whatever is in flight at once, until nothing more leaves.
void drain(TxQueue& queue, FakeCanPort& port, Time now) {
  std::size_t echoed = port.sent.size() - queue.in_flight();
  for (queue.pump(port, now); echoed < port.sent.size(); queue.pump(port, now)) {
    queue.confirm(port.sent[echoed++], now);
  }
}

TEST(TxQueue, SendsTheLowestIdentifierFirst) {
  TxQueue queue = host_queue();
  FakeCanPort port;
  queue.push(frame_of(0x400), at_ms(0));
  queue.push(frame_of(0x020), at_ms(0));
  queue.push(frame_of(0x010), at_ms(0));

  drain(queue, port, at_ms(0));

  EXPECT_THAT(port.sent_ids(), ElementsAre(0x010, 0x020, 0x400));
}

TEST(TxQueue, TheNewestFrameOfAnIdentifierWins) {
  TxQueue queue = host_queue();
  FakeCanPort port;
  queue.push(frame_of(0x020, 1), at_ms(0));
  queue.push(frame_of(0x020, 2), at_ms(1));

  drain(queue, port, at_ms(1));

  EXPECT_THAT(port.sent, ElementsAre(frame_of(0x020, 2)));
  EXPECT_EQ(queue.counters().replaced, 1U);
}

TEST(TxQueue, AFrameThatWaitedLongerThanItsDeadlineIsNotSent) {
  TxQueue queue = host_queue();
  FakeCanPort port;
  queue.push(frame_of(0x020), at_ms(0));
  queue.push(frame_of(0x400), at_us(1));

  drain(queue, port, at_us(20'001));

  EXPECT_THAT(port.sent_ids(), ElementsAre(0x400));
  EXPECT_EQ(queue.counters().expired, 1U);
}

TEST(TxQueue, WhenTheClockIsSetBackWhatWaitsIsNotSent) {
  TxQueue queue = host_queue();
  FakeCanPort port;
  queue.push(frame_of(0x020), at_ms(5000));

  drain(queue, port, at_ms(1000));

  EXPECT_TRUE(port.sent.empty());
}

TEST(TxQueue, AtMostTwoFramesAreInFlightUntilAnEchoMakesRoom) {
  TxQueue queue = host_queue();
  FakeCanPort port;
  push_set(queue, 0, at_ms(0));

  queue.pump(port, at_ms(0));
  queue.pump(port, at_ms(1));
  EXPECT_THAT(port.sent_ids(), ElementsAre(0x100, 0x101));

  queue.confirm(port.sent[0], at_ms(1));
  queue.pump(port, at_ms(1));
  EXPECT_THAT(port.sent_ids(), ElementsAre(0x100, 0x101, 0x102));
  EXPECT_EQ(queue.in_flight(), 2U);
  EXPECT_EQ(queue.counters().confirmed, 1U);
}

TEST(TxQueue, AnUrgentFrameOvertakesEverythingThatIsNotInFlight) {
  TxQueue queue = host_queue();
  FakeCanPort port;
  push_set(queue, 0, at_ms(0));
  queue.pump(port, at_ms(0));

  queue.push(frame_of(0x010), at_ms(1));
  drain(queue, port, at_ms(1));

  EXPECT_THAT(port.sent_ids(), ElementsAre(0x100, 0x101, 0x010, 0x102, 0x103, 0x104));
}

TEST(TxQueue, ForeignIdentifiersAreRefused) {
  TxQueue queue = host_queue();
  FakeCanPort port;

  queue.push(frame_of(0x200), at_ms(0));
  queue.push(frame_of(0xFFF), at_ms(0));
  drain(queue, port, at_ms(0));

  EXPECT_TRUE(port.sent.empty());
  EXPECT_EQ(queue.counters().refused, 2U);
}

TEST(TxQueue, ANewerSetReplacesAnOlderOneAsAWhole) {
  TxQueue queue = host_queue();
  FakeCanPort port;
  push_set(queue, 3, at_ms(0));

  queue.push(frame_of(0x104, 4), at_ms(5));
  drain(queue, port, at_ms(5));

  EXPECT_THAT(port.sent, ElementsAre(frame_of(0x104, 4)));
  EXPECT_EQ(queue.counters().replaced, 5U);
  EXPECT_EQ(queue.counters().torn_sets, 0U);
}

TEST(TxQueue, AnOlderSetOfWhichAPartWasSentIsTorn) {
  TxQueue queue = host_queue();
  FakeCanPort port;
  push_set(queue, 3, at_ms(0));
  queue.pump(port, at_ms(0));

  push_set(queue, 4, at_ms(10));
  drain(queue, port, at_ms(10));

  EXPECT_THAT(port.sent,
              ElementsAre(frame_of(0x100, 3),
                          frame_of(0x101, 3),
                          frame_of(0x100, 4),
                          frame_of(0x101, 4),
                          frame_of(0x102, 4),
                          frame_of(0x103, 4),
                          frame_of(0x104, 4)));
  EXPECT_EQ(queue.counters().torn_sets, 1U);
}

TEST(TxQueue, NoRoomDropsTheRestOfThatSetAndNothingElse) {
  TxQueue queue = host_queue();
  FakeCanPort port;
  port.answers = {SendResult::kSent, SendResult::kFull};
  push_set(queue, 3, at_ms(0));
  queue.push(frame_of(0x400), at_ms(0));

  queue.pump(port, at_ms(0));
  queue.push(frame_of(0x103, 3), at_ms(1));
  drain(queue, port, at_ms(1));

  EXPECT_THAT(port.sent_ids(), ElementsAre(0x100, 0x400));
  EXPECT_EQ(queue.counters().full, 1U);
  EXPECT_EQ(queue.counters().dropped_with_set, 5U);
  EXPECT_EQ(queue.counters().torn_sets, 1U);
}

TEST(TxQueue, AfterASetWithoutRoomTheNextOneIsSentWhole) {
  TxQueue queue = host_queue();
  FakeCanPort port;
  port.answers = {SendResult::kFull};
  push_set(queue, 3, at_ms(0));
  queue.pump(port, at_ms(0));

  push_set(queue, 4, at_ms(10));
  drain(queue, port, at_ms(10));

  EXPECT_EQ(port.sent_ids(), kSet);
  EXPECT_EQ(queue.counters().torn_sets, 0U);
}

TEST(TxQueue, ASingleFrameWithoutRoomIsTriedAgainBeforeItsDeadline) {
  TxQueue queue = host_queue();
  FakeCanPort port;
  port.answers = {SendResult::kFull, SendResult::kFull};
  queue.push(frame_of(0x010), at_ms(0));

  queue.pump(port, at_ms(0));
  queue.pump(port, at_us(999));
  EXPECT_EQ(port.tries, 1);
  EXPECT_EQ(queue.wake_at(), at_ms(1));

  queue.pump(port, at_ms(1));
  queue.pump(port, at_ms(2));
  EXPECT_EQ(port.tries, 3);
  EXPECT_THAT(port.sent_ids(), ElementsAre(0x010));
}

TEST(TxQueue, WithoutAnEchoItStallsUntilTheNextOne) {
  TxQueue queue = host_queue();
  FakeCanPort port;
  push_set(queue, 0, at_ms(0));
  queue.pump(port, at_ms(0));
  EXPECT_EQ(queue.wake_at(), at_ms(100));

  queue.pump(port, at_us(99'999));
  EXPECT_FALSE(queue.is_stalled());
  queue.pump(port, at_ms(100));
  EXPECT_TRUE(queue.is_stalled());
  EXPECT_EQ(queue.counters().unconfirmed, 2U);

  queue.confirm(port.sent[0], at_ms(150));
  EXPECT_FALSE(queue.is_stalled());
  EXPECT_EQ(queue.counters().unknown_echoes, 1U);
}

TEST(TxQueue, WhileStalledOneFrameInAHundredMillisecondsProbesTheBus) {
  TxQueue queue = host_queue();
  FakeCanPort port;

  for (int ms = 0; ms < 1000; ms += 10) {
    push_set(queue, static_cast<std::uint8_t>(ms / 10 % 16), at_ms(ms));
    queue.pump(port, at_ms(ms));
  }

  EXPECT_EQ(port.sent.size(), 2U + 9U);
}

TEST(TxQueue, OneLostEchoAmongOthersIsNoStallAndTakesNoRoom) {
  TxQueue queue = host_queue();
  FakeCanPort port;
  push_set(queue, 0, at_ms(0));
  queue.pump(port, at_ms(0));

  queue.confirm(port.sent[1], at_ms(1));
  queue.pump(port, at_ms(1));

  EXPECT_THAT(port.sent_ids(), ElementsAre(0x100, 0x101, 0x102, 0x103));
  EXPECT_FALSE(queue.is_stalled());
  EXPECT_EQ(queue.counters().confirmed, 1U);
  EXPECT_EQ(queue.counters().unconfirmed, 1U);
}

TEST(TxQueue, AnAlteredEchoConfirmsTheFrameOfItsIdentifier) {
  TxQueue queue = host_queue();
  FakeCanPort port;
  queue.push(frame_of(0x400), at_ms(0));
  queue.pump(port, at_ms(0));

  queue.confirm(frame_of(0x400, 9), at_ms(1));

  EXPECT_EQ(queue.in_flight(), 0U);
}

TEST(TxQueue, ANewSessionPurgesWhatWaitsAndWhatIsInFlight) {
  TxQueue queue = host_queue();
  FakeCanPort port;
  push_set(queue, 0, at_ms(0));
  queue.pump(port, at_ms(0));

  port.session_number = 2;
  drain(queue, port, at_ms(1));

  EXPECT_EQ(port.sent.size(), 2U);
  EXPECT_EQ(queue.in_flight(), 0U);
  EXPECT_EQ(queue.waiting(), 0U);
  EXPECT_EQ(queue.counters().purged, 5U);
}

TEST(TxQueue, WithoutABusNothingIsKeptForLater) {
  TxQueue queue = host_queue();
  FakeCanPort port;
  port.answers = {SendResult::kDown};
  push_set(queue, 0, at_ms(0));
  queue.push(frame_of(0x010), at_ms(0));

  queue.pump(port, at_ms(0));
  drain(queue, port, at_ms(1));

  EXPECT_TRUE(port.sent.empty());
  EXPECT_EQ(queue.counters().purged, 6U);
}

// The receiver applies five frames of one counter value: it must never be able to mix two sets.
TEST(TxQueue, NoSetEverLeavesAfterFramesOfANewerOne) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    Rng rng(seed);
    TxQueue queue = host_queue();
    FakeCanPort port;
    std::size_t echoed = 0;
    int set = 0;
    for (int us = 0; us < 200'000; us += 500) {
      if (rng.uniform() < 0.3) {
        const auto first = static_cast<std::size_t>(rng.below(kSet.size()));
        set += first == 0 ? 1 : 0;
        for (std::size_t i = first; i < kSet.size(); ++i) {
          Frame frame = frame_of(kSet[i], static_cast<std::uint8_t>(set % 16));
          frame.data[2] = static_cast<std::uint8_t>(set);
          queue.push(frame, at_us(us));
        }
      }
      if (rng.uniform() < 0.2) {
        port.answers.push_back(SendResult::kFull);
      }
      queue.pump(port, at_us(us));
      while (echoed < port.sent.size() && rng.uniform() < 0.4) {
        queue.confirm(port.sent[echoed++], at_us(us));
      }
      ASSERT_LE(queue.in_flight(), TxQueue::kWindow) << "seed " << seed;
    }
    for (std::size_t i = 1; i < port.sent.size(); ++i) {
      ASSERT_LE(port.sent[i - 1].data[2], port.sent[i].data[2]) << "seed " << seed;
    }
  }
}

}  // namespace
}  // namespace understory::can
