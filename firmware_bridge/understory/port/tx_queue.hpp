// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What waits to be sent: lowest identifier first, one frame per identifier (the newest), none older
// than 20 ms, and only identifiers that this station may send. At most two frames are handed to the
// port at a time, because what waits behind a long kernel queue cannot be overtaken; the frame's
// own echo makes room for the next. Frames of the set (a setpoint's, an odometry's) belong together
// by their counter: when one is dropped or a newer set begins, the rest of that set goes too. Never
// blocks, allocates nothing after construction; what is lost is counted. One thread.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "understory/base/time.hpp"
#include "understory/can/frame.hpp"
#include "understory/can/id_set.hpp"
#include "understory/port/can_port.hpp"

namespace understory::can {

struct TxCounters {
  std::uint64_t sent = 0;              // frames handed to the port
  std::uint64_t confirmed = 0;         // by their echo
  std::uint64_t unconfirmed = 0;       // no echo in time, or a later one's came first
  std::uint64_t unknown_echoes = 0;    // of nothing in flight: late, or altered on the way
  std::uint64_t replaced = 0;          // by newer ones
  std::uint64_t expired = 0;           // waited longer than kDeadline
  std::uint64_t full = 0;              // times that the port had no room
  std::uint64_t dropped_with_set = 0;  // frames, when another one of their set had no room
  std::uint64_t torn_sets = 0;         // only a part was sent
  std::uint64_t purged = 0;            // frames queued or in flight when the bus was lost
  std::uint64_t refused = 0;           // identifiers that this station may not send
};

class TxQueue {
 public:
  static constexpr Duration kDeadline = std::chrono::milliseconds(20);
  static constexpr Duration kEchoTimeout = std::chrono::milliseconds(100);
  static constexpr Duration kRetry = std::chrono::milliseconds(1);  // when the port had no room
  static constexpr std::size_t kWindow = 2;

  // Both are lists of identifiers; `set` names those that belong together.
  TxQueue(const IdSet& allowed, const IdSet& set);

  void push(const Frame& frame, Time now);
  // Hands over what may be sent now.
  void pump(CanPort& port, Time now);
  // An own echo.
  void confirm(const Frame& frame, Time now);

  // No echo for kEchoTimeout, and none since. Meanwhile one frame per kEchoTimeout probes the bus.
  [[nodiscard]] bool is_stalled() const { return is_stalled_; }
  // When pump() has something to do even if nothing is pushed or confirmed.
  [[nodiscard]] std::optional<Time> wake_at() const;
  [[nodiscard]] std::size_t waiting() const;
  [[nodiscard]] std::size_t in_flight() const { return flying_count_; }
  [[nodiscard]] const IdSet& allowed() const { return allowed_; }
  [[nodiscard]] const TxCounters& counters() const { return counters_; }

 private:
  struct Slot {
    Frame frame;
    Time queued{};
    bool is_waiting = false;
    bool is_in_set = false;
  };
  struct Flying {
    Frame frame;
    Time sent{};
  };

  [[nodiscard]] bool joins_set(const Frame& frame, Time now);
  void drop_set(std::uint64_t& counter);
  [[nodiscard]] Slot* first_waiting();
  void expire(Slot& slot);
  [[nodiscard]] bool hand_over(CanPort& port, Slot& slot, Time now);
  void give_up_in_flight(Time now);
  void land(std::size_t index);
  void purge();

  IdSet allowed_;
  std::vector<Slot> slots_;  // by identifier, lowest first
  std::array<std::uint16_t, kIdCount> slot_of_{};
  std::array<Flying, kWindow> flying_;  // oldest first
  std::size_t flying_count_ = 0;
  std::optional<std::uint64_t> session_;
  std::optional<Time> retry_at_;
  std::optional<Time> last_echo_;
  bool is_stalled_ = false;

  std::uint8_t set_counter_ = 0;
  std::optional<Time> set_begun_;
  bool is_set_sent_ = false;     // a frame of it
  bool is_set_dropped_ = false;  // a frame of it

  TxCounters counters_;
};

}  // namespace understory::can
