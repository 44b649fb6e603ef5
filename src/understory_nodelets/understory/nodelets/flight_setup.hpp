// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What all nodelets of a vehicle have in common, from parameters of its namespace: config_folder,
// scenario, forest, crop, seed, strategy, speed_cap, overrides (YAML for the scenario's keys),
// onboard_overrides (for config/onboard.yaml), frame_prefix, resume. Throws ConfigError with one
// line that names parameter, file or key.
#pragma once

#include <cstdint>
#include <string>

#include <ros/node_handle.h>

#include "understory/nodelets/onboard_config.hpp"
#include "understory/sim/simulation_config.hpp"

namespace understory {

struct FlightSetup {
  SimulationConfig config;
  OnboardConfig onboard;
  std::uint64_t seed = 1;
  std::string resume_file;
};

// `nh` is of the vehicle's namespace.
[[nodiscard]] FlightSetup load_flight_setup(const ros::NodeHandle& nh);

}  // namespace understory
