// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Whole missions of teams in lockstep: they share the work, stay apart, and get along with radios
// and vehicles that fail.
#include <fstream>
#include <sstream>

#include <gtest/gtest.h>

#include "support/temporary_folder.hpp"
#include "understory/sim/team_run.hpp"
#include "understory/team/fused_map.hpp"

namespace understory {
namespace {

SimulationConfig team_scene(int size, double half_x_m, double half_y_m) {
  SimulationConfig config;
  const std::string folder = std::string(UNDERSTORY_SOURCE_DIR) + "/config/";
  load_config_file(folder + "explorer.yaml", config);
  load_config_file(folder + "vehicle.yaml", config);
  BoxConfig& box = config.scene.box;
  box.x_min_m = -half_x_m;
  box.x_max_m = half_x_m;
  box.y_min_m = -half_y_m;
  box.y_max_m = half_y_m;
  config.scene.generator.regions = {{-half_x_m, -half_y_m, half_x_m, half_y_m, 0.10}};
  config.mission.time_limit_s = 300.0;
  config.explorer.team.size = size;
  return config;
}

std::unique_ptr<TeamRun> flown(const SimulationConfig& config, std::uint64_t seed) {
  auto run = std::make_unique<TeamRun>(RunSetup{config, seed, std::nullopt});
  run->fly([] { return false; }, [](const std::vector<TickRow>&) {});
  return run;
}

void expect_good(const TeamRun& run) {
  const MissionResult result = run.result();
  EXPECT_TRUE(result.completed) << result.stop_reason;
  EXPECT_EQ(result.collisions, 0U);
  EXPECT_GE(result.coverage.value(), 0.99);
  EXPECT_GE(run.least_separation_m(), team::SeparationConfig{}.safety_distance_m);
}

std::string bytes_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

TEST(Team, SharesTheWorkAndKnowsTheSameInTheEnd) {
  const std::unique_ptr<TeamRun> run = flown(team_scene(2, 12.0, 7.0), 1);

  expect_good(*run);
  const MissionResult alone = flown(team_scene(1, 12.0, 7.0), 1)->result();
  EXPECT_LT(*run->result().completion_time_s, 0.75 * *alone.completion_time_s);
  EXPECT_EQ(team::digest_of(run->map_of(0)), team::digest_of(run->map_of(1)));
}

TEST(Team, SameSeedGivesTheSameBytes) {
  const TemporaryFolder folder;
  SimulationConfig config = team_scene(2, 7.0, 6.0);
  config.radio.loss = 0.2;

  for (const char* name : {"a", "b"}) {
    const std::string out = folder.path_of(name);
    std::filesystem::create_directories(out + "/vehicle_0");
    std::filesystem::create_directories(out + "/vehicle_1");
    flown(config, 3)->write(out);
  }

  for (const char* file : {"map.ot", "vehicle_0/map.ot", "vehicle_1/map.ot", "topview.pgm"}) {
    const std::string first = bytes_of(folder.path_of("a") + "/" + file);
    EXPECT_FALSE(first.empty()) << file;
    EXPECT_TRUE(first == bytes_of(folder.path_of("b") + "/" + file)) << file;
  }
}

TEST(Team, AVehicleThatIsLostLeavesItsWorkToTheOthers) {
  SimulationConfig config = team_scene(2, 9.0, 6.0);
  config.team_losses = {{0, 25.0}};

  const std::unique_ptr<TeamRun> run = flown(config, 2);

  expect_good(*run);
  EXPECT_TRUE(run->result().team[0].is_lost);
}

TEST(Team, AVehicleThatNeverStartsIsNotWaitedFor) {
  SimulationConfig config = team_scene(2, 8.0, 6.0);
  config.team_losses = {{1, 0.0}};

  const std::unique_ptr<TeamRun> run = flown(config, 1);

  EXPECT_TRUE(run->result().completed);
  EXPECT_EQ(run->result().team[1].distance_m, 0.0);
  EXPECT_GE(run->result_of(0).coverage.value(), 0.97);
}

// They know of each other by camera alone.
TEST(Team, WithoutAnyRadioEachExploresItAllAndTheyDoNotCollide) {
  SimulationConfig config = team_scene(2, 7.0, 6.0);
  config.radio.range_m = 0.0;

  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(seed);
    const std::unique_ptr<TeamRun> run = flown(config, seed);

    EXPECT_EQ(run->result().collisions, 0U);
    for (std::size_t id = 0; id < 2; ++id) {
      EXPECT_TRUE(run->result_of(id).completed);
      EXPECT_GE(run->result_of(id).coverage.value(), 0.95);
    }
  }
}

TEST(Team, AfterARadioCutTheMapsAgreeAgain) {
  SimulationConfig config = team_scene(2, 10.0, 6.0);
  config.radio.cuts = {{15.0, 45.0}};

  const std::unique_ptr<TeamRun> run = flown(config, 4);

  expect_good(*run);
  EXPECT_EQ(team::digest_of(run->map_of(0)), team::digest_of(run->map_of(1)));
}

// Parts so long that both are out of range for more than a minute.
TEST(Team, OutOfRangeTheyMeetAtHomeInsteadOfExploringAllOfItTwice) {
  SimulationConfig config = team_scene(2, 24.0, 14.0);
  config.radio.range_m = 6.0;
  config.explorer.team.separation.lookout = false;  // it would take so short a range for a failure
  config.mission.time_limit_s = 600.0;

  const std::unique_ptr<TeamRun> met = flown(config, 3);
  config.explorer.team.coordination.meeting_wait_s = 0.0;
  const std::unique_ptr<TeamRun> not_met = flown(config, 3);

  expect_good(*met);
  EXPECT_LT(*met->result().completion_time_s, 0.8 * *not_met->result().completion_time_s);
}

TEST(Team, ThreeVehiclesStayApartOverManyForests) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const std::unique_ptr<TeamRun> run = flown(team_scene(3, 8.0, 6.0), seed);

    SCOPED_TRACE(seed);
    expect_good(*run);
  }
}

TEST(Team, WithAMapSplitBeforehandNobodyLeavesItsPart) {
  SimulationConfig config = team_scene(2, 10.0, 5.0);
  config.explorer.team.coordination.split_map = true;

  const std::unique_ptr<TeamRun> run = flown(config, 1);

  expect_good(*run);
}

}  // namespace
}  // namespace understory
