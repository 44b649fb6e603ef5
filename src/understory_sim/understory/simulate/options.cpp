// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/simulate/options.hpp"

#include <cstdlib>
#include <filesystem>

#include <CLI/CLI.hpp>

namespace understory {

namespace fs = std::filesystem;

std::string project_root() {
  if (const char* root = std::getenv("UNDERSTORY_ROOT")) {
    return root;
  }
  // ROOT/build/src/understory_sim/understory_simulate
  std::error_code ignored;
  const fs::path program = fs::read_symlink("/proc/self/exe", ignored);
  for (fs::path folder = program.parent_path(); folder.has_relative_path();
       folder = folder.parent_path()) {
    if (fs::exists(folder / "config" / "scenarios", ignored)) {
      return folder.string();
    }
    const fs::path installed = folder / "share" / "understory_config";
    if (fs::exists(installed / "config" / "scenarios", ignored)) {
      return installed.string();
    }
  }
  throw ConfigError("config/scenarios: not found; set UNDERSTORY_ROOT to the project's folder");
}

ParsedOptions parse_options(int argc, char** argv) {
  Options options;
  CLI::App app(
      "Flies one exploration mission in the lockstep simulator and writes its result folder.",
      "understory simulate");
  app.add_option("--scenario", options.choice.scenario, "name in config/scenarios, or a YAML file")
      ->capture_default_str();
  app.add_option(
      "--forest", options.choice.forest_file, "stem map (CSV) instead of the scenario's forest");
  app.add_option(
      "--crop", options.choice.crop, "X0,Y0,W,H: the piece of the stem map to fly, metres");
  app.add_option("--seed", options.seed, "of everything random")->capture_default_str();
  app.add_option(
      "--strategy",
      options.choice.strategy,
      "how targets are chosen, a name in config/strategies (default: explorer_collector)");
  app.add_option("--speed-cap", options.choice.speed_cap, "paper or strict");
  app.add_option("--set",
                 options.choice.overrides,
                 "configuration (YAML) over that of all files, as 'camera: {rate_hz: 10}'");
  app.add_option("--team", options.team, "so many vehicles share the work")
      ->check(CLI::Range(1, 32));
  app.add_option("--resume", options.resume_file, "go on from a saved map (.ot, .bt)");
  app.add_option("--out", options.out_dir, "result folder (default: results/SCENARIO_SEED)");
  app.add_option("--bus-log",
                 options.bus_log,
                 "every frame between host and vehicle, as candump -l writes it");
  app.add_flag("--quiet", options.quiet, "no live line");
  app.add_flag("--no-report", options.no_report, "no figures and report.html");
  app.add_flag("--print-parameters",
               options.print_parameters,
               "print every configuration key as Markdown and exit");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const int code = app.exit(error);
    return {std::nullopt, code == 0 ? 0 : 2};
  }
  return {options, 0};
}

}  // namespace understory
