// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <set>

#include <gtest/gtest.h>

#include "support/bus_flight.hpp"

namespace understory {
namespace {

using can::State;
using can::StateReason;
using std::chrono::milliseconds;
using std::chrono::seconds;
using test::BusFlight;

// Times on the bus read the same again after so long: what was fresh then is fresh now.
constexpr Duration kRound{can::kWireClockUs};

// All that a host sent in a flight that took off, with the time of each frame.
std::vector<can::PortFrame> recorded_flight() {
  BusFlight flight;
  EXPECT_TRUE(flight.take_off());
  std::vector<can::PortFrame> frames;
  for (const can::PortFrame& frame : flight.tape->frames) {
    if (frame.is_own) {
      frames.push_back(frame);
    }
  }
  return frames;
}

// Puts the record on a bus whose host is silent, at the times of the record and so much later.
struct Replay {
  explicit Replay(SimulatedBus& simulated_bus) : bus(simulated_bus), port(bus.bus().open(64)) {}

  void run(const std::vector<can::PortFrame>& record, Duration later) {
    for (const can::PortFrame& frame : record) {
      // Sent when the original began, so that each arrives when the original did.
      const Time at = frame.stamp + later - milliseconds(1);
      bus.advance(at, [this](Time, const VehicleState&) { watch(); });
      static_cast<void>(port->send(frame.frame));
      std::array<can::PortFrame, 64> heard;
      static_cast<void>(port->receive(heard.data(), heard.size()));
    }
  }
  void watch() {
    const can::Supervisor& supervisor = bus.vehicle().station().supervisor();
    states.insert(supervisor.state());
    reasons.insert(supervisor.reason());
  }

  SimulatedBus& bus;
  std::unique_ptr<can::MemoryCanPort> port;
  std::set<State> states;
  std::set<StateReason> reasons;
};

TEST(Replay, OfAFlightArmsTheVehicleThatFlewItOnlyWithItsOwnNonce) {
  const std::vector<can::PortFrame> record = recorded_flight();
  // The same seed: the same first nonce. This shows that the replay is good enough to be feared.
  SimulatedBus bus({}, {}, BusFlight::start(), Rng(1), Time{});
  bus.skip_to(Time(kRound) - milliseconds(10));
  Replay replay(bus);

  replay.run(record, kRound);

  EXPECT_EQ(replay.states.count(State::kArmed), 1U);
}

TEST(Replay, OfAFlightDoesNotArmAVehicleThatWasRestarted) {
  const std::vector<can::PortFrame> record = recorded_flight();
  for (std::uint64_t seed = 2; seed < 12; ++seed) {
    SimulatedBus bus({}, {}, BusFlight::start(), Rng(1), Time{});
    bus.vehicle().restart_autopilot(Rng(seed));
    bus.skip_to(Time(kRound) - milliseconds(10));
    Replay replay(bus);

    replay.run(record, kRound);

    EXPECT_EQ(replay.states.count(State::kArmed), 0U) << "seed " << seed;
    EXPECT_EQ(replay.reasons.count(StateReason::kArmToken), 1U) << "all but the token is right";
  }
}

TEST(Replay, OfAFlightDoesNotArmTheVehicleAfterItsFlight) {
  const std::vector<can::PortFrame> record = recorded_flight();
  BusFlight flight;
  ASSERT_TRUE(flight.take_off());
  flight.bus->host().disarm();
  flight.run(seconds(10));
  ASSERT_EQ(flight.vehicle_state(), State::kDisarmed);
  Replay replay(*flight.bus);

  replay.run(record, 2 * kRound);

  EXPECT_EQ(replay.states.count(State::kArmed), 0U);
}

TEST(Replay, OfAFlightIsOldSetpointsAtAnyOtherTime) {
  const std::vector<can::PortFrame> record = recorded_flight();
  SimulatedBus bus({}, {}, BusFlight::start(), Rng(1), Time{});
  bus.skip_to(Time(seconds(5)));
  Replay replay(bus);

  replay.run(record, seconds(5));

  EXPECT_EQ(replay.states.count(State::kArmed), 0U);
  EXPECT_EQ(replay.reasons.count(StateReason::kArmNoSetpoints), 1U);
}

}  // namespace
}  // namespace understory
