// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/fake_can_port.hpp"
#include "understory/can/wire_length.hpp"
#include "understory/port/memory_can_bus.hpp"

namespace understory::can {
namespace {

using std::chrono::milliseconds;
using test::at_ms;
using test::at_us;
using test::frame_of;
using ::testing::ElementsAre;

constexpr int kBitsPerSecond = 1'000'000;

std::vector<PortFrame> all_of(CanPort& port) {
  std::vector<PortFrame> frames(10'000);
  frames.resize(port.receive(frames.data(), frames.size()));
  return frames;
}

std::vector<std::uint16_t> ids_of(const std::vector<PortFrame>& frames) {
  std::vector<std::uint16_t> ids;
  for (const PortFrame& frame : frames) {
    ids.push_back(frame.frame.id);
  }
  return ids;
}

Duration length_of(const Frame& frame) {
  return std::chrono::microseconds(wire_bits(frame));
}

struct TwoStations {
  MemoryCanBus bus{kBitsPerSecond, Rng(7)};
  std::unique_ptr<MemoryCanPort> host = bus.open(64);
  std::unique_ptr<MemoryCanPort> vehicle = bus.open(64);
};

// A frame that is received by `vehicle` on an otherwise idle bus, many times.
std::vector<PortFrame> received_with(const BusFaults& faults, int frames) {
  TwoStations stations;
  stations.bus.set_faults(faults);
  for (int i = 0; i < frames; ++i) {
    EXPECT_EQ(stations.host->send(frame_of(0x100, static_cast<std::uint8_t>(i % 16))),
              SendResult::kSent);
    stations.bus.advance(at_ms(i + 1));
  }
  stations.bus.advance(at_ms(frames + 1000));
  return all_of(*stations.vehicle);
}

TEST(MemoryCanBus, AFrameArrivesAfterItsBitTimesAndItsSenderGetsAnEcho) {
  TwoStations stations;
  const Frame frame = frame_of(0x123);
  stations.bus.advance(at_us(500));

  ASSERT_EQ(stations.host->send(frame), SendResult::kSent);
  stations.bus.advance(at_us(1000));

  const std::vector<PortFrame> received = all_of(*stations.vehicle);
  const std::vector<PortFrame> echoes = all_of(*stations.host);
  ASSERT_EQ(received.size(), 1U);
  ASSERT_EQ(echoes.size(), 1U);
  EXPECT_EQ(received[0].frame, frame);
  EXPECT_EQ(received[0].stamp, at_us(500) + length_of(frame));
  EXPECT_FALSE(received[0].is_own);
  EXPECT_EQ(echoes[0].frame, frame);
  EXPECT_EQ(echoes[0].stamp, received[0].stamp);
  EXPECT_TRUE(echoes[0].is_own);
}

TEST(MemoryCanBus, NothingArrivesBeforeItsTime) {
  TwoStations stations;
  const Frame frame = frame_of(0x123);
  ASSERT_EQ(stations.host->send(frame), SendResult::kSent);
  const Time arrival = Time() + length_of(frame);

  EXPECT_EQ(stations.bus.next_arrival(), arrival);
  stations.bus.advance(arrival - Duration(1));
  EXPECT_TRUE(all_of(*stations.vehicle).empty());

  stations.bus.advance(arrival);
  EXPECT_EQ(all_of(*stations.vehicle).size(), 1U);
  EXPECT_EQ(stations.bus.next_arrival(), std::nullopt);
}

TEST(MemoryCanBus, TheLowestIdentifierWinsAmongFramesOfTheSameTime) {
  TwoStations stations;
  ASSERT_EQ(stations.host->send(frame_of(0x300)), SendResult::kSent);
  stations.bus.advance(at_us(0));
  ASSERT_EQ(stations.vehicle->send(frame_of(0x200)), SendResult::kSent);

  const std::unique_ptr<MemoryCanPort> listener = stations.bus.open();
  stations.bus.advance(at_ms(1));

  EXPECT_THAT(ids_of(all_of(*listener)), ElementsAre(0x200, 0x300));
}

TEST(MemoryCanBus, AFrameInTransmissionIsNotInterrupted) {
  TwoStations stations;
  const Frame slow = frame_of(0x700);
  const Frame urgent = frame_of(0x010);
  ASSERT_EQ(stations.host->send(slow), SendResult::kSent);
  stations.bus.advance(at_us(50));

  ASSERT_EQ(stations.vehicle->send(urgent), SendResult::kSent);
  stations.bus.advance(at_ms(1));

  const std::vector<PortFrame> received = all_of(*stations.host);
  ASSERT_THAT(ids_of(received), ElementsAre(0x700, 0x010));
  EXPECT_EQ(received[1].stamp - received[0].stamp, Duration(kInterframeBits) + length_of(urgent));
}

TEST(MemoryCanBus, EachStationsQueueIsFirstInFirstOut) {
  TwoStations stations;
  ASSERT_EQ(stations.host->send(frame_of(0x300)), SendResult::kSent);
  ASSERT_EQ(stations.host->send(frame_of(0x010)), SendResult::kSent);
  ASSERT_EQ(stations.vehicle->send(frame_of(0x200)), SendResult::kSent);

  const std::unique_ptr<MemoryCanPort> listener = stations.bus.open();
  stations.bus.advance(at_ms(1));

  EXPECT_THAT(ids_of(all_of(*listener)), ElementsAre(0x200, 0x300, 0x010));
}

TEST(MemoryCanBus, AStationAnswersAtTheTimeOfTheArrival) {
  TwoStations stations;
  const Frame ping = frame_of(0x180);
  const Frame pong = frame_of(0x181);
  stations.vehicle->set_on_arrival([&] {
    for (const PortFrame& frame : all_of(*stations.vehicle)) {
      if (!frame.is_own) {
        EXPECT_EQ(stations.bus.now(), frame.stamp);
        EXPECT_EQ(stations.vehicle->send(pong), SendResult::kSent);
      }
    }
  });

  ASSERT_EQ(stations.host->send(ping), SendResult::kSent);
  stations.bus.advance(at_ms(10));

  const std::vector<PortFrame> received = all_of(*stations.host);
  ASSERT_THAT(ids_of(received), ElementsAre(0x180, 0x181));
  EXPECT_EQ(received[1].stamp, Time() + length_of(ping) + Duration(3) + length_of(pong));
}

TEST(MemoryCanBus, WaitingMovesTheClockToTheFirstArrivalOnly) {
  TwoStations stations;
  const Frame frame = frame_of(0x123);
  ASSERT_EQ(stations.vehicle->send(frame), SendResult::kSent);

  stations.host->wait(milliseconds(5), WaitFor::kArrivals);
  EXPECT_EQ(stations.host->now(), Time() + length_of(frame));
  EXPECT_EQ(all_of(*stations.host).size(), 1U);

  stations.host->wait(milliseconds(5), WaitFor::kArrivals);
  EXPECT_EQ(stations.host->now(), at_ms(5) + length_of(frame));
}

TEST(MemoryCanBus, WhereArrivalsCanWaitTheyDoNotEndTheWait) {
  TwoStations stations;
  ASSERT_EQ(stations.vehicle->send(frame_of(0x123)), SendResult::kSent);

  stations.host->wait(milliseconds(5), WaitFor::kChanges);

  EXPECT_EQ(stations.host->now(), at_ms(5));
  EXPECT_EQ(all_of(*stations.host).size(), 1U);
}

TEST(MemoryCanBus, AtAQuarterOfTheRateAFrameTakesFourTimesAsLong) {
  MemoryCanBus bus(250'000, Rng(1));
  const std::unique_ptr<MemoryCanPort> host = bus.open();
  const Frame frame = frame_of(0x123);
  ASSERT_EQ(host->send(frame), SendResult::kSent);

  EXPECT_EQ(bus.next_arrival(), Time() + 4 * length_of(frame));
}

TEST(MemoryCanBus, BusyTimeIsThatOfTheFramesAndTheSpacesBetween) {
  TwoStations stations;
  ASSERT_EQ(stations.host->send(frame_of(0x123)), SendResult::kSent);
  ASSERT_EQ(stations.host->send(frame_of(0x124)), SendResult::kSent);

  stations.bus.advance(at_ms(5));

  EXPECT_EQ(stations.bus.busy(),
            length_of(frame_of(0x123)) + length_of(frame_of(0x124)) + Duration(6));
}

TEST(MemoryCanBus, AFullHardwareQueueHasNoRoomUntilAFrameIsTransmitted) {
  MemoryCanBus bus(kBitsPerSecond, Rng(1));
  const std::unique_ptr<MemoryCanPort> host = bus.open(2);
  EXPECT_EQ(host->send(frame_of(1)), SendResult::kSent);
  EXPECT_EQ(host->send(frame_of(2)), SendResult::kSent);
  EXPECT_EQ(host->send(frame_of(3)), SendResult::kFull);

  bus.advance(at_us(200));

  EXPECT_EQ(host->send(frame_of(3)), SendResult::kSent);
  EXPECT_EQ(host->counters().full, 1U);
}

TEST(MemoryCanBus, OffTheBusNothingIsSentOrReceivedAndBackItIsANewSession) {
  for (const PortState state : {PortState::kDown, PortState::kGone, PortState::kBusOff}) {
    TwoStations stations;
    const std::uint64_t session = stations.host->session();
    ASSERT_EQ(stations.host->send(frame_of(0x100)), SendResult::kSent);
    stations.bus.advance(at_us(20));  // in the middle of the frame

    stations.host->set_state(state);
    ASSERT_EQ(stations.vehicle->send(frame_of(0x200)), SendResult::kSent);
    stations.bus.advance(at_ms(1));
    EXPECT_EQ(stations.host->send(frame_of(0x101)), SendResult::kDown);
    EXPECT_TRUE(all_of(*stations.host).empty());
    EXPECT_THAT(ids_of(all_of(*stations.vehicle)), ElementsAre(0x200));

    stations.host->set_state(PortState::kUp);
    EXPECT_NE(stations.host->session(), session);
    stations.bus.advance(at_ms(2));
    EXPECT_TRUE(all_of(*stations.vehicle).empty());
    EXPECT_EQ(stations.host->send(frame_of(0x102)), SendResult::kSent);
    stations.bus.advance(at_ms(3));
    EXPECT_THAT(ids_of(all_of(*stations.vehicle)), ElementsAre(0x102));
  }
}

TEST(MemoryCanBus, WaitingEndsWhenThePortChanges) {
  TwoStations stations;
  stations.vehicle->set_on_arrival([&] { stations.host->set_state(PortState::kBusOff); });
  ASSERT_EQ(stations.host->send(frame_of(0x100)), SendResult::kSent);

  stations.host->wait(milliseconds(50), WaitFor::kArrivals);

  EXPECT_EQ(stations.host->state(), PortState::kBusOff);
  EXPECT_LT(stations.host->now(), at_ms(1));
}

TEST(MemoryCanBus, LossIsAsLikelyAsItIsTold) {
  BusFaults faults;
  faults.loss = 0.25;

  EXPECT_NEAR(static_cast<double>(received_with(faults, 4000).size()), 3000.0, 120.0);
}

TEST(MemoryCanBus, DuplicationIsAsLikelyAsItIsTold) {
  BusFaults faults;
  faults.duplication = 0.1;

  EXPECT_NEAR(static_cast<double>(received_with(faults, 2000).size()), 2200.0, 60.0);
}

TEST(MemoryCanBus, DelayedFramesAreOvertaken) {
  BusFaults faults;
  faults.delay = 0.2;

  const std::vector<PortFrame> received = received_with(faults, 1000);

  ASSERT_EQ(received.size(), 1000U);
  int overtaken = 0;
  for (std::size_t i = 1; i < received.size(); ++i) {
    EXPECT_GE(received[i].stamp, received[i - 1].stamp);
    overtaken += (received[i].frame.data[1] + 16 - received[i - 1].frame.data[1]) % 16 > 8 ? 1 : 0;
  }
  EXPECT_GT(overtaken, 50);
}

TEST(MemoryCanBus, CorruptionChangesOneByteOfSomeFrames) {
  BusFaults faults;
  faults.corruption = 0.5;
  int corrupted = 0;

  const std::vector<PortFrame> received = received_with(faults, 1000);

  for (std::size_t i = 0; i < received.size(); ++i) {
    const Frame sent = frame_of(0x100, static_cast<std::uint8_t>(i % 16));
    int changed = 0;
    for (std::size_t at = 0; at < sent.data.size(); ++at) {
      changed += received[i].frame.data[at] != sent.data[at] ? 1 : 0;
    }
    EXPECT_LE(changed, 1);
    corrupted += changed;
  }
  EXPECT_NEAR(corrupted, 500, 70);
}

TEST(MemoryCanBus, DroppedIdentifiersAreEchoedButNotReceived) {
  TwoStations stations;
  BusFaults faults;
  faults.dropped = id_set({0x104});
  stations.bus.set_faults(faults);
  ASSERT_EQ(stations.host->send(frame_of(0x103)), SendResult::kSent);
  ASSERT_EQ(stations.host->send(frame_of(0x104)), SendResult::kSent);

  stations.bus.advance(at_ms(1));

  EXPECT_THAT(ids_of(all_of(*stations.vehicle)), ElementsAre(0x103));
  EXPECT_EQ(all_of(*stations.host).size(), 2U);
}

TEST(MemoryCanBus, TheSameSeedGivesTheSameFaults) {
  BusFaults faults;
  faults.loss = 0.1;
  faults.duplication = 0.1;
  faults.delay = 0.1;
  faults.corruption = 0.1;

  const std::vector<PortFrame> first = received_with(faults, 500);
  const std::vector<PortFrame> second = received_with(faults, 500);

  ASSERT_EQ(first.size(), second.size());
  for (std::size_t i = 0; i < first.size(); ++i) {
    EXPECT_EQ(first[i].frame, second[i].frame);
    EXPECT_EQ(first[i].stamp, second[i].stamp);
  }
}

}  // namespace
}  // namespace understory::can
