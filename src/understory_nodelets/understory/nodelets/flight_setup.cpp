// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/nodelets/flight_setup.hpp"

#include <cstdlib>
#include <filesystem>

#include <ros/package.h>

#include "understory/sim/scenario.hpp"

namespace understory {
namespace {

namespace fs = std::filesystem;

std::string text_parameter(const ros::NodeHandle& nh, const std::string& name) {
  std::string value;
  if (nh.hasParam(name) && !nh.getParam(name, value)) {
    throw ConfigError("parameter " + nh.resolveName(name) + ": must be text");
  }
  return value;
}

std::uint64_t seed_parameter(const ros::NodeHandle& nh) {
  int seed = 1;
  if (nh.hasParam("seed") && (!nh.getParam("seed", seed) || seed < 0)) {
    throw ConfigError("parameter " + nh.resolveName("seed") +
                      ": must be a whole number, 0 or more");
  }
  return static_cast<std::uint64_t>(seed);
}

// In an install space the folder lies within the package's share, in the project it is the package.
std::string find_config_folder(const ros::NodeHandle& nh) {
  std::string given = text_parameter(nh, "config_folder");
  if (!given.empty()) {
    return given;
  }
  if (const char* root = std::getenv("UNDERSTORY_ROOT")) {
    return (fs::path(root) / "config").string();
  }
  const fs::path package(ros::package::getPath("understory_config"));
  if (package.empty()) {
    throw ConfigError("package understory_config: not found; set parameter config_folder");
  }
  const fs::path installed = package / "config";
  return (fs::exists(installed) ? installed : package).string();
}

}  // namespace

FlightSetup load_flight_setup(const ros::NodeHandle& nh) {
  const std::string config_folder = find_config_folder(nh);
  ScenarioChoice choice;
  const std::string scenario = text_parameter(nh, "scenario");
  choice.scenario = scenario.empty() ? choice.scenario : scenario;
  choice.forest_file = text_parameter(nh, "forest");
  choice.crop = text_parameter(nh, "crop");
  choice.strategy = text_parameter(nh, "strategy");
  choice.speed_cap = text_parameter(nh, "speed_cap");
  choice.overrides = text_parameter(nh, "overrides");

  FlightSetup setup;
  setup.config = load_scenario(config_folder, choice);
  load_config_file((fs::path(config_folder) / "onboard.yaml").string(), setup.onboard);
  const std::unique_ptr<FieldVisitor> overrides =
      config_text_reader(text_parameter(nh, "onboard_overrides"), "onboard_overrides");
  visit_document(setup.onboard, *overrides);
  const std::string prefix = text_parameter(nh, "frame_prefix");
  setup.onboard.frames.body.insert(0, prefix);
  setup.onboard.frames.camera.insert(0, prefix);
  setup.seed = seed_parameter(nh);
  setup.resume_file = text_parameter(nh, "resume");
  adapt_box(setup.config.scene);
  return setup;
}

}  // namespace understory
