// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/port/can_port.hpp"

namespace understory::can {

const char* to_string(PortState state) {
  switch (state) {
    case PortState::kUp:
      return "up";
    case PortState::kDown:
      return "interface down";
    case PortState::kGone:
      return "interface gone";
    case PortState::kBusOff:
      return "bus-off";
  }
  return "unknown";
}

}  // namespace understory::can
