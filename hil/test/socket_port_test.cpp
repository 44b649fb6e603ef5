// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// The socket port on a vcan of the kernel: UNDERSTORY_CAN names it, its module has echo=1, and we
// are root. Run by the HIL suite on a bus of its own; here time is real, so whatever is waited for
// has seconds to come.
#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <vector>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <termios.h>

#include "understory/base/config.hpp"
#include "understory/port/can_node.hpp"
#include "understory/port/socket_can_port.hpp"

namespace understory::can {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr Duration kPatience = seconds(5);

Frame frame_of(std::uint16_t id, std::uint8_t number = 0) {
  Frame frame;
  frame.id = id;
  frame.data = {number, 1, 2, 3, 4, 5, 6, 7};
  return frame;
}

// What waits for something and what arrived meanwhile.
std::vector<PortFrame> receive_until(CanPort& port, const std::function<bool(std::size_t)>& done) {
  std::vector<PortFrame> frames;
  std::array<PortFrame, 64> batch;
  const Time end = port.now() + kPatience;
  while (!done(frames.size()) && port.now() < end) {
    const std::size_t count = port.receive(batch.data(), batch.size());
    frames.insert(frames.end(), batch.begin(), batch.begin() + count);
    if (count == 0 && !done(frames.size())) {
      port.wait(std::min(end, port.now() + milliseconds(20)));
    }
  }
  return frames;
}

std::vector<PortFrame> receive_count(CanPort& port, std::size_t count) {
  return receive_until(port, [count](std::size_t got) { return got >= count; });
}

std::vector<PortFrame> receive_for(CanPort& port, Duration duration) {
  const Time end = port.now() + duration;
  return receive_until(port, [&](std::size_t) { return port.now() >= end; });
}

bool reaches(CanPort& port, PortState state) {
  receive_until(port, [&](std::size_t) { return port.state() == state; });
  return port.state() == state;
}

std::vector<std::uint16_t> ids_of(const std::vector<PortFrame>& frames) {
  std::vector<std::uint16_t> ids;
  for (const PortFrame& frame : frames) {
    ids.push_back(frame.frame.id);
  }
  return ids;
}

bool run(const std::string& command) {
  return std::system((command + " >/dev/null 2>&1").c_str()) == 0;
}

template <class Make>
std::string error_of(const Make& make) {
  try {
    make();
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "none";
}

class SocketPort : public ::testing::Test {
 public:
  void SetUp() override {
    const char* const given = std::getenv("UNDERSTORY_CAN");
    ASSERT_NE(given, nullptr) << "UNDERSTORY_CAN names the interface to test on";
    name = given;
    ASSERT_TRUE(run("ip link show " + name) || create()) << name;
    run("tc qdisc del dev " + name + " root");
    ASSERT_TRUE(run("ip link set " + name + " up"));
  }
  void TearDown() override { run("tc qdisc del dev " + name + " root"); }

  [[nodiscard]] bool create() const {
    return run("ip link add dev " + name + " type vcan") && run("ip link set " + name + " up");
  }
  [[nodiscard]] bool destroy() const { return run("ip link del " + name); }
  // A frame as no port sends it.
  void inject(canid_t id) const {
    const UniqueFd fd(::socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC, CAN_RAW));
    sockaddr_can address{};
    address.can_family = AF_CAN;
    address.can_ifindex = static_cast<int>(::if_nametoindex(name.c_str()));
    ASSERT_EQ(::bind(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
    can_frame frame{};
    frame.can_id = id;
    frame.can_dlc = 8;
    ASSERT_EQ(::write(fd.get(), &frame, sizeof(frame)), static_cast<ssize_t>(sizeof(frame)));
  }

  std::string name;
  IdSet all = IdSet().set();
};

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

TEST_F(SocketPort, AnInterfaceThatGoesDownAndUpIsANewSession) {
  SocketCanPort host(name, all);
  SocketCanPort vehicle(name, all);
  const std::uint64_t session = host.session();

  ASSERT_TRUE(run("ip link set " + name + " down"));
  EXPECT_TRUE(reaches(host, PortState::kDown));
  EXPECT_EQ(host.send(frame_of(0x101)), SendResult::kDown);

  ASSERT_TRUE(run("ip link set " + name + " up"));
  EXPECT_TRUE(reaches(host, PortState::kUp));
  EXPECT_NE(host.session(), session);
  EXPECT_TRUE(reaches(vehicle, PortState::kDown) || vehicle.counters().reopened == 1U);
  EXPECT_TRUE(reaches(vehicle, PortState::kUp));
  ASSERT_EQ(host.send(frame_of(0x102)), SendResult::kSent);
  EXPECT_THAT(ids_of(receive_count(vehicle, 1)), ElementsAre(0x102));
}

TEST_F(SocketPort, DownAndUpBetweenTwoLooksIsANewSessionToo) {
  SocketCanPort host(name, all);
  const std::uint64_t session = host.session();

  ASSERT_TRUE(run("ip link set " + name + " down"));
  ASSERT_TRUE(run("ip link set " + name + " up"));
  receive_until(host, [&](std::size_t) { return host.session() != session; });

  EXPECT_NE(host.session(), session);
  EXPECT_EQ(host.state(), PortState::kUp);
}

TEST_F(SocketPort, AnInterfaceThatIsDeletedAndCreatedAnewIsFoundAgain) {
  SocketCanPort host(name, all);
  const std::uint64_t session = host.session();

  ASSERT_TRUE(destroy());
  EXPECT_TRUE(reaches(host, PortState::kGone));
  EXPECT_EQ(host.send(frame_of(0x101)), SendResult::kDown);

  ASSERT_TRUE(create());
  EXPECT_TRUE(reaches(host, PortState::kUp));
  EXPECT_NE(host.session(), session);
  ASSERT_EQ(host.send(frame_of(0x102)), SendResult::kSent);
  EXPECT_THAT(ids_of(receive_count(host, 1)), ElementsAre(0x102));
}

TEST_F(SocketPort, AnInterfaceCreatedAnewBetweenTwoLooksIsFoundToo) {
  SocketCanPort host(name, all);
  const std::uint64_t session = host.session();

  ASSERT_TRUE(destroy());
  ASSERT_TRUE(create());
  receive_until(host, [&](std::size_t) { return host.session() != session; });

  ASSERT_EQ(host.send(frame_of(0x102)), SendResult::kSent);
  EXPECT_THAT(ids_of(receive_count(host, 1)), ElementsAre(0x102));
}

TEST_F(SocketPort, ABackOffGrowsToASecondAndAnEventEndsIt) {
  ASSERT_TRUE(run("ip link set " + name + " down"));
  SocketCanPort host(name, all);
  EXPECT_EQ(host.state(), PortState::kDown);
  int waits = 0;
  for (const Time end = host.now() + seconds(3); host.now() < end; ++waits) {
    host.wait(end);
  }
  EXPECT_LE(waits, 11);

  ASSERT_TRUE(run("ip link set " + name + " up"));
  const Time up = host.now();
  EXPECT_TRUE(reaches(host, PortState::kUp));
  EXPECT_LT(host.now() - up, milliseconds(200));
}

TEST_F(SocketPort, ErrorFramesAreCountedAndNotPassedOn) {
  SocketCanPort port(name, all);

  inject(CAN_ERR_FLAG | CAN_ERR_CRTL);
  inject(CAN_ERR_FLAG | CAN_ERR_RESTARTED);

  EXPECT_TRUE(receive_for(port, milliseconds(100)).empty());
  EXPECT_EQ(port.counters().error_frames, 2U);
  EXPECT_EQ(port.state(), PortState::kUp);
}

TEST_F(SocketPort, ABusOffFrameEndsTheSession) {
  SocketCanPort port(name, all);
  const std::uint64_t session = port.session();

  inject(CAN_ERR_FLAG | CAN_ERR_BUSOFF);
  EXPECT_TRUE(reaches(port, PortState::kBusOff));
  EXPECT_EQ(port.send(frame_of(0x101)), SendResult::kDown);

  EXPECT_TRUE(reaches(port, PortState::kUp));
  EXPECT_NE(port.session(), session);
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
    port.wait(until);
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
    host.run_until(host.now() + milliseconds(5), nothing);
  }
  host.run_until(host.now() + milliseconds(50), nothing);

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

// A controller behind a serial line, here a pseudo terminal: the kernel's driver takes its state
// from what the line says.
class SerialController {
 public:
  SerialController() : line_(::posix_openpt(O_RDWR | O_NOCTTY)) {
    ::grantpt(line_.get());
    ::unlockpt(line_.get());
    std::array<char, 64> path{};
    ::ptsname_r(line_.get(), path.data(), path.size());
    driver_.reset(::open(path.data(), O_RDWR | O_NOCTTY));
    const int slcan_discipline = 17;
    termios settings{};
    ::tcgetattr(driver_.get(), &settings);
    ::cfmakeraw(&settings);
    ::tcsetattr(driver_.get(), TCSANOW, &settings);
    std::array<char, IFNAMSIZ> name{};
    if (::ioctl(driver_.get(), TIOCSETD, &slcan_discipline) == 0 &&
        ::ioctl(driver_.get(), SIOCGIFNAME, name.data()) == 0) {
      name_ = name.data();
    }
  }
  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] bool say(const std::string& text) const {
    return ::write(line_.get(), text.data(), text.size()) == static_cast<ssize_t>(text.size());
  }

 private:
  UniqueFd line_;
  UniqueFd driver_;
  std::string name_;
};

TEST_F(SocketPort, BusOffOfAControllerIsSeenAndSoIsItsRestart) {
  const SerialController controller;
  ASSERT_FALSE(controller.name().empty()) << "no slcan in this kernel";
  ASSERT_TRUE(run("ip link set " + controller.name() + " up"));
  SocketCanPort port(controller.name(), all);
  ASSERT_EQ(port.state(), PortState::kUp);
  const std::uint64_t session = port.session();

  ASSERT_TRUE(controller.say("sb256256\r"));
  EXPECT_TRUE(reaches(port, PortState::kBusOff));
  receive_for(port, milliseconds(500));
  EXPECT_EQ(port.state(), PortState::kBusOff);
  EXPECT_EQ(port.session(), session);

  ASSERT_TRUE(run("ip link set " + controller.name() + " down"));
  ASSERT_TRUE(run("ip link set " + controller.name() + " up"));
  EXPECT_TRUE(reaches(port, PortState::kUp));
  EXPECT_NE(port.session(), session);
}

}  // namespace
}  // namespace understory::can
