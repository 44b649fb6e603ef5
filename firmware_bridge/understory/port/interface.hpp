// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What the kernel knows of a network interface, and notice of changes, by rtnetlink(7). Needs no
// privileges. Nothing here waits longer than the kernel takes to answer. One thread.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "understory/port/unique_fd.hpp"

namespace understory::can {

struct Interface {
  int index = 0;  // another one whenever the interface is created anew
  bool is_can = false;
  int mtu = 0;
  bool is_up = false;
  bool has_carrier = false;  // a CAN controller has none in bus-off
};

[[nodiscard]] std::vector<std::string> can_interfaces();

class InterfaceWatch {
 public:
  // Throws ConfigError if the kernel does not let us watch.
  explicit InterfaceWatch(std::string name);

  // Readable when an interface has changed, this one or another.
  [[nodiscard]] int fd() const { return events_.get(); }
  void forget_events();
  // Nothing: there is none of that name.
  [[nodiscard]] std::optional<Interface> look() const;

 private:
  std::string name_;
  UniqueFd events_;
  UniqueFd questions_;
};

}  // namespace understory::can
