// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/port/socket_can_port.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>

#include <linux/can.h>
#include <poll.h>
#include <sys/socket.h>

#include "understory/base/config.hpp"

namespace understory::can {
namespace {

constexpr std::int64_t kUsPerSecond = 1'000'000;

std::string list_of_interfaces() {
  std::string list;
  for (const std::string& name : can_interfaces()) {
    list += (list.empty() ? "" : ", ") + name;
  }
  return list.empty() ? "there is no CAN interface" : "CAN interfaces: " + list;
}

[[noreturn]] void refuse(const std::string& interface, const std::string& reason) {
  throw ConfigError("CAN interface '" + interface + "': " + reason);
}

[[noreturn]] void refuse_socket(const std::string& interface, int error) {
  if (error == EAFNOSUPPORT || error == EPROTONOSUPPORT || error == ESOCKTNOSUPPORT) {
    refuse(interface, "this kernel has no CAN; `understory hil` gives a bus");
  }
  if (error == EPERM || error == EACCES) {
    refuse(interface, "no permission to open a CAN socket");
  }
  refuse(interface, std::string("cannot be opened: ") + std::strerror(error));
}

void check_kernel(const std::string& interface) {
  const UniqueFd fd(::socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC, CAN_RAW));
  if (!fd.is_open()) {
    refuse_socket(interface, errno);
  }
}

void check_interface(const std::string& name, const std::optional<Interface>& found) {
  if (!found) {
    refuse(name, "does not exist; " + list_of_interfaces());
  }
  if (!found->is_can) {
    refuse(name, "is not a CAN interface; " + list_of_interfaces());
  }
  // One for CAN FD carries classic frames too.
  if (found->mtu < static_cast<int>(CAN_MTU)) {
    refuse(name,
           "its MTU is " + std::to_string(found->mtu) + ", a classic frame needs " +
               std::to_string(CAN_MTU));
  }
}

PortState state_of(const std::optional<Interface>& found) {
  if (!found || !found->is_can || found->mtu < static_cast<int>(CAN_MTU)) {
    return PortState::kGone;
  }
  if (!found->is_up) {
    return PortState::kDown;
  }
  return found->has_carrier ? PortState::kUp : PortState::kBusOff;
}

}  // namespace

SocketCanPort::SocketCanPort(const std::string& interface, const IdSet& ids)
    : interface_(interface), socket_(ids) {
  check_kernel(interface);
  const std::optional<Interface> found = interface_.look();
  check_interface(interface, found);
  // Also one that is down, to see now what would be refused then.
  const int error = socket_.open(found->index);
  if (error != 0) {
    refuse_socket(interface, error);
  }
  state_ = state_of(found);
  session_ = 1;
  index_ = found->index;
  opened_ = now();
  if (state_ != PortState::kUp) {
    socket_.close();
    retry_later(opened_);
  }
}

Time SocketCanPort::now() const {
  timespec time{};
  clock_gettime(CLOCK_REALTIME, &time);
  return Time(Duration(time.tv_sec * kUsPerSecond + time.tv_nsec / 1000));
}

// What is queued in the socket goes with it; the interface's own queue is the kernel's to purge.
void SocketCanPort::lose(PortState state) {
  const Time lost = now();
  socket_.close();
  state_ = state;
  // Only a session that has lasted begins the back-off anew.
  if (lost - opened_ >= kLastRetry) {
    retry_ = kFirstRetry;
  }
  retry_later(lost);
}

void SocketCanPort::retry_later(Time time) {
  reopen_at_ = time + retry_;
  retry_ = std::min(2 * retry_, kLastRetry);
}

void SocketCanPort::lose_by(int error) {
  lose(error == ENETDOWN ? PortState::kDown : PortState::kGone);
}

void SocketCanPort::follow_interface() {
  interface_.forget_events();
  if (!socket_.is_open()) {
    reopen();  // a change is worth a try before its time
    return;
  }
  const std::optional<Interface> found = interface_.look();
  const PortState state = state_of(found);
  if (state != PortState::kUp) {
    lose(state);
  } else if (found->index != index_) {
    lose(PortState::kGone);
  }
}

void SocketCanPort::reopen() {
  const std::optional<Interface> found = interface_.look();
  const Time time = now();
  state_ = state_of(found);
  if (state_ == PortState::kUp && socket_.open(found->index) != 0) {
    state_ = PortState::kGone;
  }
  if (state_ != PortState::kUp) {
    retry_later(time);
    return;
  }
  index_ = found->index;
  opened_ = time;
  ++session_;
  ++counters_.reopened;
}

SendResult SocketCanPort::send(const Frame& frame) {
  if (!socket_.is_open()) {
    return SendResult::kDown;
  }
  const int error = socket_.send(frame);
  if (error == 0) {
    ++counters_.sent;
    return SendResult::kSent;
  }
  if (error == ENOBUFS || error == EAGAIN) {
    ++counters_.full;
    return SendResult::kFull;
  }
  lose_by(error);
  return SendResult::kDown;
}

std::size_t SocketCanPort::receive(PortFrame* frames, std::size_t most) {
  if (!socket_.is_open() || is_known_empty_) {
    is_known_empty_ = false;
    return 0;
  }
  const CanSocket::Arrivals arrivals = socket_.receive(frames, most, counters_);
  if (arrivals.error != 0) {
    lose_by(arrivals.error);
  } else if (arrivals.is_bus_off) {
    lose(PortState::kBusOff);
  }
  return arrivals.count;
}

void SocketCanPort::wait(Duration at_most, WaitFor what) {
  const bool has_news =
      sleep(socket_.is_open() ? at_most : std::min(at_most, reopen_at_ - now()), what);
  if (!has_news && !socket_.is_open() && now() >= reopen_at_) {
    reopen();
  }
}

// True: something has arrived or changed.
bool SocketCanPort::sleep(Duration at_most, WaitFor what) {
  const bool is_listening = what == WaitFor::kArrivals && socket_.is_open();
  std::array<pollfd, 2> files{{{interface_.fd(), POLLIN, 0}, {socket_.fd(), POLLIN, 0}}};
  const std::int64_t us = std::max<std::int64_t>(0, at_most.count());
  const timespec left{static_cast<time_t>(us / kUsPerSecond),
                      static_cast<long>(us % kUsPerSecond * 1000)};
  const int count = ::ppoll(files.data(), is_listening ? 2 : 1, &left, nullptr);
  const bool has_arrivals = count > 0 && files[1].revents != 0;
  is_known_empty_ = is_listening && count >= 0 && !has_arrivals;
  if (count > 0 && files[0].revents != 0) {
    follow_interface();
  }
  if (has_arrivals && socket_.is_open() && (files[1].revents & POLLERR) != 0) {
    const int error = socket_.pending_error();
    if (error != 0) {
      lose_by(error);
    }
  }
  return count > 0;
}

}  // namespace understory::can
