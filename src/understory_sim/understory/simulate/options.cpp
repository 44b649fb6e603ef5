// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/simulate/options.hpp"

#include <array>
#include <cstdlib>
#include <filesystem>

#include <CLI/CLI.hpp>

namespace understory {
namespace {

namespace fs = std::filesystem;

std::string scenario_path(const std::string& scenario) {
  const bool is_file =
      scenario.find('/') != std::string::npos || fs::path(scenario).extension() == ".yaml";
  if (is_file) {
    return scenario;
  }
  const fs::path folder = fs::path(project_root()) / "config" / "scenarios";
  const fs::path path = folder / (scenario + ".yaml");
  if (!fs::exists(path)) {
    std::string names;
    std::error_code ignored;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder, ignored)) {
      names += (names.empty() ? "" : ", ") + entry.path().stem().string();
    }
    throw ConfigError("--scenario " + scenario + ": no such scenario; there are: " + names);
  }
  return path.string();
}

CropConfig crop_from(const std::string& text) {
  CropConfig crop;
  std::array<double*, 4> fields{&crop.x0_m, &crop.y0_m, &crop.width_m, &crop.height_m};
  std::istringstream stream(text);
  for (std::size_t i = 0; i < fields.size(); ++i) {
    char comma = ',';
    if ((i > 0 && !(stream >> comma)) || comma != ',' || !(stream >> *fields[i])) {
      throw ConfigError("--crop " + text + ": expected X0,Y0,W,H in metres");
    }
  }
  std::string rest;
  if (stream >> rest || !(crop.width_m >= 2.0) || !(crop.height_m >= 2.0)) {
    throw ConfigError("--crop " + text + ": expected X0,Y0,W,H in metres, W and H at least 2");
  }
  return crop;
}

void apply_command_line(const Options& options, SimulationConfig& config) {
  if (!options.forest_file.empty()) {
    config.scene.source = "file";
    config.scene.forest_file = options.forest_file;
  }
  if (!options.crop.empty()) {
    config.scene.crop = crop_from(options.crop);
    config.scene.crop_mode = "rectangle";
  }
  // Through the reader, so that a wrong value is reported like one in a file.
  std::string overrides;
  if (!options.speed_cap.empty()) {
    overrides += "limits: {speed_cap: " + options.speed_cap + "}\n";
  }
  if (!options.strategy.empty()) {
    overrides += "strategy: " + options.strategy + "\n";
  }
  const std::unique_ptr<FieldVisitor> reader = config_text_reader(overrides, "command line");
  visit_document(config, *reader);
}

}  // namespace

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
  app.add_option("--scenario", options.scenario, "name in config/scenarios, or a YAML file")
      ->capture_default_str();
  app.add_option(
      "--forest", options.forest_file, "stem map (CSV) instead of the scenario's forest");
  app.add_option("--crop", options.crop, "X0,Y0,W,H: the piece of the stem map to fly, metres");
  app.add_option("--seed", options.seed, "of everything random")->capture_default_str();
  app.add_option("--strategy", options.strategy, "how targets are chosen (explorer_collector)");
  app.add_option("--speed-cap", options.speed_cap, "paper or strict");
  app.add_option("--resume", options.resume_file, "go on from a saved map (.ot, .bt)");
  app.add_option("--out", options.out_dir, "result folder (default: results/SCENARIO_SEED)");
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

SimulationConfig load_simulation_config(const Options& options) {
  SimulationConfig config;
  const fs::path folder = fs::path(project_root()) / "config";
  for (const char* concern : {"explorer.yaml", "vehicle.yaml"}) {
    load_config_file((folder / concern).string(), config);
  }
  load_config_file(scenario_path(options.scenario), config);
  apply_command_line(options, config);
  return config;
}

}  // namespace understory
