// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// The simulator's command for a team: flies, shows how far it is, writes a folder for all with one
// below it for each. Throws ConfigError, ForestError or ResultError with one line.
#pragma once

#include <functional>

#include "understory/sim/mission_run.hpp"
#include "understory/simulate/options.hpp"

namespace understory {

// What came of it; every file is written by then.
[[nodiscard]] MissionResult fly_team(const RunSetup& setup,
                                     const Options& options,
                                     const std::string& folder,
                                     const std::function<bool()>& interrupted);

}  // namespace understory
