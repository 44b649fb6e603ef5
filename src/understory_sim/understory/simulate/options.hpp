// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Command line of the simulator. Wrong use is said in one line that names the option.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "understory/sim/scenario.hpp"

namespace understory {

struct Options {
  ScenarioChoice choice;
  std::string resume_file;
  std::string out_dir;
  std::string bus_log;
  std::uint64_t seed = 1;
  int team = 0;  // 0: as the configuration has it
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

// Where config/ and the report script lie: UNDERSTORY_ROOT, else beside the program's build folder.
[[nodiscard]] std::string project_root();

}  // namespace understory
