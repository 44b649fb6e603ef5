// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/base/rng.hpp"

#include <gtest/gtest.h>

namespace understory {
namespace {

TEST(Rng, ForkDependsOnSeedAndNameOnly) {
  Rng a(7);
  const Rng b(7);
  (void)a.next();

  EXPECT_EQ(a.fork("camera").next(), b.fork("camera").next());
  EXPECT_NE(b.fork("camera").next(), b.fork("wind").next());
  EXPECT_NE(b.fork("camera").next(), Rng(8).fork("camera").next());
}

TEST(Rng, UniformStaysInRangeAndHasTheRightMean) {
  Rng rng(1);
  double sum = 0.0;
  for (int i = 0; i < 100000; ++i) {
    const double draw = rng.uniform(2.0, 4.0);
    ASSERT_GE(draw, 2.0);
    ASSERT_LT(draw, 4.0);
    sum += draw;
  }
  EXPECT_NEAR(sum / 100000, 3.0, 0.01);
}

TEST(Rng, NormalHasUnitDeviation) {
  Rng rng(1);
  double sum = 0.0;
  double squares = 0.0;
  for (int i = 0; i < 100000; ++i) {
    const double draw = rng.normal();
    sum += draw;
    squares += draw * draw;
  }
  EXPECT_NEAR(sum / 100000, 0.0, 0.02);
  EXPECT_NEAR(squares / 100000, 1.0, 0.02);
}

TEST(Rng, BelowReachesEveryValue) {
  Rng rng(3);
  std::array<int, 5> seen{};
  for (int i = 0; i < 1000; ++i) {
    ++seen.at(rng.below(5));
  }
  for (const int count : seen) {
    EXPECT_GT(count, 100);
  }
}

}  // namespace
}  // namespace understory
