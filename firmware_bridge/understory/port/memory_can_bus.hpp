// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// A CAN bus in memory, with a virtual clock: frames take the bit times that they take on the wire,
// the lowest identifier among the heads of the stations' queues wins, the sender gets its echo at
// the end of the frame. Deterministic: the same calls and the same seed give the same frames at the
// same times. Time moves in advance() and step(), or in a port's wait(), which moves it for all
// stations; a station's arrival function runs at the virtual time of each arrival and may send.
// One thread. The bus outlives its ports. Allocates nothing per frame.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "understory/base/rng.hpp"
#include "understory/base/time.hpp"
#include "understory/can/id_set.hpp"
#include "understory/port/can_port.hpp"
#include "understory/port/fixed_ring.hpp"

namespace understory::can {

// Probabilities, drawn for each receiver of a frame by itself.
struct BusFaults {
  double loss = 0.0;
  double echo_loss = 0.0;  // the sender does not learn that its frame was transmitted
  double duplication = 0.0;
  double delay = 0.0;  // others overtake the frame
  Duration longest_delay = std::chrono::milliseconds(5);
  double corruption = 0.0;  // one data byte is another one, as from a faulty gateway
  IdSet dropped;            // never received, only echoed
};

// What the bus knows of a port.
struct BusStation {
  struct Queued {
    Frame frame;
    Time since{};
  };

  explicit BusStation(std::size_t hardware_queue);

  void deliver(const PortFrame& frame);
  // Everything but kUp loses what is queued and received; coming back up is a new session.
  void change_to(PortState next);

  FixedRing<Queued> to_send;
  FixedRing<PortFrame> received;
  PortState state = PortState::kUp;
  std::uint64_t session = 1;
  PortCounters counters;
  bool has_changed = false;   // since the port last waited
  bool has_arrivals = false;  // since the arrival function was called
  std::function<void()> on_arrival;
};

class MemoryCanPort;

class MemoryCanBus {
 public:
  MemoryCanBus(int bits_per_s, const Rng& rng);

  // A new station, whose controller has room for so many frames (ENOBUFS beyond).
  [[nodiscard]] std::unique_ptr<MemoryCanPort> open(std::size_t hardware_queue = 16);
  void set_faults(const BusFaults& faults) { faults_ = faults; }

  [[nodiscard]] Time now() const { return now_; }
  // When the next frame or echo arrives anywhere, if nothing else is sent until then.
  [[nodiscard]] std::optional<Time> next_arrival() const;
  // Everything that happens up to `until`, in order. Frames that are sent at the same virtual time
  // compete for the bus, so what is sent at `until` begins later.
  void advance(Time until);
  // Only the next event, if there is one up to `until`; else false, and the clock stays.
  bool step(Time until);
  // An arrival function is running: the clock stands still.
  [[nodiscard]] bool is_delivering() const { return is_delivering_; }
  // How long the bus was busy, interframe spaces included.
  [[nodiscard]] Duration busy() const { return Duration(busy_ns_ / 1000); }

 private:
  struct Transmission {
    BusStation* sender = nullptr;
    std::uint64_t session = 0;
    std::int64_t end_ns = 0;
  };
  struct Late {
    Time arrival{};
    std::uint64_t order = 0;  // of equal arrivals, the first sent is the first
    BusStation* receiver = nullptr;
    Frame frame;
  };
  [[nodiscard]] static bool is_later(const Late& left, const Late& right);

  [[nodiscard]] std::optional<std::int64_t> next_start_ns() const;
  [[nodiscard]] BusStation* winner(std::int64_t start_ns) const;
  [[nodiscard]] std::int64_t duration_ns(int bits) const;
  void begin(std::int64_t start_ns);
  void finish();
  void pass_on(const Frame& frame, BusStation& receiver);
  [[nodiscard]] Frame corrupted(Frame frame);
  void deliver_late();
  void call_stations();

  std::int64_t bits_per_s_;
  Rng loss_;
  Rng echo_loss_;
  Rng duplication_;
  Rng delay_;
  Rng corruption_;
  BusFaults faults_;
  std::vector<std::unique_ptr<BusStation>> stations_;
  std::optional<Transmission> transmission_;
  std::vector<Late> late_;  // a heap, the earliest first
  std::uint64_t late_order_ = 0;
  Time now_{};
  std::int64_t free_ns_ = 0;  // when the interframe space ends
  std::int64_t busy_ns_ = 0;
  bool is_delivering_ = false;
};

class MemoryCanPort final : public CanPort {
 public:
  MemoryCanPort(MemoryCanBus& bus, BusStation& station) : bus_(bus), station_(station) {}
  MemoryCanPort(const MemoryCanPort&) = delete;
  MemoryCanPort& operator=(const MemoryCanPort&) = delete;
  ~MemoryCanPort() override;

  [[nodiscard]] SendResult send(const Frame& frame) override;
  [[nodiscard]] std::size_t receive(PortFrame* frames, std::size_t most) override;
  // Moves the clock of the bus; returns at once in an arrival function.
  void wait(Duration at_most, WaitFor what) override;
  [[nodiscard]] Time now() const override { return bus_.now(); }
  [[nodiscard]] PortState state() const override { return station_.state; }
  [[nodiscard]] std::uint64_t session() const override { return station_.session; }
  [[nodiscard]] const PortCounters& counters() const override { return station_.counters; }

  // For tests.
  void set_state(PortState state) { station_.change_to(state); }
  // Called after frames or echoes have arrived here.
  void set_on_arrival(std::function<void()> on_arrival);

 private:
  MemoryCanBus& bus_;
  BusStation& station_;
};

}  // namespace understory::can
