// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Which bus the bridge flies over: the section bus of config/onboard.yaml. Checked at start.
#pragma once

#include <string>

#include "understory/link/host_station.hpp"

namespace understory {

struct BusConfig {
  std::string interface = "memory";
  bool auto_arm = true;
  double arming_patience_s = 20.0;
  std::string log_file;
  can::HostStationConfig link;

  void visit(FieldVisitor& f) {
    f.field("interface",
            interface,
            {},
            "a CAN interface such as can0; memory: a simulated vehicle within the process");
    f.field("auto_arm", auto_arm, "arm once all conditions hold; false: only when asked to");
    f.field("arming_patience_s",
            arming_patience_s,
            in_range(1.0, 3600.0),
            "with auto_arm, not armed for so long ends the mission");
    f.field("log_file", log_file, {}, "every frame, as candump -l writes it; empty: none");
    f.section("link", link, "When silence counts.");
  }
};

}  // namespace understory
