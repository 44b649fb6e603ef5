// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Who may send what, and how often it is to be expected: from the DBC. Pure functions.
#pragma once

#include "understory/port/can_node.hpp"

namespace understory::can {

[[nodiscard]] CanNodeConfig host_node_config();
[[nodiscard]] CanNodeConfig vehicle_node_config();

}  // namespace understory::can
