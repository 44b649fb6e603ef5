// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Command line of the simulator, and the configuration that follows from it and from config/*.yaml.
// Wrong use and wrong configuration throw with one line that names option, file or key.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "understory/sim/simulation_config.hpp"

namespace understory {

struct Options {
  std::string scenario = "small";
  std::string forest_file;
  std::string crop;
  std::string speed_cap;
  std::string strategy;
  std::string resume_file;
  std::string out_dir;
  std::uint64_t seed = 1;
  bool quiet = false;
  bool no_report = false;
  bool print_parameters = false;
};

// Nothing: the exit code says why (help was asked for, or the line was wrong and it has been said).
struct ParsedOptions {
  std::optional<Options> options;
  int exit_code = 0;
};
[[nodiscard]] ParsedOptions parse_options(int argc, char** argv);

// Defaults, then config/*.yaml, then the scenario, then the command line.
[[nodiscard]] SimulationConfig load_simulation_config(const Options& options);

// Where config/ and the report script lie: UNDERSTORY_ROOT, else beside the program's build folder.
[[nodiscard]] std::string project_root();

}  // namespace understory
