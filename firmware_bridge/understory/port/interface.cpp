// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/port/interface.hpp"

#include <array>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <utility>

#include <linux/netlink.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include "understory/base/config.hpp"

namespace understory::can {
namespace {

// <linux/if_arp.h> and <linux/if.h>, which cannot be included together with <net/if.h>.
constexpr unsigned kHardwareCan = 280;
constexpr unsigned kLowerUp = 1U << 16U;
constexpr std::size_t kAnswerBytes = 16384;

using Bytes = std::array<unsigned char, kAnswerBytes>;

template <class T>
T read_as(const unsigned char* bytes) {
  T value{};
  std::memcpy(&value, bytes, sizeof(value));
  return value;
}

UniqueFd netlink_socket(std::uint32_t groups) {
  UniqueFd fd(::socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_ROUTE));
  sockaddr_nl address{};
  address.nl_family = AF_NETLINK;
  address.nl_groups = groups;
  if (fd.is_open() &&
      ::bind(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    fd.reset();
  }
  return fd;
}

// "get link" of this name.
bool ask(int fd, const std::string& name) {
  std::array<unsigned char, NLMSG_SPACE(sizeof(ifinfomsg)) + RTA_SPACE(IFNAMSIZ)> request{};
  rtattr attribute{};
  attribute.rta_type = IFLA_IFNAME;
  attribute.rta_len = static_cast<unsigned short>(RTA_LENGTH(name.size() + 1));
  nlmsghdr header{};
  header.nlmsg_len =
      static_cast<std::uint32_t>(NLMSG_SPACE(sizeof(ifinfomsg)) + RTA_ALIGN(attribute.rta_len));
  header.nlmsg_type = RTM_GETLINK;
  header.nlmsg_flags = NLM_F_REQUEST;
  std::memcpy(request.data(), &header, sizeof(header));
  unsigned char* const at = request.data() + NLMSG_SPACE(sizeof(ifinfomsg));
  std::memcpy(at, &attribute, sizeof(attribute));
  std::memcpy(at + RTA_LENGTH(0), name.c_str(), name.size() + 1);
  return ::send(fd, request.data(), header.nlmsg_len, 0) == static_cast<ssize_t>(header.nlmsg_len);
}

// The answer: RTM_NEWLINK with its ifinfomsg, then attributes.
std::optional<Interface> parse_link(const Bytes& bytes, std::size_t size) {
  if (size < NLMSG_SPACE(sizeof(ifinfomsg))) {
    return std::nullopt;
  }
  const auto header = read_as<nlmsghdr>(bytes.data());
  if (header.nlmsg_type != RTM_NEWLINK || header.nlmsg_len > size) {
    return std::nullopt;
  }
  const auto info = read_as<ifinfomsg>(bytes.data() + NLMSG_HDRLEN);
  Interface found;
  found.index = info.ifi_index;
  found.is_can = info.ifi_type == kHardwareCan;
  found.is_up = (info.ifi_flags & IFF_UP) != 0;
  found.has_carrier = (info.ifi_flags & kLowerUp) != 0;
  std::size_t at = NLMSG_SPACE(sizeof(ifinfomsg));
  while (at + sizeof(rtattr) <= header.nlmsg_len) {
    const auto attribute = read_as<rtattr>(bytes.data() + at);
    if (attribute.rta_len < sizeof(rtattr) || at + attribute.rta_len > header.nlmsg_len) {
      break;
    }
    if (attribute.rta_type == IFLA_MTU && attribute.rta_len >= RTA_LENGTH(sizeof(std::uint32_t))) {
      found.mtu = static_cast<int>(read_as<std::uint32_t>(bytes.data() + at + RTA_LENGTH(0)));
    }
    at += RTA_ALIGN(attribute.rta_len);
  }
  return found;
}

}  // namespace

std::vector<std::string> can_interfaces() {
  std::vector<std::string> names;
  const UniqueFd fd(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  struct if_nameindex* const all = ::if_nameindex();
  for (const struct if_nameindex* one = all; one != nullptr && one->if_index != 0; ++one) {
    ifreq request{};
    std::strncpy(request.ifr_name, one->if_name, IFNAMSIZ - 1);
    if (fd.is_open() && ::ioctl(fd.get(), SIOCGIFHWADDR, &request) == 0 &&
        request.ifr_hwaddr.sa_family == kHardwareCan) {
      names.emplace_back(one->if_name);
    }
  }
  if (all != nullptr) {
    ::if_freenameindex(all);
  }
  return names;
}

InterfaceWatch::InterfaceWatch(std::string name)
    : name_(std::move(name)), events_(netlink_socket(RTMGRP_LINK)), questions_(netlink_socket(0)) {
  if (name_.empty() || name_.size() >= IFNAMSIZ) {
    throw ConfigError("CAN interface '" + name_ + "': a name has 1 to 15 characters");
  }
  if (!events_.is_open() || !questions_.is_open()) {
    throw ConfigError("CAN interface '" + name_ + "': cannot watch it: " + std::strerror(errno));
  }
}

void InterfaceWatch::forget_events() {
  Bytes bytes;
  // Also an error (too many events to keep) only says that something has changed.
  ssize_t received = 1;
  while (received > 0 || (received < 0 && errno == ENOBUFS)) {
    received = ::recv(events_.get(), bytes.data(), bytes.size(), MSG_DONTWAIT);
  }
}

std::optional<Interface> InterfaceWatch::look() const {
  if (!ask(questions_.get(), name_)) {
    return std::nullopt;
  }
  Bytes bytes;
  const ssize_t size = ::recv(questions_.get(), bytes.data(), bytes.size(), 0);
  return size > 0 ? parse_link(bytes, static_cast<std::size_t>(size)) : std::nullopt;
}

}  // namespace understory::can
