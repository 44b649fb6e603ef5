// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Whole missions in lockstep, scored against the true forest.
#include <cmath>
#include <fstream>
#include <sstream>

#include <gtest/gtest.h>

#include "support/snapshot_builder.hpp"
#include "support/temporary_folder.hpp"
#include "understory/map/octomap_io.hpp"
#include "understory/sim/bus_log.hpp"
#include "understory/sim/forest_csv.hpp"
#include "understory/sim/mission_run.hpp"

namespace understory {
namespace {

SimulationConfig square_scene(double half_m, double trees_per_m2) {
  SimulationConfig config;
  const std::string folder = std::string(UNDERSTORY_SOURCE_DIR) + "/config/";
  load_config_file(folder + "explorer.yaml", config);
  load_config_file(folder + "vehicle.yaml", config);
  BoxConfig& box = config.scene.box;
  box.x_min_m = box.y_min_m = -half_m;
  box.x_max_m = box.y_max_m = half_m;
  config.scene.generator.regions = {{-half_m, -half_m, half_m, half_m, trees_per_m2}};
  config.mission.time_limit_s = 400.0;
  return config;
}

MissionRun flown(const SimulationConfig& config, std::uint64_t seed) {
  MissionRun run({config, seed, std::nullopt});
  run.fly([] { return false; }, [](const TickRow&) {});
  return run;
}

std::string bytes_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

void expect_good(const MissionResult& result, std::uint64_t seed) {
  EXPECT_TRUE(result.completed) << "seed " << seed << ": " << result.stop_reason;
  EXPECT_GE(result.coverage.value(), 0.99) << "seed " << seed;
  EXPECT_EQ(result.collisions, 0U) << "seed " << seed;
  EXPECT_EQ(result.counters.at("failed_brakes"), 0U) << "seed " << seed;
}

TEST(Mission, SmallForestIsExploredWithoutCollisionUnderBothSpeedCaps) {
  for (const char* cap : {"paper", "strict"}) {
    SimulationConfig config = square_scene(7.0, 0.10);
    config.explorer.limits.speed_cap = cap;

    const MissionResult result = flown(config, 1).result();

    expect_good(result, 1);
    EXPECT_LE(result.speed_max_mps, cap == std::string("paper") ? 3.06 : 1.53) << cap;
    EXPECT_LT(*result.completion_time_s, result.mission_time_s) << "flies home and lands";
  }
}

TEST(Mission, SparseAndDenseForestsAreExploredWithoutCollision) {
  for (const double density : {0.05, 0.20}) {
    for (std::uint64_t seed = 1; seed <= 2; ++seed) {
      expect_good(flown(square_scene(6.0, density), seed).result(), seed);
    }
  }
}

TEST(Mission, SameSeedGivesTheSameBytes) {
  const TemporaryFolder folder;
  std::array<std::string, 2> ticks;
  std::array<std::string, 2> maps;
  std::array<std::string, 2> frames;
  for (std::size_t i = 0; i < 2; ++i) {
    const std::string ticks_path = folder.path_of("ticks.csv");
    MissionRun run({square_scene(5.0, 0.15), 3, std::nullopt});
    const auto bus_log = std::make_shared<BusLog>(folder.path_of("bus.log"));
    run.set_tap(bus_log);
    TickWriter writer(ticks_path);
    run.fly([] { return false; }, [&writer](const TickRow& row) { writer.append(row); });
    writer.close();
    bus_log->close();
    save_octomap(run.map(), folder.path_of("map.ot"));
    frames.at(i) = bytes_of(folder.path_of("bus.log"));
    ticks.at(i) = bytes_of(ticks_path);
    maps.at(i) = bytes_of(folder.path_of("map.ot"));
  }

  EXPECT_GT(ticks[0].size(), 1000U);
  EXPECT_TRUE(ticks[0] == ticks[1]);
  EXPECT_TRUE(maps[0] == maps[1]);
  EXPECT_GT(frames[0].size(), 1'000'000U);
  EXPECT_TRUE(frames[0] == frames[1]);
}

TEST(Mission, CollectorsClearTheTrails) {
  const MissionRun run = flown(square_scene(7.0, 0.15), 2);

  const MissionResult result = run.result();
  expect_good(result, 2);
  EXPECT_GT(result.mode_share.at("collector"), 0.01);
}

TEST(Mission, UnreachablePocketDoesNotKeepTheMissionAlive) {
  const TemporaryFolder folder;
  SimulationConfig config = square_scene(6.0, 0.0);
  Forest forest;
  // A ring of trunks with gaps that can be looked through but not flown through.
  for (int i = 0; i < 16; ++i) {
    const double angle_rad = i * kPi / 8.0;
    forest.trunks.push_back(
        {Vector2d(3.0 + 1.4 * std::cos(angle_rad), 2.0 + 1.4 * std::sin(angle_rad)), 0.2});
  }
  write_forest_csv(forest, folder.path_of("ring.csv"));
  config.scene.source = "file";
  config.scene.forest_file = folder.path_of("ring.csv");

  const MissionResult result = flown(config, 1).result();

  EXPECT_TRUE(result.completed) << result.stop_reason;
  EXPECT_EQ(result.collisions, 0U);
}

TEST(Mission, TargetsThatShowNothingAreSetAsideThenGivenUp) {
  SimulationConfig config = square_scene(5.0, 0.0);
  config.depth_noise.dropout_probability = 1.0;  // the camera is blind
  config.explorer.retry.set_aside_s = 3.0;
  const Box3d box_m = config.scene.box.box_m();
  Box3d known_m = box_m;
  known_m.min().x() = -3.0;
  known_m.max().x() = 3.0;
  test::SnapshotBuilder builder(config.explorer.map.resolution_m, box_m);
  builder.set_box(known_m, VoxelState::kFree);

  MissionRun run({config, 1, *builder.build()});
  run.fly([] { return false; }, [](const TickRow&) {});

  const MissionResult result = run.result();
  EXPECT_TRUE(result.completed) << result.stop_reason;
  EXPECT_EQ(result.collisions, 0U);
  EXPECT_GE(result.counters.at("given_up"), 2U) << "at either end of what is known";
  EXPECT_GT(result.counters.at("set_aside"), result.counters.at("given_up")) << "tried again";
}

TEST(Mission, InterruptedMissionComesToRestAndKeepsItsResult) {
  MissionRun run({square_scene(8.0, 0.10), 1, std::nullopt});
  int frames = 0;
  double last_speed_mps = 1.0;

  run.fly([&frames] { return frames >= 120; },
          [&](const TickRow& row) {
            ++frames;
            last_speed_mps = row.velocity_mps.norm();
          });

  const MissionResult result = run.result();
  EXPECT_EQ(result.stop_reason, "interrupted");
  EXPECT_FALSE(result.completed);
  EXPECT_LT(last_speed_mps, 0.1);
  EXPECT_LT(result.mission_time_s, 8.0 + 12.0);
  EXPECT_GT(result.coverage.value(), 0.02);
}

TEST(Mission, TimeLimitEndsTheMissionAtRest) {
  SimulationConfig config = square_scene(8.0, 0.10);
  config.mission.time_limit_s = 10.0;

  const MissionResult result = flown(config, 1).result();

  EXPECT_EQ(result.stop_reason, "time_limit");
  EXPECT_FALSE(result.completed);
  EXPECT_EQ(result.collisions, 0U);
}

TEST(Mission, NoisyDepthAndOdometryAndWindHurtNobody) {
  SimulationConfig config = square_scene(5.0, 0.10);
  config.depth_noise.deviation_at_1m_m = 0.002;
  config.depth_noise.dropout_probability = 0.02;
  config.odometry_noise.position_deviation_m = 0.02;
  config.odometry_noise.yaw_deviation_rad = 0.005;
  config.vehicle.wind.mean_x_mps = 1.5;
  config.vehicle.wind.gust_deviation_mps = 0.4;

  const MissionResult result = flown(config, 4).result();

  EXPECT_TRUE(result.completed) << result.stop_reason;
  EXPECT_EQ(result.collisions, 0U);
}

TEST(Mission, StartOnTheGroundClimbsFirst) {
  SimulationConfig config = square_scene(5.0, 0.05);
  config.scene.start.z_m = 0.4;
  double highest_before_exploring_m = 0.0;
  MissionRun run({config, 2, std::nullopt});

  run.fly([] { return false; },
          [&](const TickRow& row) {
            if (row.mission_state == "take_off") {
              highest_before_exploring_m = row.position_m.z();
            }
          });

  EXPECT_GT(highest_before_exploring_m, 0.7);
  expect_good(run.result(), 2);
}

TEST(Mission, ResumedMissionGoesOnFromTheSavedMap) {
  const TemporaryFolder folder;
  const SimulationConfig config = square_scene(6.0, 0.10);
  const MissionRun first = flown(config, 1);
  save_octomap(first.map(), folder.path_of("map.ot"));
  MapSnapshot saved =
      load_octomap(folder.path_of("map.ot"), config.explorer.map, config.scene.box.box_m());

  MissionRun second({config, 1, std::move(saved)});
  second.fly([] { return false; }, [](const TickRow&) {});

  const MissionResult result = second.result();
  expect_good(result, 1);
  EXPECT_LT(*result.completion_time_s, 0.3 * *first.result().completion_time_s);
}

}  // namespace
}  // namespace understory
