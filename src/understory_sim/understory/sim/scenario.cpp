// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/scenario.hpp"

#include <array>
#include <filesystem>
#include <sstream>

namespace understory {
namespace {

namespace fs = std::filesystem;

std::string scenario_path(const std::string& config_folder, const std::string& scenario) {
  const bool is_file =
      scenario.find('/') != std::string::npos || fs::path(scenario).extension() == ".yaml";
  if (is_file) {
    return scenario;
  }
  const fs::path folder = fs::path(config_folder) / "scenarios";
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

void apply_choice(const ScenarioChoice& choice, SimulationConfig& config) {
  if (!choice.forest_file.empty()) {
    config.scene.source = "file";
    config.scene.forest_file = choice.forest_file;
  }
  if (!choice.crop.empty()) {
    config.scene.crop = crop_from(choice.crop);
    config.scene.crop_mode = "rectangle";
  }
  // Through the reader, so that a wrong value is reported like one in a file.
  std::string overrides;
  if (!choice.speed_cap.empty()) {
    overrides += "limits: {speed_cap: " + choice.speed_cap + "}\n";
  }
  if (!choice.strategy.empty()) {
    overrides += "strategy: " + choice.strategy + "\n";
  }
  for (const std::string& text : {overrides, choice.overrides}) {
    const std::unique_ptr<FieldVisitor> reader = config_text_reader(text, "command line");
    visit_document(config, *reader);
  }
}

}  // namespace

SimulationConfig load_scenario(const std::string& config_folder, const ScenarioChoice& choice) {
  SimulationConfig config;
  for (const char* concern : {"explorer.yaml", "vehicle.yaml"}) {
    load_config_file((fs::path(config_folder) / concern).string(), config);
  }
  const fs::path settings = fs::path(config_folder) / "strategies" / (choice.strategy + ".yaml");
  if (!choice.strategy.empty() && fs::exists(settings)) {
    load_config_file(settings.string(), config);
  }
  load_config_file(scenario_path(config_folder, choice.scenario), config);
  apply_choice(choice, config);
  return config;
}

}  // namespace understory
