// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/scenario.hpp"

#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "support/temporary_folder.hpp"
#include "understory/sim/forest_csv.hpp"

namespace understory {
namespace {

std::string shipped() {
  return std::string(UNDERSTORY_SOURCE_DIR) + "/config";
}

// The message with which a choice is refused.
std::string refusal_of(const std::string& folder, const ScenarioChoice& choice) {
  try {
    static_cast<void>(load_scenario(folder, choice));
  } catch (const ConfigError& error) {
    return error.what();
  }
  ADD_FAILURE() << "was accepted";
  return "";
}

bool mentions(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

// Three files that all say how fast to fly; the first two say more.
struct ConfigFolder {
  ConfigFolder() {
    std::filesystem::create_directory(folder.path_of("scenarios"));
    static_cast<void>(
        folder.write("explorer.yaml", "limits: {speed_mps: 1.1, acceleration_mps2: 1.1}\n"));
    static_cast<void>(folder.write("vehicle.yaml", "limits: {yaw_rate_radps: 0.7}\n"));
    static_cast<void>(folder.write("scenarios/glade.yaml", "limits: {speed_mps: 1.2}\n"));
    static_cast<void>(folder.write("scenarios/thicket.yaml", "limits: {speed_mps: 1.3}\n"));
  }

  TemporaryFolder folder;
};

TEST(Scenario, EveryShippedScenarioLoadsByItsName) {
  int loaded = 0;
  for (const auto& entry : std::filesystem::directory_iterator(shipped() + "/scenarios")) {
    ScenarioChoice choice;
    choice.scenario = entry.path().stem().string();
    EXPECT_EQ(load_scenario(shipped(), choice).scene.name, choice.scenario);
    ++loaded;
  }
  EXPECT_GE(loaded, 8);
}

TEST(Scenario, WhatIsChosenWinsOverTheScenarioAndThatOverTheFolder) {
  const ConfigFolder config;
  ScenarioChoice choice;
  choice.scenario = "glade";

  const LimitsConfig from_files = load_scenario(config.folder.path_of(""), choice).explorer.limits;
  choice.overrides = "limits: {speed_mps: 1.4}";
  const LimitsConfig chosen = load_scenario(config.folder.path_of(""), choice).explorer.limits;

  EXPECT_EQ(from_files.speed_mps, 1.2);
  EXPECT_EQ(from_files.acceleration_mps2, 1.1);
  EXPECT_EQ(from_files.yaw_rate_radps, 0.7);
  EXPECT_EQ(chosen.speed_mps, 1.4);
  EXPECT_EQ(chosen.acceleration_mps2, 1.1);
}

TEST(Scenario, OverridesWinOverTheOtherChoices) {
  ScenarioChoice choice;
  choice.speed_cap = "strict";
  EXPECT_EQ(load_scenario(shipped(), choice).explorer.limits.speed_cap, "strict");

  choice.overrides = "limits: {speed_cap: paper}";

  EXPECT_EQ(load_scenario(shipped(), choice).explorer.limits.speed_cap, "paper");
}

TEST(Scenario, FileIsTakenByItsPath) {
  const ConfigFolder config;
  ScenarioChoice choice;
  choice.scenario = config.folder.write("elsewhere.yaml", "limits: {speed_mps: 1.9}\n");

  EXPECT_EQ(load_scenario(config.folder.path_of(""), choice).explorer.limits.speed_mps, 1.9);
}

TEST(Scenario, UnknownNameListsThoseThereAre) {
  const ConfigFolder config;
  ScenarioChoice choice;
  choice.scenario = "jungle";

  const std::string refusal = refusal_of(config.folder.path_of(""), choice);

  EXPECT_TRUE(mentions(refusal, "jungle")) << refusal;
  EXPECT_TRUE(mentions(refusal, "glade") && mentions(refusal, "thicket")) << refusal;
}

TEST(Scenario, WrongChoicesAreNamedAsThoseOfTheCommandLine) {
  ScenarioChoice key;
  key.overrides = "limits: {sped_mps: 1.0}";
  ScenarioChoice cap;
  cap.speed_cap = "none";
  ScenarioChoice strategy;
  strategy.strategy = "greedy";
  ScenarioChoice range;
  range.overrides = "mission: {time_limit_s: -1}";

  EXPECT_TRUE(mentions(refusal_of(shipped(), key), "sped_mps"));
  EXPECT_TRUE(mentions(refusal_of(shipped(), cap), "speed_cap"));
  EXPECT_TRUE(mentions(refusal_of(shipped(), strategy), "strategy"));
  for (const ScenarioChoice& choice : {key, cap, strategy, range}) {
    EXPECT_TRUE(mentions(refusal_of(shipped(), choice), "command line"));
  }
}

TEST(Scenario, AStrategyBringsItsSettings) {
  ScenarioChoice fuel;
  fuel.strategy = "fuel";
  ScenarioChoice paper;
  paper.strategy = "paper";
  ScenarioChoice ours;
  ours.strategy = "explorer_collector";

  EXPECT_EQ(load_scenario(shipped(), fuel).explorer.strategy, "fuel");
  EXPECT_DOUBLE_EQ(load_scenario(shipped(), fuel).explorer.frontier.viewpoints.max_radius_m, 2.5);
  EXPECT_EQ(load_scenario(shipped(), paper).explorer.strategy, "paper");
  EXPECT_DOUBLE_EQ(load_scenario(shipped(), paper).explorer.explorer_collector.explorer.ring_weight,
                   0.0);
  EXPECT_GT(load_scenario(shipped(), ours).explorer.explorer_collector.explorer.ring_weight, 0.0);
}

// What a strategy brings is for all scenes; what the command line says comes last.
TEST(Scenario, OverridesAreStrongerThanAStrategysSettings) {
  ScenarioChoice choice;
  choice.strategy = "fuel";
  choice.overrides = "frontier: {seen_share: 0.9}";

  EXPECT_DOUBLE_EQ(load_scenario(shipped(), choice).explorer.frontier.seen_share, 0.9);
}

TEST(Scenario, ForestFileReplacesTheGeneratedForest) {
  ScenarioChoice choice;
  choice.forest_file = "stems.csv";

  const SceneConfig scene = load_scenario(shipped(), choice).scene;

  EXPECT_EQ(scene.source, "file");
  EXPECT_EQ(scene.forest_file, "stems.csv");
  EXPECT_EQ(scene.crop_mode, "none");
}

TEST(Scenario, CropIsTakenAsARectangle) {
  ScenarioChoice choice;
  choice.crop = "-1.5,20,30,4e1";

  const SceneConfig scene = load_scenario(shipped(), choice).scene;

  EXPECT_EQ(scene.crop_mode, "rectangle");
  EXPECT_EQ(scene.crop.x0_m, -1.5);
  EXPECT_EQ(scene.crop.y0_m, 20.0);
  EXPECT_EQ(scene.crop.width_m, 30.0);
  EXPECT_EQ(scene.crop.height_m, 40.0);
}

TEST(Scenario, CropThatIsNotFourNumbersOrTooSmallIsRefused) {
  for (const char* text : {"1",
                           "1,2,3",
                           "1,2,30,40,5",
                           "1;2;30;40",
                           "a,2,30,40",
                           "1,2,30,",
                           "1,2,1.9,40",
                           "1,2,30,-40",
                           "1,2,nan,40",
                           "1,2,30,40m",
                           ","}) {
    ScenarioChoice choice;
    choice.crop = text;
    const std::string refusal = refusal_of(shipped(), choice);
    EXPECT_TRUE(mentions(refusal, std::string("--crop ") + text)) << refusal;
  }
}

TEST(AdaptBox, BoxTakesTheSizeOfTheRectangle) {
  SceneConfig scene;
  scene.source = "file";
  scene.crop_mode = "rectangle";
  scene.crop = {100.0, 200.0, 30.0, 16.0};
  scene.box.z_max_m = 3.0;

  adapt_box(scene);

  const Box3d box_m = scene.box.box_m();
  EXPECT_EQ(box_m.min(), Vector3d(-15.0, -8.0, 0.0));
  EXPECT_EQ(box_m.max(), Vector3d(15.0, 8.0, 3.0));
}

TEST(AdaptBox, PieceFromTheMiddleKeepsTheBoxsSizeAndIsCentred) {
  SceneConfig scene;
  scene.source = "file";
  scene.crop_mode = "center";
  scene.box.x_min_m = 0.0;
  scene.box.x_max_m = 12.0;

  adapt_box(scene);

  EXPECT_EQ(scene.crop.width_m, 12.0);
  EXPECT_EQ(scene.crop.height_m, 20.0);
  EXPECT_EQ(scene.box.x_min_m, -6.0);
  EXPECT_EQ(scene.box.x_max_m, 6.0);
}

TEST(AdaptBox, OtherScenesKeepTheirBox) {
  SceneConfig whole;
  whole.source = "file";
  SceneConfig generated;
  generated.crop_mode = "rectangle";
  generated.crop = {0.0, 0.0, 5.0, 5.0};
  for (SceneConfig scene : {whole, generated}) {
    adapt_box(scene);

    EXPECT_EQ(scene.box.x_min_m, BoxConfig{}.x_min_m);
    EXPECT_EQ(scene.box.y_max_m, BoxConfig{}.y_max_m);
  }
}

TEST(AdaptBox, BuildingTheForestLeavesTheSameBox) {
  const TemporaryFolder folder;
  Forest forest;
  forest.trunks = {
      {Vector2d(3.0, 4.0), 0.2}, {Vector2d(11.0, 9.0), 0.2}, {Vector2d(7.0, 6.0), 0.1}};
  write_forest_csv(forest, folder.path_of("stems.csv"));
  for (const char* mode : {"center", "rectangle"}) {
    SceneConfig adapted;
    adapted.source = "file";
    adapted.forest_file = folder.path_of("stems.csv");
    adapted.crop_mode = mode;
    adapted.crop = {2.0, 3.0, 8.0, 6.0};
    SceneConfig built = adapted;

    adapt_box(adapted);
    static_cast<void>(build_forest(built, Rng(1)));

    EXPECT_EQ(adapted.box.box_m().min(), built.box.box_m().min()) << mode;
    EXPECT_EQ(adapted.box.box_m().max(), built.box.box_m().max()) << mode;
  }
}

}  // namespace
}  // namespace understory
