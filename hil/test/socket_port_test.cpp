// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Frames through the socket port. Run by the HIL suite on a bus of its own.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "socket_port_bench.hpp"
#include "understory/port/can_node.hpp"

namespace understory::can {
namespace {

using std::chrono::milliseconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST_F(SocketPort, AFrameReachesTheOtherAndItsEchoTheSender) {
  SocketCanPort host(name, all);
  SocketCanPort vehicle(name, all);
  const Time before = host.now();

  ASSERT_EQ(host.send(frame_of(0x101, 7)), SendResult::kSent);
  const std::vector<PortFrame> received = receive_count(vehicle, 1);
  const std::vector<PortFrame> echoes = receive_count(host, 1);

  const Time after = host.now();
  ASSERT_EQ(received.size(), 1U);
  ASSERT_EQ(echoes.size(), 1U);
  EXPECT_EQ(received[0].frame, frame_of(0x101, 7));
  EXPECT_FALSE(received[0].is_own);
  EXPECT_EQ(echoes[0].frame, frame_of(0x101, 7));
  EXPECT_TRUE(echoes[0].is_own);
  EXPECT_EQ(echoes[0].stamp, received[0].stamp);
  EXPECT_GE(received[0].stamp, before);
  EXPECT_LE(received[0].stamp, after);
  EXPECT_EQ(vehicle.counters().received, 1U);
  EXPECT_EQ(host.counters().received, 0U);
}

TEST_F(SocketPort, AStampIsOfTheArrivalNotOfTheReading) {
  SocketCanPort host(name, all);
  SocketCanPort vehicle(name, all);
  ASSERT_EQ(host.send(frame_of(0x101)), SendResult::kSent);
  const Time sent = host.now();

  ASSERT_TRUE(receive_for(host, milliseconds(100)).size() == 1U);
  const std::vector<PortFrame> received = receive_count(vehicle, 1);

  ASSERT_EQ(received.size(), 1U);
  EXPECT_LE(received[0].stamp, sent + milliseconds(5));
}

TEST_F(SocketPort, OnlyListedStandardDataFramesComeThrough) {
  SocketCanPort port(name, id_set({0x101, 0x102}));

  inject(0x100);
  inject(0x101 | CAN_EFF_FLAG);
  inject(0x101 | CAN_RTR_FLAG);
  inject(0x102);

  EXPECT_THAT(ids_of(receive_for(port, milliseconds(100))), ElementsAre(0x102));
}

TEST_F(SocketPort, AFullInterfaceQueueIsToldAtOnce) {
  ASSERT_TRUE(run("tc qdisc add dev " + name + " root netem rate 100kbit limit 3"));
  SocketCanPort host(name, all);
  const Time before = host.now();
  std::size_t sent = 0;

  for (int i = 0; i < 20; ++i) {
    sent += host.send(frame_of(0x101)) == SendResult::kSent ? 1U : 0U;
  }

  EXPECT_LT(host.now() - before, milliseconds(100));
  EXPECT_LT(sent, 20U);
  EXPECT_EQ(host.counters().full, 20U - sent);
  EXPECT_EQ(host.state(), PortState::kUp);
  EXPECT_EQ(receive_for(host, milliseconds(200)).size(), sent);
  EXPECT_EQ(host.send(frame_of(0x101)), SendResult::kSent);
}

TEST_F(SocketPort, ABurstOfTwoThousandFramesIsReceivedWhole) {
  constexpr std::size_t kFrames = 2000;
  SocketCanPort host(name, all);
  SocketCanPort vehicle(name, all);
  EXPECT_GE(host.receive_buffer_bytes(), 2 * 1024 * 1024);

  for (std::size_t i = 0; i < kFrames; ++i) {
    ASSERT_EQ(host.send(frame_of(static_cast<std::uint16_t>(i))), SendResult::kSent);
  }
  const std::vector<PortFrame> received = receive_count(vehicle, kFrames);
  const std::vector<PortFrame> echoes = receive_count(host, kFrames);

  ASSERT_EQ(received.size(), kFrames);
  ASSERT_EQ(echoes.size(), kFrames);
  for (std::size_t i = 0; i < kFrames; ++i) {
    EXPECT_EQ(received[i].frame.id, i);
    EXPECT_TRUE(echoes[i].is_own);
  }
  EXPECT_EQ(vehicle.counters().overflows, 0U);
}

TEST_F(SocketPort, WaitingEndsAtItsTime) {
  SocketCanPort port(name, all);
  std::vector<Duration> late;

  for (int i = 0; i < 50; ++i) {
    const Time until = port.now() + milliseconds(4);
    port.wait(milliseconds(4), WaitFor::kArrivals);
    late.push_back(port.now() - until);
  }

  std::sort(late.begin(), late.end());
  EXPECT_GE(late.front(), Duration(0));
  EXPECT_LT(late[25], milliseconds(2));
  RecordProperty("late_us_median", static_cast<int>(late[25].count()));
}

TEST_F(SocketPort, WhatANodeSendsReachesAnotherAndIsConfirmed) {
  constexpr std::size_t kSets = 200;
  const IdSet set = id_set({0x100, 0x101, 0x102, 0x103, 0x104});
  CanNodeConfig config;
  config.transmits = set;
  config.set = set;
  CanNode host(std::make_unique<SocketCanPort>(name, set), config);
  SocketCanPort vehicle(name, set);
  class Nothing : public FrameHandler {
   public:
    void on_frame(const PortFrame& /*frame*/) override {}
  } nothing;

  for (std::size_t i = 0; i < kSets; ++i) {
    host.poll(nothing);
    for (std::uint16_t id = 0x100; id <= 0x104; ++id) {
      Frame frame = frame_of(id);
      frame.data[1] = static_cast<std::uint8_t>(i % 16);
      host.send(frame, host.now());
    }
    host.run_until(host.now(), host.now() + milliseconds(5), nothing);
  }
  host.run_until(host.now(), host.now() + milliseconds(50), nothing);

  // A busy machine may stall us for longer than a set lives.
  const TxCounters& counters = host.queue().counters();
  EXPECT_GE(counters.sent, 5 * kSets * 9 / 10);
  EXPECT_EQ(counters.confirmed, counters.sent);
  EXPECT_EQ(receive_count(vehicle, counters.sent).size(), counters.sent);
  EXPECT_EQ(host.counters().foreign_own_ids, 0U);
}

TEST_F(SocketPort, AnInterfaceForCanFdWillDo) {
  ASSERT_TRUE(run("ip link set " + name + " down"));
  ASSERT_TRUE(run("ip link set " + name + " mtu 72"));
  ASSERT_TRUE(run("ip link set " + name + " up"));

  SocketCanPort port(name, all);
  ASSERT_EQ(port.send(frame_of(0x101)), SendResult::kSent);
  EXPECT_EQ(receive_count(port, 1).size(), 1U);
}

TEST_F(SocketPort, AMissingInterfaceIsNamedAndSoAreThoseThatExist) {
  const std::string error = error_of([&] { SocketCanPort port("can42", all); });

  EXPECT_THAT(error, HasSubstr("'can42'"));
  EXPECT_THAT(error, HasSubstr("does not exist"));
  EXPECT_THAT(error, HasSubstr(name));
}

TEST_F(SocketPort, AnInterfaceThatIsNotCanIsRefused) {
  const std::string error = error_of([&] { SocketCanPort port("lo", all); });

  EXPECT_THAT(error, HasSubstr("'lo'"));
  EXPECT_THAT(error, HasSubstr("not a CAN interface"));
}

}  // namespace
}  // namespace understory::can
