// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/port/can_node.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/fake_can_port.hpp"
#include "understory/port/memory_can_bus.hpp"

namespace understory::can {
namespace {

using test::at_ms;
using test::at_us;
using test::FakeCanPort;
using test::frame_of;
using ::testing::ElementsAre;

constexpr int kBitsPerSecond = 1'000'000;
const std::vector<std::uint16_t> kSet = {0x100, 0x101, 0x102, 0x103, 0x104};

class Record : public FrameHandler {
 public:
  void on_frame(const PortFrame& frame) override { frames.push_back(frame); }
  void on_echo(const PortFrame& frame) override { echoes.push_back(frame); }

  std::vector<PortFrame> frames;
  std::vector<PortFrame> echoes;
};

class Tape : public FrameTap {
 public:
  void on_port_frame(const PortFrame& frame) override { frames.push_back(frame); }

  std::vector<PortFrame> frames;
};

// Answers each PING at once.
class Answering : public FrameHandler {
 public:
  explicit Answering(CanNode& node) : node_(node) {}
  void on_frame(const PortFrame& frame) override {
    if (frame.frame.id == 0x180) {
      node_.send(frame_of(0x181, frame.frame.data[1]), frame.stamp);
    }
  }

 private:
  CanNode& node_;
};

CanNodeConfig host_config() {
  CanNodeConfig config;
  config.transmits = id_set({0x010, 0x100, 0x101, 0x102, 0x103, 0x104, 0x180});
  config.set = id_set({0x100, 0x101, 0x102, 0x103, 0x104});
  config.receives = {{0x181, 5.0}, {0x200, 100.0}};
  return config;
}

CanNodeConfig vehicle_config() {
  CanNodeConfig config;
  config.transmits = id_set({0x181, 0x200});
  config.receives = {{0x100, 100.0}, {0x104, 100.0}, {0x180, 5.0}};
  return config;
}

struct FakeBus {
  explicit FakeBus(const CanNodeConfig& config = host_config()) {
    auto owned = std::make_unique<FakeCanPort>();
    port = owned.get();
    node = std::make_unique<CanNode>(std::move(owned), config);
  }
  void arrive(std::uint16_t id, Time stamp, bool is_own = false) {
    port->arrived.push_back({frame_of(id), stamp, is_own});
    port->time = stamp;
  }

  FakeCanPort* port = nullptr;
  std::unique_ptr<CanNode> node;
  Record record;
};

TEST(CanNode, PassesOnWhatOthersSendAndOwnEchoesApart) {
  FakeBus bus;
  bus.arrive(0x200, at_us(100));
  bus.arrive(0x100, at_us(230), true);

  bus.node->poll(bus.record);

  ASSERT_EQ(bus.record.frames.size(), 1U);
  EXPECT_EQ(bus.record.frames[0].frame.id, 0x200);
  ASSERT_EQ(bus.record.echoes.size(), 1U);
  EXPECT_EQ(bus.record.echoes[0].stamp, at_us(230));
}

TEST(CanNode, SendsAfterTheBatchAndOnlyWhatItMay) {
  FakeBus bus;
  bus.node->send(frame_of(0x100), at_ms(0));
  bus.node->send(frame_of(0x200), at_ms(0));
  EXPECT_TRUE(bus.port->sent.empty());

  bus.node->poll(bus.record);

  EXPECT_THAT(bus.port->sent_ids(), ElementsAre(0x100));
  EXPECT_EQ(bus.node->queue().counters().refused, 1U);
}

TEST(CanNode, HandlesMoreThanOneBatchInOnePoll) {
  FakeBus bus;
  for (std::int64_t i = 0; i < 200; ++i) {
    bus.arrive(0x200, at_ms(10 * i));
  }

  bus.node->poll(bus.record);

  EXPECT_EQ(bus.record.frames.size(), 200U);
}

TEST(CanNode, TheTapSeesEverythingThatArrives) {
  FakeBus bus;
  const auto tape = std::make_shared<Tape>();
  bus.node->set_tap(tape);
  bus.arrive(0x200, at_us(100));
  bus.arrive(0x100, at_us(200), true);
  bus.arrive(0x100, at_us(300));
  bus.arrive(0x7FF, at_us(400));

  bus.node->poll(bus.record);

  EXPECT_EQ(tape->frames.size(), 4U);
  EXPECT_EQ(bus.record.frames.size(), 1U);
}

TEST(CanNode, OwnIdentifiersOfAnotherSenderAreCountedAndNotPassedOn) {
  FakeBus bus;
  bus.arrive(0x100, at_us(300));

  bus.node->poll(bus.record);

  EXPECT_TRUE(bus.record.frames.empty());
  EXPECT_EQ(bus.node->counters().foreign_own_ids, 1U);
}

TEST(CanNode, IdentifiersThatAreNotListedAreCountedAndNotPassedOn) {
  FakeBus bus;
  bus.arrive(0x7FF, at_us(300));

  bus.node->poll(bus.record);

  EXPECT_TRUE(bus.record.frames.empty());
  EXPECT_EQ(bus.node->counters().unlisted, 1U);
}

TEST(CanNode, TwiceTheNominalRateIsNoFlood) {
  FakeBus bus;

  for (int ms = 0; ms < 2000; ms += 5) {
    bus.arrive(0x200, at_ms(ms));
    bus.node->poll(bus.record);
  }

  EXPECT_EQ(bus.record.frames.size(), 400U);
  EXPECT_FALSE(bus.node->is_flooded());
}

TEST(CanNode, OfAFloodThreeTimesTheNominalRatePasses) {
  FakeBus bus;

  for (int us = 0; us < 2'000'000; us += 500) {
    bus.arrive(0x200, at_us(us));
    bus.node->poll(bus.record);
  }

  EXPECT_NEAR(static_cast<double>(bus.record.frames.size()), 600.0, 16.0);
  EXPECT_EQ(bus.node->counters().flooded, 4000U - bus.record.frames.size());
  EXPECT_TRUE(bus.node->is_flooded());
}

TEST(CanNode, AFloodOfOneIdentifierCostsNoOther) {
  FakeBus bus;

  for (int ms = 0; ms < 2000; ++ms) {
    bus.arrive(0x200, at_ms(ms));
    if (ms % 200 == 0) {
      bus.arrive(0x181, at_ms(ms));
    }
    bus.node->poll(bus.record);
  }

  const auto pongs = std::count_if(bus.record.frames.begin(),
                                   bus.record.frames.end(),
                                   [](const PortFrame& frame) { return frame.frame.id == 0x181; });
  EXPECT_EQ(pongs, 10);
}

TEST(CanNode, AFloodIsOverHalfASecondAfterItsLastFrame) {
  FakeBus bus;
  for (int ms = 0; ms < 100; ++ms) {
    bus.arrive(0x200, at_ms(ms));
  }
  bus.node->poll(bus.record);
  ASSERT_TRUE(bus.node->is_flooded());

  bus.port->time = at_ms(700);
  bus.node->poll(bus.record);

  EXPECT_FALSE(bus.node->is_flooded());
}

TEST(CanNode, WhenTheClockIsSetBackFramesStillPass) {
  FakeBus bus;
  bus.arrive(0x200, at_ms(100'000));
  bus.node->poll(bus.record);

  for (int ms = 0; ms < 100; ms += 10) {
    bus.arrive(0x200, at_ms(ms));
    bus.node->poll(bus.record);
  }

  EXPECT_EQ(bus.record.frames.size(), 11U);
}

TEST(CanNode, WakesToNoticeThatNoEchoComes) {
  FakeBus bus;
  bus.node->send(frame_of(0x100), at_ms(0));

  bus.node->run_until(at_ms(0), at_ms(500), bus.record);

  EXPECT_TRUE(bus.node->is_stalled());
}

// A frame that comes while nothing of ours is on its way: who answers must hear of it at once.
TEST(CanNode, AClockThatIsSetBackEndsTheWait) {
  auto owned = std::make_unique<FakeCanPort>();
  FakeCanPort& port = *owned;
  CanNode node(std::move(owned), host_config());
  Record record;
  port.time = at_ms(7200000);
  port.set_back = std::chrono::hours(1);

  node.run_until(port.time, port.time + std::chrono::milliseconds(10), record);

  EXPECT_EQ(port.waited_for.size(), 1U);
  EXPECT_EQ(node.now(), at_ms(3600010));
}

TEST(CanNode, OnlyWhoAnswersOrIsSendingWakesForEachFrame) {
  for (const bool answers : {true, false}) {
    CanNodeConfig config = host_config();
    config.answers = answers;
    auto owned = std::make_unique<FakeCanPort>();
    const FakeCanPort& port = *owned;
    CanNode node(std::move(owned), config);
    Record record;

    node.run_until(at_ms(0), at_ms(1), record);
    node.send(frame_of(0x100), at_ms(1));
    node.run_until(at_ms(1), at_ms(2), record);

    const WaitFor idle = answers ? WaitFor::kArrivals : WaitFor::kChanges;
    EXPECT_THAT(port.waited_for, ElementsAre(idle, WaitFor::kArrivals));
  }
}

struct MemoryBus {
  MemoryBus() {
    vehicle_port->set_on_arrival([this] { vehicle->poll(answers); });
    host = std::make_unique<CanNode>(std::move(host_port), host_config());
  }

  MemoryCanBus bus{kBitsPerSecond, Rng(3)};
  std::unique_ptr<MemoryCanPort> host_port = bus.open();
  std::unique_ptr<MemoryCanPort> owned_vehicle_port = bus.open();
  MemoryCanPort* vehicle_port = owned_vehicle_port.get();
  std::unique_ptr<CanNode> host;
  std::unique_ptr<CanNode> vehicle =
      std::make_unique<CanNode>(std::move(owned_vehicle_port), vehicle_config());
  Answering answers{*vehicle};
  Record record;
};

TEST(CanNode, APingIsAnsweredWithinTwoFrames) {
  MemoryBus bus;
  bus.host->send(frame_of(0x180), at_ms(0));

  bus.host->run_until(at_ms(0), at_ms(5), bus.record);

  ASSERT_EQ(bus.record.echoes.size(), 1U);
  ASSERT_EQ(bus.record.frames.size(), 1U);
  EXPECT_EQ(bus.record.frames[0].frame.id, 0x181);
  EXPECT_LT(bus.record.frames[0].stamp - bus.record.echoes[0].stamp, Duration(135));
  EXPECT_EQ(bus.host->now(), at_ms(5));
}

TEST(CanNode, ASetOfFiveGoesOutBackToBackThroughAWindowOfTwo) {
  MemoryBus bus;
  for (const std::uint16_t id : kSet) {
    bus.host->send(frame_of(id), at_ms(0));
  }

  bus.host->run_until(at_ms(0), at_ms(5), bus.record);

  ASSERT_EQ(bus.record.echoes.size(), 5U);
  EXPECT_EQ(bus.bus.busy(), bus.record.echoes.back().stamp - Time() + Duration(3));
}

// One frame is on the bus and one of ours is before it in the controller; that one may have to let
// one of another station pass. Behind a long queue in the kernel it would be hundreds.
TEST(CanNode, AnUrgentFrameWaitsForThreeOthersAtMost) {
  constexpr Duration kLongestFrame{135};
  MemoryBus bus;
  Rng rng(23);
  Duration longest{0};
  Time next_set{};
  while (bus.bus.now() < at_ms(2000)) {
    const Time now = bus.bus.now();
    if (now >= next_set) {
      next_set = now + Duration(700);  // the bus is nearly full
      for (const std::uint16_t id : kSet) {
        bus.host->send(frame_of(id, static_cast<std::uint8_t>(rng.below(16))), now);
      }
      bus.vehicle->send(frame_of(0x200), now);
      bus.vehicle->poll(bus.answers);
    }
    bus.host->run_until(now, now + Duration(static_cast<std::int64_t>(rng.below(300))), bus.record);
    const Time asked = bus.host->now();
    bus.host->send(frame_of(0x010), asked);
    const std::size_t before = bus.record.echoes.size();
    bus.host->run_until(asked, asked + Duration(600), bus.record);
    for (std::size_t i = before; i < bus.record.echoes.size(); ++i) {
      const PortFrame& echo = bus.record.echoes[i];
      longest = echo.frame.id == 0x010 ? std::max(longest, echo.stamp - asked) : longest;
    }
  }

  EXPECT_GT(longest, 2 * kLongestFrame);
  EXPECT_LE(longest, 4 * kLongestFrame);
}

TEST(CanNode, AfterBusOffNothingOfTheOldSessionIsSent) {
  MemoryCanBus bus(kBitsPerSecond, Rng(3));
  std::unique_ptr<MemoryCanPort> owned = bus.open();
  MemoryCanPort& port = *owned;
  const std::unique_ptr<MemoryCanPort> listener = bus.open();
  CanNode node(std::move(owned), host_config());
  Record record;
  for (const std::uint16_t id : kSet) {
    node.send(frame_of(id), at_ms(0));
  }
  node.poll(record);

  port.set_state(PortState::kBusOff);
  node.run_until(at_ms(0), at_ms(1), record);
  node.send(frame_of(0x010), at_ms(1));
  node.run_until(at_ms(1), at_ms(2), record);
  port.set_state(PortState::kUp);
  node.run_until(at_ms(2), at_ms(3), record);

  EXPECT_TRUE(record.echoes.empty());
  std::array<PortFrame, 8> frames;
  EXPECT_EQ(listener->receive(frames.data(), frames.size()), 0U);
}

}  // namespace
}  // namespace understory::can
