// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What the flight thread sends. Real time: whatever is waited for has seconds to come, and what is
// compared is compared at the time that the autopilot was told.
#include "understory/bridge/flight_loop.hpp"

#include <cmath>
#include <limits>
#include <set>

#include <gtest/gtest.h>

#include "support/fake_autopilot.hpp"
#include "understory/base/rng.hpp"
#include "understory/sim/simulated_bus.hpp"

namespace understory {
namespace {

using std::chrono::milliseconds;
using test::FlightBench;
using test::hop;
using test::is_setpoint_of;
using test::kFlightStart_m;
using test::Sent;
using test::starting_at;

constexpr double kRateHz = 200.0;
const Vector3d kHopEnd_m = kFlightStart_m + Vector3d(0.4, 0.0, 0.0);

bool is_rest(const Setpoint& setpoint) {
  return setpoint.velocity_mps.isZero(0.0) && setpoint.acceleration_mps2.isZero(0.0) &&
         setpoint.yaw_rate_radps == 0.0;
}

TEST(FlightLoop, HoldsWhereTheVehicleWasAtFirstUntilThereIsATrajectory) {
  VehicleState drifting;
  drifting.position_m = kFlightStart_m;
  drifting.velocity_mps = {0.3, 0.0, 0.0};
  drifting.world_from_body = Eigen::AngleAxisd(0.8, Vector3d::UnitZ());
  FlightBench bench(test::flight_config(kRateHz));
  bench.log->place_vehicle(drifting);
  ASSERT_EQ(bench.ticks(3).size(), 3U);
  const double yaw_rad = bench.log->sent().front().setpoint.yaw_rad;

  drifting.position_m.x() += 0.1;  // the gate would let it through
  bench.log->place_vehicle(drifting);
  ASSERT_EQ(bench.ticks(10).size(), 10U);

  for (const Sent& sent : bench.log->sent()) {
    EXPECT_EQ(sent.setpoint.position_m, kFlightStart_m);
    EXPECT_EQ(sent.setpoint.yaw_rad, yaw_rad);
    EXPECT_TRUE(is_rest(sent.setpoint));
  }
}

TEST(FlightLoop, HoldHasTheVehiclesHeading) {
  const auto log = std::make_shared<test::AutopilotLog>();
  VehicleState state;
  state.position_m = kFlightStart_m;
  state.world_from_body = Eigen::AngleAxisd(-2.1, Vector3d::UnitZ());
  log->place_vehicle(state);
  FlightLoop loop(
      test::flight_config(kRateHz), test::kFlightBox_m, std::make_unique<test::FakeAutopilot>(log));

  const std::optional<FlightTick> tick = loop.wait_for_tick(test::kPatience);

  ASSERT_TRUE(tick && tick->setpoint);
  EXPECT_NEAR(tick->setpoint->yaw_rad, -2.1, 1e-12);
}

TEST(FlightLoop, NothingIsSentWhileNobodyKnowsWhereTheVehicleIs) {
  const auto log = std::make_shared<test::AutopilotLog>();
  VehicleState lost;
  lost.position_m.setConstant(std::numeric_limits<double>::quiet_NaN());
  log->place_vehicle(lost);
  FlightLoop loop(
      test::flight_config(kRateHz), test::kFlightBox_m, std::make_unique<test::FakeAutopilot>(log));
  std::optional<FlightTick> tick;
  for (int i = 0; i < 10; ++i) {
    tick = loop.wait_for_tick(test::kPatience);
    ASSERT_TRUE(tick);
    EXPECT_FALSE(tick->setpoint);
  }
  EXPECT_TRUE(log->sent().empty());
  EXPECT_EQ(tick->gate_violations, 10U);

  VehicleState found;
  found.position_m = kFlightStart_m;
  log->place_vehicle(found);
  for (int i = 0; i < 1000 && log->sent().empty(); ++i) {
    tick = loop.wait_for_tick(test::kPatience);
  }

  ASSERT_FALSE(log->sent().empty());
  EXPECT_EQ(log->sent().front().setpoint.position_m, kFlightStart_m);
}

TEST(FlightLoop, FliesWhatIsOfferedFromItsStartTimeOn) {
  FlightBench bench(test::flight_config(kRateHz));
  const Time now = wall_time();
  const TrajectoryPtr flown =
      starting_at(hop(kFlightStart_m, kHopEnd_m, 0.4), now + milliseconds(60), 7);

  bench.loop->offer(flown, now);
  const std::vector<FlightTick> ticks = bench.ticks_until(flown->end() + milliseconds(30));

  int on_the_way = 0;
  for (const Sent& sent : bench.log->sent()) {
    if (sent.time < flown->start) {
      EXPECT_EQ(sent.setpoint.position_m, kFlightStart_m);
    } else {
      EXPECT_TRUE(is_setpoint_of(*flown, sent)) << to_seconds(sent.time - flown->start);
      on_the_way += sent.time < flown->end() ? 1 : 0;
    }
  }
  EXPECT_GT(on_the_way, 5);
  EXPECT_EQ(bench.log->sent().back().setpoint.position_m, flown->sample(flown->end()).position_m);
  EXPECT_EQ(ticks.back().gate_violations, 0U);
}

TEST(FlightLoop, TicksTellWhichTrajectoryIsFlownAndWhenItIsAtRest) {
  FlightBench bench(test::flight_config(kRateHz));
  const Time now = wall_time();
  Trajectory trajectory = hop(kFlightStart_m, kHopEnd_m, 0.3);
  trajectory.depth_stamp = now - milliseconds(40);
  const TrajectoryPtr flown = starting_at(trajectory, now + milliseconds(20), 7);

  bench.loop->offer(flown, now);
  const std::vector<FlightTick> ticks = bench.ticks_until(flown->end() + milliseconds(30));

  int first = 0;
  int on_the_way = 0;
  for (const FlightTick& tick : ticks) {
    const bool is_flown = tick.trajectory_id == 7;
    first += tick.is_first_of_trajectory ? 1 : 0;
    EXPECT_EQ(tick.depth_stamp, is_flown ? flown->depth_stamp : Time{});
    // The fake's telemetry has the time at which the trajectory was sampled.
    EXPECT_EQ(tick.is_at_rest, !is_flown || tick.telemetry.time >= flown->end());
    on_the_way += tick.is_at_rest ? 0 : 1;
  }
  EXPECT_EQ(first, 1);
  EXPECT_GT(on_the_way, 3);
  EXPECT_TRUE(ticks.back().is_at_rest);
}

TEST(FlightLoop, NewerTrajectoryTakesOverAtItsOwnStart) {
  for (const bool is_offered_in_flight : {false, true}) {
    FlightBench bench(test::flight_config(kRateHz));
    const Time now = wall_time();
    const TrajectoryPtr first =
        starting_at(hop(kFlightStart_m, kHopEnd_m, 0.3), now + milliseconds(10), 1);
    const Time handover = first->start + milliseconds(150);
    const Vector3d there_m = first->sample(handover).position_m;
    const TrajectoryPtr second =
        starting_at(hop(there_m, there_m + Vector3d(0.0, 0.3, 0.0), 0.2), handover, 2);

    bench.loop->offer(first, now);
    if (is_offered_in_flight) {
      static_cast<void>(bench.ticks_until(now + milliseconds(60)));
    }
    bench.loop->offer(second, wall_time());
    const std::vector<FlightTick> ticks = bench.ticks_until(second->end());

    std::set<std::uint64_t> flown;
    for (const Sent& sent : bench.log->sent()) {
      if (sent.time >= first->start) {
        const Trajectory& due = sent.time < handover ? *first : *second;
        EXPECT_TRUE(is_setpoint_of(due, sent)) << to_seconds(sent.time - handover);
        flown.insert(due.id);
      }
    }
    EXPECT_EQ(flown.count(2), 1U);
    EXPECT_EQ(ticks.back().gate_violations, 0U);
  }
}

TEST(FlightLoop, SetpointsThatFailTheGateAreHeldAndCounted) {
  FlightBench bench(test::flight_config(kRateHz));
  ASSERT_EQ(bench.ticks(2).size(), 2U);
  const Vector3d elsewhere_m = kFlightStart_m - Vector3d(3.0, 0.0, 0.0);
  const Time now = wall_time();

  bench.loop->offer(starting_at(hop(elsewhere_m, elsewhere_m, 0.1), now, 1), now);
  std::uint64_t refused = 0;
  std::uint64_t violations = 0;
  for (const FlightTick& tick : bench.ticks(20)) {
    refused += tick.trajectory_id == 1 ? 1U : 0U;
    violations = tick.gate_violations;
  }

  EXPECT_GT(refused, 0U);
  EXPECT_EQ(violations, refused);
  for (const Sent& sent : bench.log->sent()) {
    EXPECT_EQ(sent.setpoint.position_m, kFlightStart_m);
  }
}

TEST(FlightLoop, WishesToDisarmReachTheAutopilotOnceEach) {
  FlightBench bench(test::flight_config(kRateHz));
  ASSERT_EQ(bench.ticks(5).size(), 5U);
  EXPECT_EQ(bench.log->landings(), 0);

  bench.loop->disarm();
  ASSERT_EQ(bench.ticks(10).size(), 10U);
  EXPECT_EQ(bench.log->landings(), 1);
  bench.loop->disarm();
  ASSERT_EQ(bench.ticks(5).size(), 5U);

  EXPECT_EQ(bench.log->landings(), 2);
}

TEST(FlightLoop, TrajectoriesAreNeverFreedByTheFlightThread) {
  std::set<std::thread::id> freed_by;
  std::mutex mutex;
  int freed = 0;
  const int offered = 300;
  {
    FlightBench bench(test::flight_config(400.0));
    for (int i = 0; i < offered; ++i) {
      const Time now = wall_time();
      auto* trajectory = new Trajectory(hop(kFlightStart_m, kFlightStart_m, 0.01));
      trajectory->start = now + milliseconds(1);
      bench.loop->offer(TrajectoryPtr(trajectory,
                                      [&](const Trajectory* ended) {
                                        const std::lock_guard<std::mutex> lock(mutex);
                                        freed_by.insert(std::this_thread::get_id());
                                        ++freed;
                                        delete ended;
                                      }),
                        now);
      std::this_thread::sleep_for(std::chrono::microseconds(500));
    }
    const std::lock_guard<std::mutex> lock(mutex);
    EXPECT_GT(freed, offered / 2) << "while it flies, not only at the end";
  }

  EXPECT_EQ(freed, offered);
  EXPECT_EQ(freed_by, (std::set<std::thread::id>{std::this_thread::get_id()}));
}

TEST(FlightLoop, EndsAtAnyMomentAndSendsNothingAfterwards) {
  Rng rng(1);
  for (int i = 0; i < 50; ++i) {
    FlightBench bench(test::flight_config(400.0));
    const std::uint64_t offers = rng.below(4);
    for (std::uint64_t id = 1; id <= offers; ++id) {
      const Time now = wall_time();
      bench.loop->offer(
          starting_at(hop(kFlightStart_m, kHopEnd_m, 0.3), now + milliseconds(id), id), now);
      std::this_thread::sleep_for(std::chrono::microseconds(rng.below(2000)));
    }
    if (rng.below(3) == 0) {
      bench.loop->disarm();
    }
    std::this_thread::sleep_for(std::chrono::microseconds(rng.below(2000)));

    bench.loop.reset();

    const std::size_t sent = bench.log->sent().size();
    EXPECT_EQ(bench.log->destroyed(), 1);
    std::this_thread::sleep_for(milliseconds(3));
    EXPECT_EQ(bench.log->sent().size(), sent);
  }
}

std::unique_ptr<Autopilot> simulated_vehicle() {
  Pose world_from_start = Pose::Identity();
  world_from_start.translation() = kFlightStart_m;
  return std::make_unique<InProcessAutopilot>(std::make_unique<SimulatedBus>(
      SimulatedVehicleConfig{}, can::HostStationConfig{}, world_from_start, Rng(1), wall_time()));
}

TEST(FlightLoop, SimulatedVehicleIsArmedAndComesToWhereTheTrajectoryEnds) {
  FlightLoop loop(FlightConfig{}, test::kFlightBox_m, simulated_vehicle());
  std::optional<FlightTick> tick;
  do {
    tick = loop.wait_for_tick(test::kPatience);
    loop.arm();
  } while (tick && !tick->telemetry.is_following);
  const Time now = wall_time();
  const Vector3d end_m = kFlightStart_m + Vector3d(0.15, 0.1, 0.0);
  const TrajectoryPtr flown =
      starting_at(hop(kFlightStart_m, end_m, 0.6), now + milliseconds(20), 1);

  loop.offer(flown, now);
  do {
    tick = loop.wait_for_tick(test::kPatience);
  } while (tick && tick->telemetry.time < flown->end() + milliseconds(200));

  ASSERT_TRUE(tick);
  EXPECT_LT((tick->telemetry.state.position_m - end_m).norm(), 0.08);
  EXPECT_FALSE(tick->is_astray);
}

}  // namespace
}  // namespace understory
