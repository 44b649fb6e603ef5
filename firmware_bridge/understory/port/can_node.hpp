// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// One station on the bus: its port, its transmit queue and its protection from floods. Protocol
// code gets the frames of others and the echoes of its own, and puts frames into send(); they leave
// after the batch that is being handled. Nothing here throws or allocates after construction, and
// only run_until() waits. One thread.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "understory/base/time.hpp"
#include "understory/can/id_set.hpp"
#include "understory/port/can_port.hpp"
#include "understory/port/flood_guard.hpp"
#include "understory/port/tx_queue.hpp"

namespace understory::can {

class FrameHandler {
 public:
  FrameHandler() = default;
  FrameHandler(const FrameHandler&) = delete;
  FrameHandler& operator=(const FrameHandler&) = delete;
  virtual ~FrameHandler() = default;

  // Of another station.
  virtual void on_frame(const PortFrame& frame) = 0;
  // Of this station: sent at `frame.stamp`.
  virtual void on_echo(const PortFrame& frame) { static_cast<void>(frame); }
};

// Sees everything that the port gives, before anything is judged or dropped.
class FrameTap {
 public:
  FrameTap() = default;
  FrameTap(const FrameTap&) = delete;
  FrameTap& operator=(const FrameTap&) = delete;
  virtual ~FrameTap() = default;

  virtual void on_port_frame(const PortFrame& frame) = 0;
};

struct CanNodeConfig {
  IdSet transmits;                    // the only identifiers that may be sent
  IdSet set;                          // of these, the ones that are only of use together
  std::vector<NominalRate> receives;  // what others send to us
  // Whether frames are answered, and so must be handled as they come. Where not, they are handled
  // together at the end of run_until(), while nothing of this station's own is on its way: a
  // wake-up for each of them would cost more than all the rest. Their stamps are the kernel's
  // either way.
  bool answers = true;
};

struct CanNodeCounters {
  std::uint64_t received = 0;         // passed on
  std::uint64_t unlisted = 0;         // identifiers that are not for us
  std::uint64_t flooded = 0;          // dropped, because there were too many
  std::uint64_t foreign_own_ids = 0;  // ours, sent by another: a second host on this bus
};

class CanNode : public FrameSink {
 public:
  static constexpr Duration kFloodHold = std::chrono::milliseconds(500);

  CanNode(std::unique_ptr<CanPort> port, const CanNodeConfig& config);

  void set_tap(std::shared_ptr<FrameTap> tap) { tap_ = std::move(tap); }

  void send(const Frame& frame, Time now) override { queue_.push(frame, now); }
  // Handles what has arrived and sends what may be sent, until `until`. Earlier if the clock is set
  // back: `until` means nothing then.
  void run_until(Time now, Time until, FrameHandler& handler);
  // The same once, without waiting. Returns the time.
  Time poll(FrameHandler& handler);
  // When it was last handled; costs no system call.
  [[nodiscard]] Time now() const { return now_; }

  // Frames were dropped in the last kFloodHold.
  [[nodiscard]] bool is_flooded() const;
  [[nodiscard]] bool is_stalled() const { return queue_.is_stalled(); }
  [[nodiscard]] const CanNodeCounters& counters() const { return counters_; }
  [[nodiscard]] const CanPort& port() const { return *port_; }
  [[nodiscard]] const TxQueue& queue() const { return queue_; }

 private:
  static constexpr std::size_t kBatch = 64;
  static constexpr int kMostBatches = 16;

  void handle(const PortFrame& frame, FrameHandler& handler);

  std::unique_ptr<CanPort> port_;
  TxQueue queue_;
  FloodGuard guard_;
  bool answers_;
  std::shared_ptr<FrameTap> tap_;
  std::array<PortFrame, kBatch> batch_;
  Time now_{};
  std::optional<Time> last_flood_;
  CanNodeCounters counters_;
};

}  // namespace understory::can
