// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// When the flight thread does what it does, and who waits for whom. No test here fails because the
// machine stalls: deadlines are compared with each other and with what was skipped, exactly.
#include <gtest/gtest.h>
#include <sched.h>

#include "support/fake_autopilot.hpp"
#include "understory/bridge/flight_loop.hpp"

namespace understory {
namespace {

using std::chrono::milliseconds;
using test::FlightBench;
using test::hop;
using test::kFlightStart_m;
using test::starting_at;

const Vector3d kHopEnd_m = kFlightStart_m + Vector3d(0.4, 0.0, 0.0);

// Turns that were due between these two ticks.
std::int64_t periods_between(const FlightTick& a, const FlightTick& b, std::int64_t period_ns) {
  EXPECT_EQ((b.due_ns - a.due_ns) % period_ns, 0);
  return (b.due_ns - a.due_ns) / period_ns;
}

TEST(FlightLoopTiming, DeadlinesAreOnePeriodApartButForThoseThatWereSkipped) {
  FlightBench bench(test::flight_config(250.0));

  const std::vector<FlightTick> ticks = bench.ticks(60);

  for (std::size_t i = 1; i < ticks.size(); ++i) {
    const auto skipped =
        static_cast<std::int64_t>(ticks[i].skipped_deadlines - ticks[i - 1].skipped_deadlines);
    EXPECT_EQ(periods_between(ticks[i - 1], ticks[i], 4'000'000), 1 + skipped) << "tick " << i;
  }
}

TEST(FlightLoopTiming, NoTurnBeginsBeforeItIsDue) {
  FlightBench bench(test::flight_config(250.0));

  for (const FlightTick& tick : bench.ticks(60)) {
    EXPECT_GE(tick.woken_ns, tick.due_ns);
    EXPECT_GE(tick.sent_ns, tick.woken_ns);
  }
}

TEST(FlightLoopTiming, SettleReturnsOnceAtRestAndNotBefore) {
  FlightBench bench(test::flight_config(200.0));
  const Time now = wall_time();
  const TrajectoryPtr flown =
      starting_at(hop(kFlightStart_m, kHopEnd_m, 0.5), now + milliseconds(20), 1);
  bench.loop->offer(flown, now);

  bench.loop->settle(std::chrono::minutes(1));

  EXPECT_GE(wall_time(), flown->end());
  EXPECT_LT(wall_time(), flown->end() + test::kPatience);
}

TEST(FlightLoopTiming, SettleWaitsForWhatWasOfferedAMomentAgo) {
  FlightBench bench(test::flight_config(400.0));
  for (std::uint64_t id = 1; id <= 50; ++id) {
    const Time now = wall_time();
    const TrajectoryPtr flown = starting_at(hop(kFlightStart_m, kFlightStart_m, 0.006), now, id);
    bench.loop->offer(flown, now);

    bench.loop->settle(test::kPatience);

    ASSERT_GE(wall_time(), flown->end()) << "trajectory " << id;
  }
}

TEST(FlightLoopTiming, SettleGivesUpAfterItsLimit) {
  FlightBench bench(test::flight_config(200.0));
  const Time now = wall_time();
  const TrajectoryPtr flown = starting_at(hop(kFlightStart_m, kHopEnd_m, 600.0), now, 1);
  bench.loop->offer(flown, now);
  const std::int64_t began_ns = steady_ns();

  bench.loop->settle(milliseconds(80));

  EXPECT_GE(steady_ns() - began_ns, 80'000'000);
  EXPECT_LT(wall_time(), flown->end()) << "it did not wait for the end";
}

TEST(FlightLoopTiming, NothingToSettleIsNotWaitedFor) {
  FlightBench bench(test::flight_config(200.0));
  const std::int64_t began_ns = steady_ns();

  bench.loop->settle(std::chrono::minutes(10));

  EXPECT_LT(steady_ns() - began_ns, 60'000'000'000);
}

TEST(FlightLoopTiming, TicksThatASlowConsumerLosesAreCountedAndTheLoopGoesOn) {
  FlightBench bench(test::flight_config(400.0));
  const Time give_up = wall_time() + test::kPatience;
  while (bench.loop->lost_ticks() < 10 && wall_time() < give_up) {
    std::this_thread::sleep_for(milliseconds(5));
  }
  ASSERT_GE(bench.loop->lost_ticks(), 10U);

  const std::vector<FlightTick> ticks = bench.ticks(300);
  const std::uint64_t lost = bench.loop->lost_ticks();

  const std::int64_t due = periods_between(ticks.front(), ticks.back(), 2'500'000);
  const std::uint64_t skipped = ticks.back().skipped_deadlines - ticks.front().skipped_deadlines;
  EXPECT_EQ(static_cast<std::uint64_t>(due), ticks.size() - 1 + skipped + lost);
  EXPECT_GE(bench.log->sent().size(), ticks.size() + lost) << "setpoints went out all the time";
}

TEST(FlightLoopTiming, StallIsSkippedAndNotMadeUpFor) {
  FlightBench bench(test::flight_config(100.0));
  const Time now = wall_time();
  const TrajectoryPtr flown =
      starting_at(hop(kFlightStart_m, kHopEnd_m, 0.45), now + milliseconds(20), 1);
  bench.loop->offer(flown, now);
  std::vector<FlightTick> ticks = bench.ticks(8);

  bench.log->stall_once(milliseconds(100));
  const std::vector<FlightTick> rest = bench.ticks_until(flown->end());

  ticks.insert(ticks.end(), rest.begin(), rest.end());
  EXPECT_GE(ticks.back().skipped_deadlines, 9U);
  for (std::size_t i = 1; i < ticks.size(); ++i) {
    EXPECT_GE(ticks[i].due_ns, ticks[i - 1].sent_ns) << "was due in the past";
  }
  for (const test::Sent& sent : bench.log->sent()) {
    EXPECT_TRUE(sent.time < flown->start || test::is_setpoint_of(*flown, sent));
  }
}

TEST(FlightLoopTiming, WaitingForATickEndsWhenNoneComes) {
  FlightBench bench(test::flight_config(200.0));
  const std::unique_lock<std::mutex> stopped = bench.log->stop_the_thread();
  while (bench.loop->wait_for_tick(milliseconds(100))) {  // those that were on their way
  }

  const std::int64_t began_ns = steady_ns();
  const std::optional<FlightTick> tick = bench.loop->wait_for_tick(milliseconds(30));

  EXPECT_FALSE(tick.has_value());
  EXPECT_GE(steady_ns() - began_ns, 30'000'000);
}

TEST(FlightLoopTiming, ThreadIsRealTimeWhereItSaysSoAndOnlyWhereItIsAskedTo) {
  for (const int priority : {0, 10}) {
    FlightConfig config = test::flight_config(200.0);
    config.priority = priority;
    FlightBench bench(config);

    ASSERT_EQ(bench.ticks(2).size(), 2U);

    ASSERT_TRUE(bench.log->scheduling_policy().has_value());
    EXPECT_EQ(*bench.log->scheduling_policy() == SCHED_FIFO, bench.loop->is_real_time());
    EXPECT_TRUE(priority > 0 || !bench.loop->is_real_time());
  }
}

}  // namespace
}  // namespace understory
