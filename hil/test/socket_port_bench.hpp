// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What tests of the socket port share: a vcan of the kernel that UNDERSTORY_CAN names, whose module
// has echo=1, and whose owner we are (root). Time is real, so whatever is waited for has seconds to
// come.
#pragma once

#include <algorithm>
#include <array>
#include <cstdlib>
#include <functional>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/socket.h>

#include "understory/base/config.hpp"
#include "understory/port/socket_can_port.hpp"

namespace understory::can {

inline constexpr Duration kPatience = std::chrono::seconds(5);

inline Frame frame_of(std::uint16_t id, std::uint8_t number = 0) {
  Frame frame;
  frame.id = id;
  frame.data = {number, 1, 2, 3, 4, 5, 6, 7};
  return frame;
}

// What waits for something and what arrived meanwhile.
inline std::vector<PortFrame> receive_until(CanPort& port,
                                            const std::function<bool(std::size_t)>& done) {
  std::vector<PortFrame> frames;
  std::array<PortFrame, 64> batch;
  const Time end = port.now() + kPatience;
  while (!done(frames.size()) && port.now() < end) {
    const std::size_t count = port.receive(batch.data(), batch.size());
    frames.insert(frames.end(), batch.begin(), batch.begin() + count);
    if (count == 0 && !done(frames.size())) {
      port.wait(std::chrono::milliseconds(20), WaitFor::kArrivals);
    }
  }
  return frames;
}

inline std::vector<PortFrame> receive_count(CanPort& port, std::size_t count) {
  return receive_until(port, [count](std::size_t got) { return got >= count; });
}

inline std::vector<PortFrame> receive_for(CanPort& port, Duration duration) {
  const Time end = port.now() + duration;
  return receive_until(port, [&](std::size_t) { return port.now() >= end; });
}

inline bool reaches(CanPort& port, PortState state) {
  receive_until(port, [&](std::size_t) { return port.state() == state; });
  return port.state() == state;
}

inline std::vector<std::uint16_t> ids_of(const std::vector<PortFrame>& frames) {
  std::vector<std::uint16_t> ids;
  for (const PortFrame& frame : frames) {
    ids.push_back(frame.frame.id);
  }
  return ids;
}

inline bool run(const std::string& command) {
  // NOLINTNEXTLINE(bugprone-command-processor): the tests' own words
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

}  // namespace understory::can
