// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// A CAN interface of this machine as a port. Construction throws ConfigError in one line that names
// the interface; one that is down is no error. In flight, an interface that goes
// down, disappears or goes bus-off closes the socket; it is opened again as a new session when the
// kernel says that the interface is back, tried after 10 ms to 1 s. Nothing is ever sent again.
// Times are CLOCK_REALTIME. One thread, any. System calls: one per frame sent, one per batch
// received, and one per wait.
#pragma once

#include <cstdint>
#include <string>

#include "understory/can/id_set.hpp"
#include "understory/port/can_port.hpp"
#include "understory/port/can_socket.hpp"
#include "understory/port/interface.hpp"

namespace understory::can {

class SocketCanPort final : public CanPort {
 public:
  static constexpr Duration kFirstRetry = std::chrono::milliseconds(10);
  static constexpr Duration kLastRetry = std::chrono::seconds(1);

  // `ids`: what is received; own identifiers among them, for their echoes.
  SocketCanPort(const std::string& interface, const IdSet& ids);

  [[nodiscard]] SendResult send(const Frame& frame) override;
  [[nodiscard]] std::size_t receive(PortFrame* frames, std::size_t most) override;
  void wait(Duration at_most, WaitFor what) override;
  [[nodiscard]] Time now() const override;
  [[nodiscard]] PortState state() const override { return state_; }
  [[nodiscard]] std::uint64_t session() const override { return session_; }
  [[nodiscard]] const PortCounters& counters() const override { return counters_; }
  // Less than 2 MiB if the kernel does not allow more (net.core.rmem_max).
  [[nodiscard]] int receive_buffer_bytes() const { return socket_.receive_buffer_bytes(); }

 private:
  void lose(PortState state);
  void lose_by(int error);
  void retry_later(Time time);
  void follow_interface();
  void reopen();
  [[nodiscard]] bool sleep(Duration at_most, WaitFor what);

  InterfaceWatch interface_;
  CanSocket socket_;
  int index_ = 0;  // of the interface that the socket is bound to
  PortState state_ = PortState::kDown;
  std::uint64_t session_ = 0;
  Time opened_{};
  Time reopen_at_{};
  Duration retry_ = kFirstRetry;
  bool is_known_empty_ = false;  // the last wait has seen that nothing has arrived
  PortCounters counters_;
};

}  // namespace understory::can
