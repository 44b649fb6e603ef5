// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/link/clock_sync.hpp"

#include <gtest/gtest.h>

#include "support/fake_can_port.hpp"
#include "understory/base/rng.hpp"

namespace understory::can {
namespace {

using std::chrono::hours;
using std::chrono::milliseconds;
using std::chrono::seconds;
using test::at_us;

constexpr std::uint32_t kRound = 1U << 24U;

// A vehicle whose clock is ahead by so much.
struct Exchange {
  // Sent at `sent`, there and back in these times.
  void ping(Time sent, Duration there, Duration back, Duration dwell = Duration(0)) {
    const Time arrived = sent + there + ahead;
    sync.add(sent, wire_time_us(arrived), dwell, sent + there + dwell + back);
  }
  // By how much the host is wrong about the vehicle's clock.
  [[nodiscard]] Duration error(Time host) const {
    return wire_difference(sync.vehicle_wire_us(host), wire_time_us(host + ahead));
  }

  Duration ahead{};
  ClockSync sync;
};

TEST(WireClock, IsMicrosecondsModuloTwoToThe24) {
  EXPECT_EQ(wire_time_us(at_us(0)), 0U);
  EXPECT_EQ(wire_time_us(at_us(kRound - 1)), kRound - 1);
  EXPECT_EQ(wire_time_us(at_us(kRound)), 0U);
  EXPECT_EQ(wire_time_us(at_us(-1)), kRound - 1);
}

TEST(WireClock, DifferencesTakeTheShorterWayRound) {
  EXPECT_EQ(wire_difference(5, 3), Duration(2));
  EXPECT_EQ(wire_difference(3, 5), Duration(-2));
  EXPECT_EQ(wire_difference(2, kRound - 3), Duration(5));
  EXPECT_EQ(wire_difference(kRound - 3, 2), Duration(-5));
  EXPECT_EQ(wire_difference(kRound / 2 - 1, 0), Duration(kRound / 2 - 1));
  EXPECT_EQ(wire_difference(kRound / 2, 0), Duration(-static_cast<int>(kRound / 2)));
}

TEST(WireClock, TimeNearIsTheOneThatReadsSo) {
  Rng rng(3);
  for (int i = 0; i < 10'000; ++i) {
    const Time time = at_us(static_cast<std::int64_t>(rng.below(1ULL << 50U)));
    const Time near =
        time + Duration(static_cast<std::int64_t>(rng.below(kRound)) - kRound / 2 + 1);

    ASSERT_EQ(time_near(wire_time_us(time), near), time);
  }
}

TEST(ClockSync, IsNotSetBeforeTheFirstAnswer) {
  const ClockSync sync;

  EXPECT_FALSE(sync.is_set());
  EXPECT_FALSE(sync.round_trip().has_value());
}

TEST(ClockSync, KnowsAClockThatIsHoursAheadOrBehind) {
  for (const Duration ahead : {Duration(hours(5)),
                               Duration(-hours(5)),
                               Duration(1),
                               Duration(0),
                               Duration(8'400'000),
                               Duration(-8'400'000)}) {
    Exchange exchange{ahead, {}};
    const Time now = Time(hours(400'000));

    exchange.ping(now, Duration(300), Duration(300));

    EXPECT_EQ(exchange.error(now + seconds(3)), Duration(0)) << ahead.count();
    const Time measured = now + milliseconds(70);
    EXPECT_EQ(exchange.sync.host_time(wire_time_us(measured + ahead), now + milliseconds(75)),
              measured);
  }
}

TEST(ClockSync, MapsTimesRightAcrossEveryWrapOfTheWireClock) {
  Exchange exchange{hours(1) + Duration(1234), {}};
  exchange.ping(at_us(0), Duration(100), Duration(100));

  for (std::int64_t us = 0; us < 40'000'000; us += 9'999) {
    const Time measured = at_us(us);
    ASSERT_EQ(exchange.sync.host_time(wire_time_us(measured + exchange.ahead),
                                      measured + milliseconds(2)),
              measured);
  }
}

TEST(ClockSync, CountsTheTimeThatTheVehicleTookToAnswer) {
  Exchange exchange{seconds(3), {}};

  exchange.ping(at_us(1000), Duration(200), Duration(200), milliseconds(30));

  EXPECT_EQ(exchange.error(at_us(1000)), Duration(0));
  EXPECT_EQ(exchange.sync.round_trip(), Duration(400));
}

TEST(ClockSync, TheQuickestOfTheLastSixteenCounts) {
  Exchange exchange{seconds(3), {}};
  exchange.ping(at_us(0), Duration(150), Duration(150));
  for (int i = 1; i <= 15; ++i) {
    exchange.ping(Time(i * milliseconds(200)), milliseconds(9), milliseconds(1));
    ASSERT_EQ(exchange.error(at_us(0)), Duration(0)) << i;
    ASSERT_EQ(exchange.sync.round_trip(), Duration(300)) << i;
  }

  exchange.ping(Time(16 * milliseconds(200)), milliseconds(9), milliseconds(1));

  EXPECT_EQ(exchange.error(at_us(0)), milliseconds(4));
  EXPECT_EQ(exchange.sync.round_trip(), milliseconds(10));
}

TEST(ClockSync, IsWrongByHalfTheRoundTripAtMost) {
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    Rng rng(seed);
    Exchange exchange{hours(2), {}};
    for (int i = 0; i < 16; ++i) {
      exchange.ping(Time(i * milliseconds(200)),
                    Duration(100 + static_cast<std::int64_t>(rng.below(20'000))),
                    Duration(100 + static_cast<std::int64_t>(rng.below(20'000))));
    }
    const Duration error = exchange.error(Time(seconds(4)));
    EXPECT_LE(std::abs(error.count()), exchange.sync.round_trip()->count() / 2 + 1)
        << "seed " << seed;
  }
}

TEST(ClockSync, AnswersThatTookNoTimeOrTooLongAreNone) {
  Exchange exchange{seconds(3), {}};

  exchange.ping(at_us(0), Duration(-200), Duration(199));
  exchange.ping(at_us(0), milliseconds(500), milliseconds(500) + Duration(1));
  EXPECT_FALSE(exchange.sync.is_set());
  exchange.ping(at_us(0), milliseconds(500), milliseconds(500));

  EXPECT_TRUE(exchange.sync.is_set());
}

TEST(ClockSync, ADwellLongerThanTheRoundTripIsNone) {
  ClockSync sync;

  sync.add(at_us(0), 0, Duration(301), at_us(300));

  EXPECT_FALSE(sync.is_set());
}

TEST(ClockSync, AfterAResetOldAnswersCountNoMore) {
  Exchange exchange{seconds(3), {}};
  exchange.ping(at_us(0), Duration(1), Duration(1));

  exchange.sync.reset();
  EXPECT_FALSE(exchange.sync.is_set());
  exchange.ahead = -seconds(5);
  exchange.ping(at_us(1000), milliseconds(1), milliseconds(1));

  EXPECT_EQ(exchange.error(at_us(1000)), Duration(0));
  EXPECT_EQ(exchange.sync.round_trip(), milliseconds(2));
}

// Two quartzes differ by up to 100 parts in a million, for 16 answers five times a second.
TEST(ClockSync, FollowsADriftingClockWithinAMillisecond) {
  Rng rng(9);
  Exchange exchange{hours(1), {}};
  for (int i = 0; i < 3000; ++i) {
    const Time now = Time(i * milliseconds(200));
    exchange.ahead = hours(1) + i * Duration(20);
    exchange.ping(now,
                  Duration(100 + static_cast<std::int64_t>(rng.below(400))),
                  Duration(100 + static_cast<std::int64_t>(rng.below(400))));

    ASSERT_LT(std::abs(exchange.error(now).count()), 1000) << i;
  }
}

}  // namespace
}  // namespace understory::can
