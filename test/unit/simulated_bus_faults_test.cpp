// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <map>
#include <string>

#include <gtest/gtest.h>

#include "support/bus_flight.hpp"

namespace understory {
namespace {

using can::State;
using can::StateReason;
using std::chrono::milliseconds;
using std::chrono::seconds;
using test::BusFlight;
using test::east_from;

struct NamedFaults {
  std::string name;
  can::BusFaults faults;
};

std::vector<NamedFaults> all_faults() {
  std::vector<NamedFaults> all(6);
  all[0].name = "Loss";
  all[0].faults.loss = 0.02;
  all[1].name = "Duplication";
  all[1].faults.duplication = 0.3;
  all[2].name = "Reordering";
  all[2].faults.delay = 0.05;
  all[3].name = "Corruption";
  all[3].faults.corruption = 0.02;
  all[4].name = "LostEchoes";
  all[4].faults.echo_loss = 0.01;
  all[5] = {"All", {}};
  all[5].faults.loss = 0.01;
  all[5].faults.duplication = 0.05;
  all[5].faults.delay = 0.02;
  all[5].faults.corruption = 0.01;
  all[5].faults.echo_loss = 0.01;
  return all;
}

std::string name_of(const ::testing::TestParamInfo<NamedFaults>& info) {
  return info.param.name;
}

// What the host has put on the bus, by the time stamp that each set carries.
std::map<std::uint32_t, Setpoint> sets_on(const std::vector<can::PortFrame>& tape) {
  std::map<std::uint32_t, Setpoint> sets;
  can::SetpointReceiver receiver;
  for (const can::PortFrame& frame : tape) {
    if (frame.is_own && can::SetpointReceiver::takes(frame.frame.id) &&
        receiver.add(frame.frame, frame.stamp)) {
      sets[receiver.setpoint()->time_wire_us] = receiver.setpoint()->setpoint;
    }
  }
  return sets;
}

bool is_same(const Setpoint& a, const Setpoint& b) {
  return a.position_m == b.position_m && a.velocity_mps == b.velocity_mps &&
         a.acceleration_mps2 == b.acceleration_mps2 && a.yaw_rad == b.yaw_rad &&
         a.yaw_rate_radps == b.yaw_rate_radps;
}

class BusWith : public ::testing::TestWithParam<NamedFaults> {};

TEST_P(BusWith, FaultsIsStillFlownOn) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    BusFlight flight(seed, {}, GetParam().faults);
    ASSERT_TRUE(flight.take_off()) << "seed " << seed;
    flight.plan = east_from(flight.vehicle().position_m, flight.now());

    flight.run(seconds(5));

    EXPECT_EQ(flight.vehicle_state(), State::kArmed) << "seed " << seed;
    const Vector3d wanted_m = flight.plan(flight.now()).position_m;
    EXPECT_LT((flight.vehicle().position_m - wanted_m).norm(), 0.3) << "seed " << seed;
  }
}

TEST_P(BusWith, FaultsFliesNoTornAndNoAlteredSet) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    can::BusFaults faults = GetParam().faults;
    faults.echo_loss = 0.0;  // the record of what was sent is made of echoes
    BusFlight flight(seed, {}, faults);
    std::vector<can::WireSetpoint> flown;
    flight.on_step = [&](const VehicleState&) {
      const auto& newest = flight.bus->vehicle().station().flown();
      if (newest && (flown.empty() || newest->time_wire_us != flown.back().time_wire_us)) {
        flown.push_back(*newest);
      }
    };
    ASSERT_TRUE(flight.take_off());
    flight.plan = east_from(flight.vehicle().position_m, flight.now());
    flight.run(seconds(4));

    const std::map<std::uint32_t, Setpoint> sent = sets_on(flight.tape->frames);
    ASSERT_GT(flown.size(), 150U) << "seed " << seed;
    for (const can::WireSetpoint& wire : flown) {
      const auto found = sent.find(wire.time_wire_us);
      ASSERT_TRUE(found != sent.end() && is_same(found->second, wire.setpoint)) << "seed " << seed;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(SimulatedBus, BusWith, ::testing::ValuesIn(all_faults()), name_of);

TEST(SimulatedBus, TenPercentLossMayBeHeldButIsNeverLanded) {
  can::BusFaults faults;
  faults.loss = 0.1;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    BusFlight flight(seed, {}, faults);
    ASSERT_TRUE(flight.take_off()) << "seed " << seed;

    EXPECT_FALSE(
        flight.run_until([&] { return flight.vehicle_state() == State::kLand; }, seconds(20)))
        << "seed " << seed;
  }
}

// A third station, that sends what a test tells it to.
struct Intruder {
  explicit Intruder(BusFlight& flight) : port(flight.bus->bus().open(64)) {}

  // As many as go out, of this frame.
  void flood(const can::Frame& frame, int frames) {
    for (int i = 0; i < frames; ++i) {
      static_cast<void>(port->send(frame));
    }
    std::array<can::PortFrame, 64> heard;
    while (port->receive(heard.data(), heard.size()) > 0) {
    }
  }

  std::unique_ptr<can::MemoryCanPort> port;
};

TEST(SimulatedBus, AFloodOfForeignIdentifiersChangesNothing) {
  BusFlight flight;
  ASSERT_TRUE(flight.take_off());
  Intruder intruder(flight);
  flight.plan = east_from(flight.vehicle().position_m, flight.now());
  can::Frame frame;
  frame.id = 0x7FF;

  for (int i = 0; i < 500; ++i) {
    intruder.flood(frame, 60);  // most of the bus
    flight.tick();
    ASSERT_EQ(flight.vehicle_state(), State::kArmed) << i;
  }

  EXPECT_LT((flight.vehicle().position_m - flight.plan(flight.now()).position_m).norm(), 0.1);
  EXPECT_EQ(flight.telemetry.link.problem, can::LinkProblem::kNone);
}

class FloodOf : public ::testing::TestWithParam<std::uint16_t> {};

// It may be held or landed, but it stays where it is and nothing of the flood is flown.
TEST_P(FloodOf, BrokenFramesOfTheHostsIdentifiersMovesNothing) {
  BusFlight flight;
  ASSERT_TRUE(flight.take_off());
  const Vector3d above_m = flight.vehicle().position_m;
  Intruder intruder(flight);
  Rng rng(4);
  double farthest_m = 0.0;

  for (int i = 0; i < 300; ++i) {
    can::Frame frame;
    frame.id = GetParam();
    for (std::uint8_t& byte : frame.data) {
      byte = static_cast<std::uint8_t>(rng.below(256));
    }
    intruder.flood(frame, 20);
    flight.tick();
    farthest_m = std::max(farthest_m, (flight.vehicle().position_m - above_m).head<2>().norm());
    ASSERT_NE(flight.vehicle_state(), State::kKilled);
  }

  EXPECT_LT(farthest_m, 0.15);
}

INSTANTIATE_TEST_SUITE_P(SimulatedBus,
                         FloodOf,
                         ::testing::Values(can::Kill::kId,
                                           can::ArmCmd::kId,
                                           can::EscCmd::kId,
                                           can::SpPosXy::kId,
                                           can::SpVel::kId,
                                           can::SpCommit::kId,
                                           can::Ping::kId,
                                           can::HostHb::kId));

TEST(SimulatedBus, AnotherVehicleThatSpeaksUpInFlightLandsIt) {
  BusFlight flight;
  ASSERT_TRUE(flight.take_off());
  Intruder intruder(flight);
  can::Frame frame;
  frame.id = can::OdoVel::kId;

  intruder.flood(frame, 1);
  flight.run(milliseconds(50));

  EXPECT_EQ(flight.vehicle_state(), State::kLand);
  EXPECT_EQ(flight.reason(), StateReason::kForeignVehicle);
  EXPECT_EQ(flight.telemetry.link.problem, can::LinkProblem::kOtherVehicle);
}

TEST(SimulatedBus, AnotherHostThatSpeaksUpOnTheGroundForbidsArming) {
  BusFlight flight;
  flight.wants_to_fly = false;
  flight.run(seconds(1));
  Intruder intruder(flight);
  can::Frame frame;
  frame.id = can::SpVel::kId;
  intruder.flood(frame, 1);

  flight.bus->host().arm();
  flight.run(seconds(3));

  EXPECT_EQ(flight.vehicle_state(), State::kDisarmed);
  EXPECT_EQ(flight.telemetry.link.problem, can::LinkProblem::kOtherHost);
}

// Both hear what they have not sent.
TEST(SimulatedBus, OfTwoVehiclesOnOneBusNoneIsArmed) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    BusFlight flight(seed);
    auto port = flight.bus->bus().open();
    can::MemoryCanPort& end = *port;
    SimulatedVehicle other({}, BusFlight::start(), Rng(100 + seed), std::move(port));
    end.set_on_arrival([&other] { other.poll(); });
    flight.on_step = [&](const VehicleState&) {
      other.step(flight.bus->bus().now());
      other.poll();
    };

    for (int i = 0; i < 500; ++i) {
      flight.bus->host().arm();
      flight.tick();
      ASSERT_NE(flight.vehicle_state(), State::kArmed) << "seed " << seed;
      ASSERT_NE(other.station().supervisor().state(), State::kArmed) << "seed " << seed;
    }

    EXPECT_EQ(flight.telemetry.link.problem, can::LinkProblem::kOtherVehicle) << "seed " << seed;
  }
}

TEST(SimulatedBus, OfTwoHostsOnOneBusNoneArms) {
  BusFlight flight;
  CanAutopilot other(flight.bus->bus().open(), can::HostStationConfig{}, 999);
  for (int i = 0; i < 500; ++i) {
    flight.bus->host().arm();
    other.arm();
    flight.tick();
    other.send(flight.wanted, true, flight.now());
    ASSERT_NE(flight.vehicle_state(), State::kArmed);
  }

  EXPECT_EQ(flight.telemetry.link.problem, can::LinkProblem::kOtherHost);
  EXPECT_EQ(other.receive(flight.now()).link.problem, can::LinkProblem::kOtherHost);
}

class BusThatIs : public ::testing::TestWithParam<can::PortState> {};

TEST_P(BusThatIs, LostForTheHostIsLandedAndReadyAgainWhenItIsBack) {
  BusFlight flight;
  ASSERT_TRUE(flight.take_off());
  const std::uint64_t sessions = flight.telemetry.link.sessions;

  flight.bus->host_port().set_state(GetParam());
  flight.run(milliseconds(50));
  EXPECT_EQ(flight.telemetry.link.problem, can::LinkProblem::kBus);
  flight.run(milliseconds(1100));
  EXPECT_EQ(flight.vehicle_state(), State::kLand);
  flight.run(seconds(10));
  flight.bus->host_port().set_state(can::PortState::kUp);
  flight.run(seconds(2));

  EXPECT_EQ(flight.vehicle_state(), State::kDisarmed);
  EXPECT_EQ(flight.telemetry.link.host, can::HostState::kReady);
  EXPECT_GT(flight.telemetry.link.sessions, sessions);
  EXPECT_EQ(flight.telemetry.link.bus_reopened, 1U);
}

TEST_P(BusThatIs, LostForTwoTenthsOfASecondIsFlownOnOrLandedButNeverArmedAnew) {
  BusFlight flight;
  ASSERT_TRUE(flight.take_off());
  const std::uint32_t flights =
      flight.bus->vehicle().station().supervisor().report(flight.now()).state_arm_seq;
  flight.bus->host_port().set_state(GetParam());
  flight.run(milliseconds(200));
  flight.bus->host_port().set_state(can::PortState::kUp);

  flight.run(seconds(15));

  EXPECT_EQ(flight.bus->vehicle().station().supervisor().report(flight.now()).state_arm_seq,
            flights);
}

INSTANTIATE_TEST_SUITE_P(SimulatedBus,
                         BusThatIs,
                         ::testing::Values(can::PortState::kDown,
                                           can::PortState::kGone,
                                           can::PortState::kBusOff));

}  // namespace
}  // namespace understory
