// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <numeric>

#include <gtest/gtest.h>

#include "understory/can/receiver.hpp"
#include "understory/can/set_assembly.hpp"

namespace understory::can {
namespace {

constexpr Time at_ms(int ms) {
  return Time(std::chrono::milliseconds(ms));
}

TEST(CounterCheck, CountingUpAndAroundIsGood) {
  CounterCheck check;

  for (int i = 0; i < 40; ++i) {
    EXPECT_EQ(check.accept(static_cast<std::uint8_t>(i % 16)), Verdict::kGood) << i;
  }

  EXPECT_EQ(check.counters().good, 40U);
  EXPECT_EQ(check.counters().lost, 0U);
}

TEST(CounterCheck, AnyCounterMayBeTheFirst) {
  CounterCheck check;

  EXPECT_EQ(check.accept(11), Verdict::kGood);
}

TEST(CounterCheck, TheSameCounterAgainIsDropped) {
  CounterCheck check;
  EXPECT_EQ(check.accept(3), Verdict::kGood);

  EXPECT_EQ(check.accept(3), Verdict::kRepeated);

  EXPECT_EQ(check.accept(4), Verdict::kGood);
  EXPECT_EQ(check.counters().repeated, 1U);
}

TEST(CounterCheck, UpToTwoLostFramesAreCountedAndForgiven) {
  CounterCheck check;
  EXPECT_EQ(check.accept(15), Verdict::kGood);

  EXPECT_EQ(check.accept(2), Verdict::kGood);  // 0 and 1 are lost

  EXPECT_EQ(check.counters().lost, 2U);
}

TEST(CounterCheck, AfterALongerGapTwoInARowAreNeeded) {
  CounterCheck check;
  EXPECT_EQ(check.accept(0), Verdict::kGood);

  EXPECT_EQ(check.accept(4), Verdict::kWrongSequence);
  EXPECT_EQ(check.accept(5), Verdict::kWrongSequence);
  EXPECT_EQ(check.accept(6), Verdict::kGood);
}

TEST(CounterCheck, AFrameFromThePastIsOutOfSequence) {
  CounterCheck check;
  EXPECT_EQ(check.accept(7), Verdict::kGood);

  EXPECT_EQ(check.accept(6), Verdict::kWrongSequence);
}

TEST(CounterCheck, FiveErrorsMoreThanGoodFramesAreAFault) {
  CounterCheck check;
  EXPECT_EQ(check.accept(0), Verdict::kGood);
  for (int i = 0; i < 4; ++i) {
    check.reject();
  }
  EXPECT_FALSE(check.is_faulty());

  check.reject();
  EXPECT_TRUE(check.is_faulty());

  EXPECT_EQ(check.accept(1), Verdict::kGood);
  EXPECT_FALSE(check.is_faulty());
}

TEST(SetAssembly, IsCompleteInEveryOrder) {
  std::array<unsigned, 5> order{};
  std::iota(order.begin(), order.end(), 0U);
  int orders = 0;
  do {
    SetAssembly set(5);
    for (std::size_t i = 0; i < order.size(); ++i) {
      EXPECT_EQ(set.add(order[i], 9, at_ms(static_cast<int>(i))), i + 1 == order.size());
    }
    ++orders;
  } while (std::next_permutation(order.begin(), order.end()));

  EXPECT_EQ(orders, 120);
}

TEST(SetAssembly, IsNeverCompleteWithAnyOneFrameMissingAndOthersTwice) {
  for (unsigned missing = 0; missing < 5; ++missing) {
    SetAssembly set(5);
    for (int round = 0; round < 2; ++round) {
      for (unsigned part = 0; part < 5; ++part) {
        EXPECT_FALSE(part != missing && set.add(part, 2, at_ms(round))) << missing;
      }
    }
    EXPECT_EQ(set.complete(), 0U);
  }
}

TEST(SetAssembly, ADuplicateAfterCompletionDoesNotCompleteItAgain) {
  SetAssembly set(2);
  EXPECT_FALSE(set.add(0, 1, at_ms(0)));
  EXPECT_TRUE(set.add(1, 1, at_ms(1)));

  EXPECT_FALSE(set.add(0, 1, at_ms(2)));

  EXPECT_EQ(set.complete(), 1U);
  EXPECT_EQ(set.torn(), 0U);
}

TEST(SetAssembly, FramesOfTwoSetsNeverMakeOne) {
  SetAssembly set(2);
  EXPECT_FALSE(set.add(0, 1, at_ms(0)));

  EXPECT_FALSE(set.add(1, 2, at_ms(10)));
  EXPECT_TRUE(set.add(0, 2, at_ms(11)));

  EXPECT_EQ(set.torn(), 1U);
}

TEST(SetAssembly, ALateFrameOfAnEarlierSetIsIgnored) {
  SetAssembly set(2);
  EXPECT_FALSE(set.add(0, 1, at_ms(0)));
  EXPECT_FALSE(set.add(0, 2, at_ms(10)));

  EXPECT_FALSE(set.add(1, 1, at_ms(11)));
  EXPECT_TRUE(set.add(1, 2, at_ms(12)));
}

TEST(SetAssembly, WhatTakesLongerThanItsWindowIsTorn) {
  SetAssembly set(2);
  EXPECT_FALSE(set.add(0, 1, at_ms(0)));

  EXPECT_FALSE(set.add(1, 1, at_ms(21)));

  EXPECT_EQ(set.torn(), 1U);
  EXPECT_EQ(set.complete(), 0U);
}

// The counter comes round every 160 ms at 100 Hz: a frame left over from then is no part of now.
TEST(SetAssembly, TheSameCounterOneRoundLaterIsAnotherSet) {
  SetAssembly set(2);
  EXPECT_FALSE(set.add(0, 1, at_ms(0)));

  EXPECT_FALSE(set.add(1, 1, at_ms(160)));
  EXPECT_TRUE(set.add(0, 1, at_ms(161)));
}

}  // namespace
}  // namespace understory::can
