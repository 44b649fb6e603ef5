// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// A raw CAN socket (SocketCAN): classic frames of listed identifiers with the kernel's stamps, own
// echoes and error frames. Knows nothing of interfaces that come and go. Never blocks, throws or
// allocates after construction; errors are errno values, 0 for none. One thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "understory/can/id_set.hpp"
#include "understory/port/can_port.hpp"
#include "understory/port/unique_fd.hpp"

namespace understory::can {

class CanSocket {
 public:
  struct Arrivals {
    std::size_t count = 0;
    int error = 0;
    bool is_bus_off = false;  // told by an error frame
  };

  // Own identifiers must be among `ids`, or their echoes are filtered as well.
  explicit CanSocket(const IdSet& ids);
  CanSocket(const CanSocket&) = delete;
  CanSocket& operator=(const CanSocket&) = delete;
  ~CanSocket();

  [[nodiscard]] int open(int interface_index);
  void close() { fd_.reset(); }
  [[nodiscard]] bool is_open() const { return fd_.is_open(); }
  [[nodiscard]] int fd() const { return fd_.get(); }
  // The kernel may give less than asked for.
  [[nodiscard]] int receive_buffer_bytes() const { return receive_buffer_bytes_; }

  [[nodiscard]] int send(const Frame& frame);
  [[nodiscard]] Arrivals receive(PortFrame* frames, std::size_t most, PortCounters& counters);
  // What went wrong since the last call.
  [[nodiscard]] int pending_error();

 private:
  struct Batch;

  [[nodiscard]] int configure();
  void set_receive_buffer();
  [[nodiscard]] int set_filters();

  IdSet ids_;
  UniqueFd fd_;
  std::unique_ptr<Batch> batch_;
  std::uint32_t overflows_ = 0;  // of this socket, as the kernel counts
  int receive_buffer_bytes_ = 0;
};

}  // namespace understory::can
