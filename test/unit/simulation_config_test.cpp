// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/simulation_config.hpp"

#include <filesystem>
#include <regex>

#include <gtest/gtest.h>

namespace understory {
namespace {

std::string config_folder() {
  return std::string(UNDERSTORY_SOURCE_DIR) + "/config";
}

TEST(SimulationConfig, EveryMisspeltKeyIsAnErrorThatNamesIt) {
  const SimulationConfig defaults;
  const std::string good = to_yaml(defaults);
  const std::regex key(R"(([a-z0-9_]+):)");
  int keys = 0;
  for (auto match = std::sregex_iterator(good.begin(), good.end(), key);
       match != std::sregex_iterator();
       ++match) {
    std::string bad = good;
    const auto end = static_cast<std::size_t>(match->position(1) + match->length(1));
    bad.insert(end, "x");
    SimulationConfig config;
    const std::unique_ptr<FieldVisitor> reader = config_text_reader(bad, "bad.yaml");
    try {
      visit_document(config, *reader);
      ADD_FAILURE() << (*match)[1] << " misspelt was accepted";
    } catch (const ConfigError& error) {
      const std::string what = error.what();
      EXPECT_NE(what.find(match->str(1) + "x: unknown key"), std::string::npos) << what;
    }
    ++keys;
  }
  EXPECT_GT(keys, 100);
}

TEST(SimulationConfig, EveryShippedFileLoads) {
  int files = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(config_folder())) {
    const bool is_table = entry.path().parent_path().filename() == "tables";
    const std::string name = entry.path().filename();
    const bool is_of_others = name == "latency_budget.yaml" || name == "onboard.yaml";
    if (entry.path().extension() == ".yaml" && !is_table && !is_of_others) {
      SimulationConfig config;
      EXPECT_NO_THROW(load_config_file(entry.path().string(), config)) << entry.path();
      ++files;
    }
  }
  EXPECT_GE(files, 8);
}

TEST(SimulationConfig, EmptyBoxAndMissingForestAreNamed) {
  SceneConfig scene;
  scene.box.x_max_m = scene.box.x_min_m;
  EXPECT_THROW(static_cast<void>(build_forest(scene, Rng(1))), ConfigError);

  SceneConfig no_file;
  no_file.source = "file";
  EXPECT_THROW(static_cast<void>(build_forest(no_file, Rng(1))), ConfigError);
}

}  // namespace
}  // namespace understory
