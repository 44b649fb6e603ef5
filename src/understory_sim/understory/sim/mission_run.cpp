// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/mission_run.hpp"

#include <chrono>

namespace understory {

MissionRun::MissionRun(const RunSetup& setup)
    : world_(setup.config, setup.seed), record_(world_, world_.coverage_truth(), Time{}) {
  lockstep_ = std::make_unique<Lockstep>(
      world_.config,
      std::make_shared<const DepthRenderer>(world_.truth->forest()),
      Rng(setup.seed),
      setup.resumed ? &*setup.resumed : nullptr,
      [record = &record_](Time time, const VehicleState& state) {
        record->on_vehicle(time, state);
      },
      times_);
}

void MissionRun::fly(const std::function<bool()>& interrupted,
                     const std::function<void(const TickRow&)>& on_frame) {
  const auto start = std::chrono::steady_clock::now();
  bool is_stopping = false;
  while (!lockstep_->is_over()) {
    const LockstepFrame frame = lockstep_->advance();
    map_ = frame.map;
    on_frame(record_.on_frame(
        *frame.map, status_of(lockstep_->mission(), frame.time), lockstep_->vehicle()));
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
  const Time now = lockstep_->now();
  MissionResult result = record_.result(status_of(lockstep_->mission(), now), now);
  result.counters["skipped_frames"] = lockstep_->skipped_frames();
  result.counters["gate_violations"] = lockstep_->gate_violations();
  result.realtime_factor = realtime_factor();
  result.stages = times_.stats();
  return result;
}

}  // namespace understory
