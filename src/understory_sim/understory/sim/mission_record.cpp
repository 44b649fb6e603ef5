// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/mission_record.hpp"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "understory/map/octomap_io.hpp"

namespace understory {
namespace {

namespace fs = std::filesystem;

constexpr double kClearanceShownM = 5.0;

Scorer make_scorer(const World& world, std::shared_ptr<const CoverageTruth> coverage, Time start) {
  const double radius_m = world.config.explorer.plan.vehicle_radius_m;
  if (!world.truth) {
    return {GridGeometry(world.config.explorer.map.resolution_m, world.config.scene.box.box_m()),
            radius_m,
            start};
  }
  return {world.truth, std::move(coverage), radius_m, start};
}

void add_score(const Score& score, MissionResult& result) {
  result.coverage = score.coverage;
  result.t50_s = score.t50_s;
  result.t90_s = score.t90_s;
  result.t95_s = score.t95_s;
  result.t99_s = score.t99_s;
  result.distance_m = score.distance_m;
  result.speed_mean_mps = score.speed_mean_mps;
  result.speed_std_mps = score.speed_std_mps;
  result.speed_max_mps = score.speed_max_mps;
  result.yaw_rate_max_radps = score.yaw_rate_max_radps;
  if (score.collisions) {
    result.collisions = static_cast<std::uint64_t>(*score.collisions);
  }
  result.min_clearance_m = score.min_clearance_m;
  result.explored_volume_m3 = score.explored_volume_m3;
  for (const VolumeAtTime& at : score.volume_over_time) {
    result.volume_at.push_back({at.time_s, at.volume_m3});
  }
}

void add_config(const World& world, MissionResult& result) {
  const SimulationConfig& config = world.config;
  const LimitsConfig& limits = config.explorer.limits;
  result.seed = world.seed;
  result.strategy = config.explorer.strategy;
  result.speed_cap = limits.speed_cap;
  result.scenario = config.scene.name;
  result.explorer_speed_mps = limits.limits_for(FlightMode::kExplorer).speed_mps;
  result.collector_speed_mps = limits.limits_for(FlightMode::kCollector).speed_mps;
  result.yaw_rate_limit_radps = limits.yaw_rate_radps;
  result.box_m = config.scene.box.box_m();
}

}  // namespace

World::World(SimulationConfig wanted, std::uint64_t world_seed)
    : config(std::move(wanted)),
      seed(world_seed),
      truth(std::make_shared<const ForestTruth>(
          build_forest(config.scene, Rng(world_seed).fork("forest"), config.explorer.team.size))) {}

World World::of_vehicle(SimulationConfig wanted, std::uint64_t world_seed) {
  World world(std::move(wanted), world_seed);
  const team::TeamConfig& team = world.config.explorer.team;
  if (team.id >= team.size) {
    throw ConfigError(fmt::format("team.id: {} is not of a team of {}", team.id, team.size));
  }
  if (team.size > 1) {
    world.config.scene = scene_of_vehicle(world.config.scene, world.truth->forest(), team);
  }
  return world;
}

Vector3d World::start_m() const {
  const StartConfig& start = config.scene.start;
  return {start.x_m, start.y_m, start.z_m};
}

std::shared_ptr<const CoverageTruth> World::coverage_truth(
    const std::vector<Vector3d>& starts_m) const {
  if (!truth) {
    return nullptr;
  }
  const GridGeometry geometry(config.explorer.map.resolution_m, config.scene.box.box_m());
  return std::make_shared<const CoverageTruth>(
      *truth, geometry, starts_m, config.explorer.camera, config.explorer.plan.vehicle_radius_m);
}

MissionRecord::MissionRecord(const World& world,
                             std::shared_ptr<const CoverageTruth> coverage,
                             Time start)
    : world_(world), start_(start), scorer_(make_scorer(world, std::move(coverage), start)) {}

TickRow MissionRecord::on_frame(const MapSnapshot& map,
                                const MissionStatus& status,
                                const VehicleState& vehicle) {
  scorer_.on_map(map);
  TickRow row;
  row.time_s = to_seconds(status.time - start_);
  row.position_m = vehicle.position_m;
  row.velocity_mps = vehicle.velocity_mps;
  row.yaw_rad = yaw_of(vehicle.world_from_body);
  row.yaw_rate_radps = (vehicle.world_from_body * vehicle.body_rates_radps).z();
  row.mode = to_string(status.mode);
  row.mission_state = to_string(status.state);
  row.explored_volume_m3 = scorer_.explored_volume_m3();
  row.clusters = status.clusters;
  row.trails = status.trails;
  row.dormant = status.dormant;
  row.target_id = status.target_id;
  row.target_m = status.target_m;
  if (world_.truth) {
    row.coverage = scorer_.coverage();
    row.clearance_m =
        world_.truth->distance_to_nearest_surface_m(vehicle.position_m, kClearanceShownM);
  }
  mode_frames_[std::string(row.mode)] += 1.0;
  flown_frames_ += 1.0;
  return row;
}

MissionResult MissionRecord::result(const MissionStatus& last, Time now) const {
  MissionResult result;
  result.completed = last.stop_reason == StopReason::kNothingLeft;
  result.stop_reason = to_string(last.stop_reason);
  if (result.completed && last.explored_at) {
    result.completion_time_s = to_seconds(*last.explored_at - last.started_at);
  }
  result.mission_time_s = to_seconds(now - start_);
  add_score(scorer_.score(), result);
  for (const auto& [mode, frames] : mode_frames_) {
    result.mode_share[mode] = frames / std::max(flown_frames_, 1.0);
  }
  result.dormant_clusters = last.dormant;
  result.set_aside_targets = last.set_aside;
  result.replans = last.replans;
  result.counters = last.counters;
  add_config(world_, result);
  result.peak_rss_mb = peak_rss_mb();
  return result;
}

void MissionRecord::write(const std::string& folder,
                          const MapSnapshot& map,
                          MissionResult result) const {
  const fs::path path(folder);
  const char* commit = std::getenv("UNDERSTORY_COMMIT");
  result.commit = commit == nullptr ? "" : commit;
  write_text_file((path / "config.yaml").string(), to_yaml(world_.config));
  if (world_.truth) {
    write_trunks((path / "trunks.csv").string(),
                 world_.truth->forest().trunks,
                 world_.config.scene.box.box_m());
  }
  result.topview = write_topview(map, (path / "topview.pgm").string());
  save_octomap(map, (path / "map.ot").string());
  write_result_json((path / "result.json").string(), result);
}

std::string summary_of(const MissionResult& result) {
  std::string judged;
  if (result.coverage && result.collisions) {
    judged = fmt::format("coverage {:.2f} %, {} collisions, clearance {:.2f} m, ",
                         100.0 * *result.coverage,
                         *result.collisions,
                         result.min_clearance_m.value_or(0.0));
  }
  return fmt::format(
      "{} after {:.1f} s ({}): {}{:.0f} m at {:.2f} m/s, x{:.0f} real time, {:.0f} MB",
      result.completed ? "completed" : "NOT completed",
      result.completion_time_s.value_or(result.mission_time_s),
      result.stop_reason,
      judged,
      result.distance_m,
      result.speed_mean_mps,
      result.realtime_factor,
      result.peak_rss_mb);
}

}  // namespace understory
