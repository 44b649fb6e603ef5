// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// One station's access to a CAN bus: a socket, or the bus in memory. Nothing here blocks but
// wait(), and nothing allocates or throws after construction; what goes wrong is told by results,
// states and counters. Times are of the port's own clock: CLOCK_REALTIME for sockets, the virtual
// one in memory. One thread.
#pragma once

#include <cstddef>
#include <cstdint>

#include "understory/base/time.hpp"
#include "understory/can/frame.hpp"

namespace understory::can {

struct PortFrame {
  Frame frame;
  Time stamp{};         // when it was on the bus, as the kernel tells
  bool is_own = false;  // sent by this port: the proof that it was transmitted
};

enum class PortState : std::uint8_t {
  kUp,
  kDown,    // the interface is there, but down
  kGone,    // there is no such interface, or no access to it
  kBusOff,  // the controller has taken itself off the bus
};
[[nodiscard]] const char* to_string(PortState state);

enum class SendResult : std::uint8_t {
  kSent,  // handed over; its echo proves that it was transmitted
  kFull,  // no room (ENOBUFS): not sent
  kDown,  // no bus: not sent
};

// What ends a port's sleep before its time.
enum class WaitFor : std::uint8_t {
  kArrivals,  // or a change of the bus
  kChanges,   // of the bus; what has arrived can wait
};

struct PortCounters {
  std::uint64_t received = 0;  // without echoes
  std::uint64_t sent = 0;
  std::uint64_t ignored = 0;  // remote, extended, wrong length, FD
  std::uint64_t full = 0;
  std::uint64_t error_frames = 0;
  std::uint64_t overflows = 0;  // told by the kernel; message counters are the complete detector
  std::uint64_t reopened = 0;
};

class CanPort {
 public:
  CanPort() = default;
  CanPort(const CanPort&) = delete;
  CanPort& operator=(const CanPort&) = delete;
  virtual ~CanPort() = default;

  [[nodiscard]] virtual SendResult send(const Frame& frame) = 0;
  // What has arrived, oldest first, own echoes among them; at most `most`. Returns how many.
  [[nodiscard]] virtual std::size_t receive(PortFrame* frames, std::size_t most) = 0;
  // Returns after `at_most`, or when what is waited for has happened, or for no reason.
  virtual void wait(Duration at_most, WaitFor what) = 0;
  [[nodiscard]] virtual Time now() const = 0;
  [[nodiscard]] virtual PortState state() const = 0;
  // Another number after every loss of the bus: what was queued before must not be sent.
  [[nodiscard]] virtual std::uint64_t session() const = 0;
  [[nodiscard]] virtual const PortCounters& counters() const = 0;
};

// Where protocol code puts frames to send.
class FrameSink {
 public:
  FrameSink() = default;
  FrameSink(const FrameSink&) = delete;
  FrameSink& operator=(const FrameSink&) = delete;
  virtual ~FrameSink() = default;

  virtual void send(const Frame& frame, Time now) = 0;
};

}  // namespace understory::can
