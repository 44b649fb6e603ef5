// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What the bridge flies, by its configuration. Throws ConfigError with one line that names the
// interface or the file.
#pragma once

#include <memory>

#include "understory/bridge/autopilot.hpp"
#include "understory/nodelets/flight_setup.hpp"

namespace understory {

[[nodiscard]] std::unique_ptr<Autopilot> make_autopilot(const FlightSetup& setup);

}  // namespace understory
