// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// One simulated mission from configuration to score. The planner never sees what the scorer knows.
// Construction throws on wrong configuration; flying does not. SI units, one thread.
#pragma once

#include <functional>
#include <memory>
#include <optional>

#include "understory/sim/lockstep.hpp"
#include "understory/sim/result_writer.hpp"
#include "understory/sim/scorer.hpp"
#include "understory/sim/stage_times.hpp"

namespace understory {

struct RunSetup {
  SimulationConfig config;
  std::uint64_t seed = 1;
  std::optional<MapSnapshot> resumed;
};

class MissionRun {
 public:
  explicit MissionRun(RunSetup setup);

  // Until the vehicle is down, or until `interrupted` says so; then it is brought to rest first.
  // `on_frame` sees every camera frame.
  void fly(const std::function<bool()>& interrupted,
           const std::function<void(const TickRow&)>& on_frame);

  [[nodiscard]] MissionResult result() const;
  [[nodiscard]] const MapSnapshot& map() const { return *map_; }
  [[nodiscard]] const Forest& forest() const { return truth_->forest(); }
  [[nodiscard]] const SimulationConfig& config() const { return setup_.config; }
  [[nodiscard]] double realtime_factor() const;

 private:
  [[nodiscard]] TickRow tick(const LockstepFrame& frame);

  RunSetup setup_;
  Rng rng_;
  std::shared_ptr<const ForestTruth> truth_;
  StageTimes times_;
  std::unique_ptr<Scorer> scorer_;
  std::unique_ptr<Lockstep> lockstep_;
  MapSnapshotPtr map_;
  std::map<std::string, double> mode_frames_;
  double flown_frames_ = 0.0;
  std::chrono::nanoseconds wall_{0};
};

}  // namespace understory
