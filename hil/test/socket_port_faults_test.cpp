// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// The socket port when its interface or controller fails. Run by the HIL suite on a bus of its own.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/can/error.h>
#include <sys/ioctl.h>
#include <termios.h>

#include "socket_port_bench.hpp"

namespace understory::can {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::ElementsAre;

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
    host.wait(end - host.now(), WaitFor::kArrivals);
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
