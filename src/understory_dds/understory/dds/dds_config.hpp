// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// How the vehicles of a team find each other over DDS. SI units.
#pragma once

#include <string>

#include "understory/base/config.hpp"

namespace understory::dds {

struct DdsConfig {
  int domain = 0;
  std::string team;
  std::string interface;
  bool multicast = true;
  std::string peers;
  double lease_s = 60.0;

  void visit(FieldVisitor& f) {
    f.field("domain", domain, in_range(0, 230), "DDS domain; the same for all of a team");
    f.field("team", team, Choices{}, "the same for all; vehicles with another one are not heard");
    f.field("interface",
            interface,
            Choices{},
            "network interface of the radio, as `ip link` names it; empty: the first that will do");
    f.field("multicast",
            multicast,
            "vehicles find each other by multicast; what they tell is unicast in any case");
    f.field("peers",
            peers,
            Choices{},
            "IPv4 addresses, with spaces between, where vehicles are looked for besides");
    f.field("lease_s",
            lease_s,
            in_range(1.0, 3600.0),
            "after a silence of so long a vehicle is told everything anew, not only what changed");
  }
};

}  // namespace understory::dds
