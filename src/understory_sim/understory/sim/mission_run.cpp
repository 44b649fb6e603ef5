// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/mission_run.hpp"

#include <algorithm>
#include <chrono>

namespace understory {
namespace {

constexpr double kClearanceShownM = 5.0;

}  // namespace

MissionRun::MissionRun(RunSetup setup) : setup_(std::move(setup)), rng_(setup_.seed) {
  SimulationConfig& config = setup_.config;
  truth_ = std::make_shared<const ForestTruth>(build_forest(config.scene, rng_.fork("forest")));
  const GridGeometry geometry(config.explorer.map.resolution_m, config.scene.box.box_m());
  const Vector3d start(config.scene.start.x_m, config.scene.start.y_m, config.scene.start.z_m);
  const double radius_m = config.explorer.plan.vehicle_radius_m;
  scorer_ = std::make_unique<Scorer>(
      truth_,
      std::make_shared<const CoverageTruth>(
          *truth_, geometry, std::vector<Vector3d>{start}, config.explorer.camera, radius_m),
      radius_m,
      Time{});
  lockstep_ = std::make_unique<Lockstep>(
      config,
      truth_->forest(),
      rng_,
      setup_.resumed ? &*setup_.resumed : nullptr,
      [scorer = scorer_.get()](Time time, const VehicleState& state) {
        scorer->on_vehicle(time, state);
      },
      times_);
}

TickRow MissionRun::tick(const LockstepFrame& frame) {
  const Mission& mission = lockstep_->mission();
  const VehicleState& vehicle = lockstep_->vehicle();
  const std::vector<ClusterPtr>& clusters = mission.explorer().clusters();
  TickRow row;
  row.time_s = to_seconds(frame.time);
  row.position_m = vehicle.position_m;
  row.velocity_mps = vehicle.velocity_mps;
  row.yaw_rad = yaw_of(vehicle.world_from_body);
  row.yaw_rate_radps = (vehicle.world_from_body * vehicle.body_rates_radps).z();
  row.mode = to_string(mission.pilot().follower().at(frame.time).mode);
  row.mission_state = to_string(mission.state());
  row.coverage = scorer_->coverage();
  row.explored_volume_m3 = scorer_->explored_volume_m3();
  row.clusters = clusters.size();
  for (const ClusterPtr& cluster : clusters) {
    row.trails += cluster->is_trail() ? 1U : 0U;
    row.dormant += cluster->is_dormant() ? 1U : 0U;
  }
  if (mission.explorer().target()) {
    const Candidate& target = mission.explorer().target()->candidate;
    row.target_id = target.cluster->id;
    row.target_m = target.viewpoint.position_m;
  }
  row.clearance_m = truth_->distance_to_nearest_surface_m(vehicle.position_m, kClearanceShownM);
  mode_frames_[std::string(row.mode)] += 1.0;
  flown_frames_ += 1.0;
  return row;
}

void MissionRun::fly(const std::function<bool()>& interrupted,
                     const std::function<void(const TickRow&)>& on_frame) {
  const auto start = std::chrono::steady_clock::now();
  bool is_stopping = false;
  while (!lockstep_->is_over()) {
    const LockstepFrame frame = lockstep_->advance();
    map_ = frame.map;
    scorer_->on_map(*frame.map);
    on_frame(tick(frame));
    if (!is_stopping && interrupted()) {
      is_stopping = true;
      lockstep_->stop(StopReason::kInterrupted);
    }
    wall_ = std::chrono::steady_clock::now() - start;
  }
}

double MissionRun::realtime_factor() const {
  const double wall_s = std::chrono::duration<double>(wall_).count();
  return wall_s > 0.0 ? to_seconds(lockstep_->now()) / wall_s : 0.0;
}

MissionResult MissionRun::result() const {
  const Mission& mission = lockstep_->mission();
  const Score score = scorer_->score();
  const SimulationConfig& config = setup_.config;
  MissionResult result;
  result.completed = mission.stop_reason() == StopReason::kNothingLeft;
  result.stop_reason = to_string(mission.stop_reason());
  if (result.completed) {
    result.completion_time_s = to_seconds(mission.explored_at());
  }
  result.mission_time_s = to_seconds(lockstep_->now());
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
  result.collisions = static_cast<std::uint64_t>(score.collisions);
  result.min_clearance_m = score.min_clearance_m;
  result.explored_volume_m3 = score.explored_volume_m3;
  for (const VolumeAtTime& at : score.volume_over_time) {
    result.volume_at.push_back({at.time_s, at.volume_m3});
  }
  for (const auto& [mode, frames] : mode_frames_) {
    result.mode_share[mode] = frames / std::max(flown_frames_, 1.0);
  }
  const Explorer& explorer = mission.explorer();
  const PilotCounters& pilot = mission.pilot().counters();
  result.dormant_clusters = static_cast<std::uint64_t>(std::count_if(
      explorer.clusters().begin(), explorer.clusters().end(), [](const ClusterPtr& cluster) {
        return cluster->is_dormant();
      }));
  result.set_aside_targets = explorer.set_aside().size();
  result.replans = pilot.plans;
  result.counters = {{"failed_plans", pilot.failed_plans},
                     {"brakes", pilot.brakes},
                     {"failed_brakes", pilot.failed_brakes},
                     {"decisions", explorer.counters().decisions},
                     {"full_searches", explorer.counters().full_searches},
                     {"set_aside", explorer.counters().set_aside},
                     {"given_up", explorer.counters().given_up},
                     {"skipped_frames", lockstep_->skipped_frames()}};
  result.seed = setup_.seed;
  result.strategy = config.explorer.strategy;
  result.speed_cap = config.explorer.limits.speed_cap;
  result.scenario = config.scene.name;
  const LimitsConfig& limits = config.explorer.limits;
  result.explorer_speed_mps = limits.limits_for(FlightMode::kExplorer).speed_mps;
  result.collector_speed_mps = limits.limits_for(FlightMode::kCollector).speed_mps;
  result.yaw_rate_limit_radps = limits.yaw_rate_radps;
  result.box_m = config.scene.box.box_m();
  result.realtime_factor = realtime_factor();
  result.peak_rss_mb = peak_rss_mb();
  result.stages = times_.stats();
  return result;
}

}  // namespace understory
