// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// The configuration of a flight: defaults, then config/*.yaml, then the scenario, then what the
// user chose. Both hosts load it here, so that they fly the same. Throws ConfigError with one line
// that names option, file or key.
#pragma once

#include <string>

#include "understory/sim/simulation_config.hpp"

namespace understory {

// Empty: as the files have it.
struct ScenarioChoice {
  std::string scenario = "small";  // a name in config/scenarios, or a YAML file
  std::string forest_file;
  std::string crop;  // "X0,Y0,W,H", metres
  std::string speed_cap;
  std::string strategy;
  std::string overrides;  // YAML, over all else
};

[[nodiscard]] SimulationConfig load_scenario(const std::string& config_folder,
                                             const ScenarioChoice& choice);

}  // namespace understory
