// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/team_run.hpp"

#include <algorithm>
#include <filesystem>
#include <limits>

#include <fmt/format.h>

namespace understory {
namespace {

// Between the centres of two vehicles; nearer than this they have met.
constexpr double kRadii = 2.0;
constexpr std::int64_t kFramesPerUnion = 15;
constexpr Duration kLastWords = std::chrono::seconds(5);

SimulationConfig config_of(SimulationConfig config, const Forest& forest, int id) {
  config.explorer.team.id = id;
  config.scene = scene_of_vehicle(config.scene, forest, config.explorer.team);
  return config;
}

// What any of them knows of a tile; where they differ, the sum of what they have measured.
TilePtr united_tile(const std::vector<const Tile*>& tiles, const SensorModel& sensor) {
  auto united = std::make_shared<Tile>();
  for (std::size_t offset = 0; offset < kVoxelsPerTile; ++offset) {
    int sum = 0;
    bool is_known = false;
    for (const Tile* tile : tiles) {
      if (tile->log_odds[offset] != kUnknownLogOdds) {
        sum += tile->log_odds_at(offset);
        is_known = true;
      }
    }
    if (is_known) {
      united->set(offset, static_cast<std::int8_t>(std::clamp(sum, sensor.min, sensor.max)));
    }
  }
  return united;
}

}  // namespace

struct TeamRun::Vehicle {
  Vehicle(World its_world, const std::shared_ptr<const CoverageTruth>& coverage)
      : world(std::move(its_world)),
        record(world, coverage, Time{}),
        own(coverage->geometry(), world.config.explorer.plan.vehicle_radius_m, Time{}) {}

  World world;
  StageTimes times;
  MissionRecord record;           // judged by what it knows of the team's map
  Scorer own;                     // by what it has seen itself
  std::vector<Vector3d> track_m;  // at each step since the last frame
  std::unique_ptr<Lockstep> lockstep;
  LockstepFrame frame;
  MapSnapshotPtr united_own;  // its own map when the maps were last united
  bool is_lost = false;
};

TeamRun::TeamRun(const RunSetup& setup)
    : world_(setup.config, setup.seed),
      united_{GridGeometry(setup.config.explorer.map.resolution_m, world_.config.scene.box.box_m()),
              SensorModel(setup.config.explorer.map.sensor),
              0,
              Time{},
              {},
              {}},
      least_separation_m_(std::numeric_limits<double>::infinity()) {
  const auto size = static_cast<std::size_t>(world_.config.explorer.team.size);
  const Rng rng(setup.seed);
  united_.tiles.resize(united_.geometry.slot_count());
  std::vector<SimulationConfig> configs;
  std::vector<Vector3d> starts_m;
  for (std::size_t id = 0; id < size; ++id) {
    configs.push_back(config_of(world_.config, world_.truth->forest(), static_cast<int>(id)));
    const StartConfig& start = configs.back().scene.start;
    starts_m.emplace_back(start.x_m, start.y_m, start.z_m);
  }
  coverage_ = world_.coverage_truth(starts_m);
  radio_ = std::make_unique<SimulatedRadio>(
      world_.config.radio,
      static_cast<int>(size),
      rng.fork("radio"),
      [truth = world_.truth](const Vector3d& from_m, const Vector3d& to_m) {
        return trunk_between(*truth, from_m, to_m);
      });
  record_ = std::make_unique<MissionRecord>(world_, coverage_, Time{});
  const auto renderer = std::make_shared<const DepthRenderer>(world_.truth->forest());
  for (std::size_t id = 0; id < size; ++id) {
    World world = world_;
    world.config = configs[id];
    vehicles_.push_back(std::make_unique<Vehicle>(std::move(world), coverage_));
    add_vehicle(id, rng.fork(fmt::format("vehicle {}", id)), renderer);
  }
}

TeamRun::~TeamRun() = default;

void TeamRun::add_vehicle(std::size_t id,
                          const Rng& rng,
                          const std::shared_ptr<const DepthRenderer>& renderer) {
  Vehicle& vehicle = *vehicles_[id];
  vehicle.lockstep = std::make_unique<Lockstep>(
      vehicle.world.config,
      renderer,
      rng,
      nullptr,
      [&vehicle](Time time, const VehicleState& state) {
        vehicle.record.on_vehicle(time, state);
        vehicle.own.on_vehicle(time, state);
        vehicle.track_m.push_back(state.position_m);
      },
      vehicle.times);
  vehicle.lockstep->join(std::make_unique<TeamMember>(
      vehicle.world.config.explorer.team, united_, radio_->link(static_cast<int>(id))));
}

void TeamRun::lose_vehicles() {
  for (const TeamLossConfig& loss : world_.config.team_losses) {
    const auto id = static_cast<std::size_t>(loss.id);
    if (id < size() && !vehicles_[id]->is_lost && to_seconds(now_) >= loss.at_s) {
      vehicles_[id]->is_lost = true;
      radio_->switch_off(loss.id);
    }
  }
}

std::vector<Vector3d> TeamRun::others_of(std::size_t id) const {
  std::vector<Vector3d> others_m;
  for (std::size_t other = 0; other < size(); ++other) {
    if (other != id) {
      others_m.push_back(vehicles_[other]->lockstep->vehicle().position_m);
    }
  }
  return others_m;
}

void TeamRun::fly_to_next_exposure() {
  std::vector<Vector3d> positions_m;
  for (const std::unique_ptr<Vehicle>& vehicle : vehicles_) {
    vehicle->track_m.clear();
    if (!vehicle->is_lost) {
      vehicle->lockstep->fly_to_next_exposure();
      now_ = std::max(now_, vehicle->lockstep->now());
    }
    positions_m.push_back(vehicle->lockstep->vehicle().position_m);
  }
  radio_->advance(now_, positions_m);
}

void TeamRun::judge_separation() {
  const double contact_m = kRadii * world_.config.explorer.plan.vehicle_radius_m;
  for (std::size_t a = 0; a < size(); ++a) {
    for (std::size_t b = a + 1; b < size(); ++b) {
      const std::vector<Vector3d>& track_a = vehicles_[a]->track_m;
      const std::vector<Vector3d>& track_b = vehicles_[b]->track_m;
      const Vector3d rest_a = vehicles_[a]->lockstep->vehicle().position_m;
      const Vector3d rest_b = vehicles_[b]->lockstep->vehicle().position_m;
      double least_m = std::numeric_limits<double>::infinity();
      for (std::size_t i = 0; i < std::max(track_a.size(), track_b.size()); ++i) {
        const Vector3d& at_a = i < track_a.size() ? track_a[i] : rest_a;
        const Vector3d& at_b = i < track_b.size() ? track_b[i] : rest_b;
        least_m = std::min(least_m, (at_a - at_b).norm());
      }
      meetings_ += least_m < contact_m && least_separation_m_ >= contact_m ? 1U : 0U;
      least_separation_m_ = std::min(least_separation_m_, least_m);
    }
  }
}

void TeamRun::unite_maps() {
  std::vector<TileSlot> changed;
  for (const std::unique_ptr<Vehicle>& vehicle : vehicles_) {
    if (vehicle->frame.own_map && vehicle->frame.own_map != vehicle->united_own) {
      const std::vector<TileSlot> of_vehicle =
          tiles_changed_between(vehicle->united_own.get(), *vehicle->frame.own_map);
      changed.insert(changed.end(), of_vehicle.begin(), of_vehicle.end());
      vehicle->united_own = vehicle->frame.own_map;
    }
  }
  std::sort(changed.begin(), changed.end());
  changed.erase(std::unique(changed.begin(), changed.end()), changed.end());
  for (const TileSlot slot : changed) {
    std::vector<const Tile*> tiles;
    for (const std::unique_ptr<Vehicle>& vehicle : vehicles_) {
      if (vehicle->united_own && vehicle->united_own->tiles[slot]) {
        tiles.push_back(vehicle->united_own->tiles[slot].get());
      }
    }
    united_.tiles[slot] = united_tile(tiles, united_.sensor_model);
  }
  united_.changed_tiles = std::move(changed);
  ++united_.revision;
  united_.stamp = now_;
}

TickRow TeamRun::see_and_decide(std::size_t id) {
  Vehicle& vehicle = *vehicles_[id];
  vehicle.frame = vehicle.lockstep->see_and_decide(others_of(id));
  vehicle.own.on_map(*vehicle.frame.own_map);
  return vehicle.record.on_frame(*vehicle.frame.map,
                                 status_of(vehicle.lockstep->mission(), vehicle.frame.time),
                                 vehicle.lockstep->vehicle());
}

// The last of what was seen is told after the last of them has landed.
bool TeamRun::is_over() const {
  return are_all_down() && now_ >= last_flight_ + kLastWords;
}

bool TeamRun::are_all_down() const {
  return std::all_of(vehicles_.begin(), vehicles_.end(), [](const auto& vehicle) {
    return vehicle->is_lost || vehicle->lockstep->is_over();
  });
}

void TeamRun::fly(const std::function<bool()>& interrupted,
                  const std::function<void(const std::vector<TickRow>&)>& on_frame) {
  const auto start = std::chrono::steady_clock::now();
  bool is_stopping = false;
  std::vector<TickRow> rows(size());
  lose_vehicles();
  while (!is_over()) {
    fly_to_next_exposure();
    judge_separation();
    for (std::size_t id = 0; id < size(); ++id) {
      if (!vehicles_[id]->is_lost) {
        rows[id] = see_and_decide(id);
      }
    }
    if (++frame_ % kFramesPerUnion == 0 || is_over()) {
      unite_maps();
      MissionStatus status;
      status.time = now_;
      record_->on_frame(united_, status, VehicleState{});
    }
    on_frame(rows);
    lose_vehicles();
    last_flight_ = are_all_down() ? last_flight_ : now_;
    if (!is_stopping && interrupted()) {
      is_stopping = true;
      for (const std::unique_ptr<Vehicle>& vehicle : vehicles_) {
        vehicle->lockstep->stop(StopReason::kInterrupted);
      }
    }
    wall_ = std::chrono::steady_clock::now() - start;
  }
}

double TeamRun::realtime_factor() const {
  const double wall_s = std::chrono::duration<double>(wall_).count();
  return wall_s > 0.0 ? to_seconds(now_) / wall_s : 0.0;
}

const MapSnapshot& TeamRun::map_of(std::size_t id) const {
  return vehicles_[id]->frame.map ? *vehicles_[id]->frame.map : united_;
}

MissionResult TeamRun::result_of(std::size_t id) const {
  const Vehicle& vehicle = *vehicles_[id];
  const Lockstep& lockstep = *vehicle.lockstep;
  MissionResult result =
      vehicle.record.result(status_of(lockstep.mission(), lockstep.now()), lockstep.now());
  result.counters["skipped_frames"] = lockstep.skipped_frames();
  result.counters["gate_violations"] = lockstep.gate_violations();
  result.realtime_factor = realtime_factor();
  result.stages = vehicle.times.stats();
  return result;
}

MissionResult TeamRun::result() const {
  MissionStatus status;
  status.time = now_;
  status.stop_reason = StopReason::kNothingLeft;
  status.explored_at = Time{};
  std::vector<MissionResult> alone;
  for (std::size_t id = 0; id < size(); ++id) {
    alone.push_back(result_of(id));
    if (!vehicles_[id]->is_lost) {
      const Mission& mission = vehicles_[id]->lockstep->mission();
      status.explored_at = std::max(*status.explored_at, mission.explored_at());
      status.stop_reason = alone.back().completed ? status.stop_reason : mission.stop_reason();
    }
  }
  MissionResult result = record_->result(status, now_);
  result.collisions = meetings_;
  for (std::size_t id = 0; id < size(); ++id) {
    add_mate(id, alone[id], result);
  }
  result.least_separation_m = least_separation_m_;
  result.realtime_factor = realtime_factor();
  return result;
}

void TeamRun::add_mate(std::size_t id, const MissionResult& alone, MissionResult& team) const {
  const Vehicle& vehicle = *vehicles_[id];
  const RadioUse& radio = radio_->use(static_cast<int>(id));
  const Score seen = vehicle.own.score();
  const auto count = static_cast<double>(size());
  TeamMateResult mate;
  mate.id = static_cast<int>(id);
  mate.is_lost = vehicle.is_lost;
  mate.completion_time_s = alone.completion_time_s;
  mate.distance_m = alone.distance_m;
  mate.speed_mean_mps = alone.speed_mean_mps;
  mate.speed_std_mps = alone.speed_std_mps;
  mate.seen_volume_m3 = seen.explored_volume_m3;
  for (const VolumeAtTime& at : seen.volume_over_time) {
    mate.seen_at.push_back({at.time_s, at.volume_m3});
  }
  mate.coverage = alone.coverage.value_or(0.0);
  mate.bytes_sent = radio.bytes_sent;
  mate.bytes_per_s = static_cast<double>(radio.bytes_sent) / std::max(1.0, to_seconds(now_));
  mate.peak_bytes_per_s = radio.peak_bytes_in_a_second;
  mate.steady_peak_bytes_per_s = radio.steady_peak_bytes_in_a_second;
  team.collisions = team.collisions.value_or(0) + alone.collisions.value_or(0);
  team.min_clearance_m =
      std::min(team.min_clearance_m.value_or(10.0), alone.min_clearance_m.value_or(10.0));
  team.distance_m += alone.distance_m / count;
  team.speed_mean_mps += alone.speed_mean_mps / count;
  team.speed_std_mps += alone.speed_std_mps / count;
  team.speed_max_mps = std::max(team.speed_max_mps, alone.speed_max_mps);
  team.yaw_rate_max_radps = std::max(team.yaw_rate_max_radps, alone.yaw_rate_max_radps);
  team.replans += alone.replans;
  for (const auto& [name, number] : alone.counters) {
    team.counters[name] += number;
  }
  team.team.push_back(std::move(mate));
}

std::string TeamRun::folder_of(const std::string& folder, std::size_t id) {
  return (std::filesystem::path(folder) / fmt::format("vehicle_{}", id)).string();
}

void TeamRun::write(const std::string& folder) const {
  for (std::size_t id = 0; id < size(); ++id) {
    vehicles_[id]->record.write(folder_of(folder, id), map_of(id), result_of(id));
  }
  record_->write(folder, united_, result());
}

}  // namespace understory
