// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// One simulated mission from configuration to score. The planner never sees what the scorer knows.
// Construction throws on wrong configuration; flying does not. SI units, one thread.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "understory/sim/lockstep.hpp"
#include "understory/sim/mission_record.hpp"
#include "understory/sim/stage_times.hpp"

namespace understory {

struct RunSetup {
  SimulationConfig config;
  std::uint64_t seed = 1;
  std::optional<MapSnapshot> resumed;
};

class MissionRun {
 public:
  explicit MissionRun(const RunSetup& setup);

  // Until the vehicle is down, or until `interrupted` says so; then it is brought to rest first.
  // `on_frame` sees every camera frame.
  void fly(const std::function<bool()>& interrupted,
           const std::function<void(const TickRow&)>& on_frame);

  // Sees every frame between host and vehicle.
  void set_tap(std::shared_ptr<can::FrameTap> tap) { lockstep_->set_tap(std::move(tap)); }

  [[nodiscard]] MissionResult result() const;
  [[nodiscard]] const MapSnapshot& map() const { return *map_; }
  [[nodiscard]] const Forest& forest() const { return world_.truth->forest(); }
  [[nodiscard]] const SimulationConfig& config() const { return world_.config; }
  [[nodiscard]] double realtime_factor() const;
  void write(const std::string& folder) const { record_.write(folder, *map_, result()); }

 private:
  World world_;
  StageTimes times_;
  MissionRecord record_;
  std::unique_ptr<Lockstep> lockstep_;
  MapSnapshotPtr map_;
  std::chrono::nanoseconds wall_{0};
};

}  // namespace understory
