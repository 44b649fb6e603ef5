// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/port/can_socket.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <vector>

#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <linux/errqueue.h>
#include <linux/net_tstamp.h>
#include <sys/socket.h>

namespace understory::can {
namespace {

constexpr std::size_t kBatch = 64;
constexpr std::size_t kControlBytes = 128;
constexpr int kReceiveBufferBytes = 2 * 1024 * 1024;
constexpr std::int64_t kUsPerSecond = 1'000'000;

template <class T>
int set_option(int fd, int level, int name, const T& value) {
  return ::setsockopt(fd, level, name, &value, sizeof(value)) == 0 ? 0 : errno;
}

Time to_time(const timespec& stamp) {
  return Time(Duration(stamp.tv_sec * kUsPerSecond + stamp.tv_nsec / 1000));
}

struct Notes {
  timespec stamp{};  // zero: none
  bool has_overflows = false;
  std::uint32_t overflows = 0;
};

Notes notes_of(msghdr& message) {
  Notes notes;
  for (cmsghdr* part = CMSG_FIRSTHDR(&message); part != nullptr;
       part = CMSG_NXTHDR(&message, part)) {
    if (part->cmsg_level != SOL_SOCKET) {
      continue;
    }
    // The first of SCM_TIMESTAMPING's three is the software's.
    if (part->cmsg_type == SCM_TIMESTAMPING || part->cmsg_type == SCM_TIMESTAMPNS) {
      std::memcpy(&notes.stamp, CMSG_DATA(part), sizeof(notes.stamp));
    } else if (part->cmsg_type == SO_RXQ_OVFL) {
      notes.has_overflows = true;
      std::memcpy(&notes.overflows, CMSG_DATA(part), sizeof(notes.overflows));
    }
  }
  return notes;
}

timespec clock_now() {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  return now;
}

std::vector<can_filter> filters_for(const IdSet& ids) {
  std::vector<can_filter> filters;
  // Without these flags in the mask a filter lets remote and extended frames through as well.
  const canid_t kinds = CAN_EFF_FLAG | CAN_RTR_FLAG;
  if (ids.count() > CAN_RAW_FILTER_MAX) {
    filters.push_back({0, kinds});
    return filters;
  }
  for (std::size_t id = 0; id < kIdCount; ++id) {
    if (ids[id]) {
      filters.push_back({static_cast<canid_t>(id), CAN_SFF_MASK | kinds});
    }
  }
  return filters;
}

}  // namespace

struct CanSocket::Batch {
  std::vector<can_filter> filters;
  std::array<can_frame, kBatch> frames{};
  std::array<std::array<unsigned char, kControlBytes>, kBatch> control{};
  std::array<iovec, kBatch> vectors{};
  std::array<mmsghdr, kBatch> messages{};
};

CanSocket::CanSocket(const IdSet& ids) : ids_(ids), batch_(std::make_unique<Batch>()) {
  batch_->filters = filters_for(ids);
}

CanSocket::~CanSocket() = default;

int CanSocket::open(int interface_index) {
  fd_.reset(::socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW));
  if (!fd_.is_open()) {
    return errno;
  }
  overflows_ = 0;
  int error = configure();
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = interface_index;
  if (error == 0 &&
      ::bind(fd_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    error = errno;
  }
  if (error != 0) {
    fd_.reset();
  }
  return error;
}

// Everything before bind(), so that not one frame arrives otherwise.
int CanSocket::configure() {
  const int on = 1;
  const can_err_mask_t all_errors = CAN_ERR_MASK;
  const int stamps = SOF_TIMESTAMPING_RX_SOFTWARE | SOF_TIMESTAMPING_SOFTWARE;
  set_receive_buffer();
  if (set_option(fd_.get(), SOL_SOCKET, SO_TIMESTAMPING, stamps) != 0) {
    const int error = set_option(fd_.get(), SOL_SOCKET, SO_TIMESTAMPNS, on);
    if (error != 0) {
      return error;
    }
  }
  // Without it, overflows are not told, and message counters find them.
  static_cast<void>(set_option(fd_.get(), SOL_SOCKET, SO_RXQ_OVFL, on));
  int error = set_option(fd_.get(), SOL_CAN_RAW, CAN_RAW_RECV_OWN_MSGS, on);
  error = error != 0 ? error : set_option(fd_.get(), SOL_CAN_RAW, CAN_RAW_ERR_FILTER, all_errors);
  return error != 0 ? error : set_filters();
}

void CanSocket::set_receive_buffer() {
  // The first needs CAP_NET_ADMIN, the second is limited by net.core.rmem_max.
  if (set_option(fd_.get(), SOL_SOCKET, SO_RCVBUFFORCE, kReceiveBufferBytes) != 0) {
    static_cast<void>(set_option(fd_.get(), SOL_SOCKET, SO_RCVBUF, kReceiveBufferBytes));
  }
  socklen_t size = sizeof(receive_buffer_bytes_);
  static_cast<void>(::getsockopt(fd_.get(), SOL_SOCKET, SO_RCVBUF, &receive_buffer_bytes_, &size));
}

int CanSocket::set_filters() {
  const std::vector<can_filter>& filters = batch_->filters;
  const auto size = static_cast<socklen_t>(filters.size() * sizeof(can_filter));
  return ::setsockopt(fd_.get(), SOL_CAN_RAW, CAN_RAW_FILTER, filters.data(), size) == 0 ? 0
                                                                                         : errno;
}

int CanSocket::send(const Frame& frame) {
  can_frame raw{};
  raw.can_id = frame.id;
  raw.can_dlc = frame.length;
  std::copy(frame.data.begin(), frame.data.end(), raw.data);
  ssize_t written = -1;
  do {
    written = ::write(fd_.get(), &raw, sizeof(raw));
  } while (written < 0 && errno == EINTR);
  return written == static_cast<ssize_t>(sizeof(raw)) ? 0 : errno;
}

CanSocket::Arrivals CanSocket::receive(PortFrame* frames,
                                       std::size_t most,
                                       PortCounters& counters) {
  Arrivals arrivals;
  const auto room = static_cast<unsigned>(std::min(most, kBatch));
  for (std::size_t i = 0; i < room; ++i) {
    batch_->vectors[i] = {&batch_->frames[i], sizeof(can_frame)};
    msghdr& header = batch_->messages[i].msg_hdr;
    header = {};
    header.msg_iov = &batch_->vectors[i];
    header.msg_iovlen = 1;
    header.msg_control = batch_->control[i].data();
    header.msg_controllen = kControlBytes;
  }
  const int got = ::recvmmsg(fd_.get(), batch_->messages.data(), room, MSG_DONTWAIT, nullptr);
  if (got < 0) {
    arrivals.error = errno == EAGAIN || errno == EINTR ? 0 : errno;
    return arrivals;
  }
  for (std::size_t i = 0; i < static_cast<std::size_t>(got); ++i) {
    msghdr& header = batch_->messages[i].msg_hdr;
    const can_frame& raw = batch_->frames[i];
    const Notes notes = notes_of(header);
    if (notes.has_overflows) {
      counters.overflows += notes.overflows - overflows_;
      overflows_ = notes.overflows;
    }
    if ((raw.can_id & CAN_ERR_FLAG) != 0) {
      ++counters.error_frames;
      arrivals.is_bus_off = arrivals.is_bus_off || (raw.can_id & CAN_ERR_BUSOFF) != 0;
      continue;
    }
    if (batch_->messages[i].msg_len != sizeof(can_frame) || raw.can_dlc > CAN_MAX_DLEN ||
        (raw.can_id & (CAN_EFF_FLAG | CAN_RTR_FLAG)) != 0 || !ids_[raw.can_id & CAN_SFF_MASK]) {
      ++counters.ignored;
      continue;
    }
    PortFrame& frame = frames[arrivals.count++];
    frame.frame.id = static_cast<std::uint16_t>(raw.can_id & CAN_SFF_MASK);
    frame.frame.length = raw.can_dlc;
    std::copy(std::begin(raw.data), std::end(raw.data), frame.frame.data.begin());
    frame.stamp = to_time(notes.stamp.tv_sec != 0 ? notes.stamp : clock_now());
    frame.is_own = (header.msg_flags & MSG_CONFIRM) != 0;
    counters.received += frame.is_own ? 0 : 1;
  }
  return arrivals;
}

int CanSocket::pending_error() {
  int error = 0;
  socklen_t size = sizeof(error);
  return ::getsockopt(fd_.get(), SOL_SOCKET, SO_ERROR, &error, &size) == 0 ? error : errno;
}

}  // namespace understory::can
