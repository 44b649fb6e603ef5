// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/simulate/batch.hpp"

#include <cstdio>

#include <fmt/core.h>

#include "understory/sim/mission_run.hpp"

namespace understory {

int fly_batch(const Options& options, const std::function<bool()>& interrupted) {
  fmt::print(
      "scenario,seed,speed_cap,completed,stop_reason,completion_time_s,coverage,distance_m,"
      "speed_mean_mps,speed_max_mps,collisions,min_clearance_m,realtime_factor\n");
  int good = 0;
  int flown = 0;
  for (int i = 0; i < options.batch && !interrupted(); ++i) {
    RunSetup setup;
    setup.config = load_simulation_config(options);
    setup.seed = options.seed + static_cast<std::uint64_t>(i);
    MissionRun run(std::move(setup));
    run.fly(interrupted, [](const TickRow&) {});
    const MissionResult result = run.result();
    fmt::print("{},{},{},{},{},{:.1f},{:.5f},{:.1f},{:.3f},{:.3f},{},{:.3f},{:.1f}\n",
               result.scenario,
               result.seed,
               result.speed_cap,
               result.completed ? 1 : 0,
               result.stop_reason,
               result.completion_time_s.value_or(result.mission_time_s),
               result.coverage,
               result.distance_m,
               result.speed_mean_mps,
               result.speed_max_mps,
               result.collisions,
               result.min_clearance_m.value_or(0.0),
               result.realtime_factor);
    static_cast<void>(std::fflush(stdout));
    ++flown;
    good += result.completed && result.collisions == 0 ? 1 : 0;
    if (!options.quiet) {
      fmt::print(
          stderr, "{} of {} flown, {} completed without collision\n", flown, options.batch, good);
    }
  }
  return good == options.batch ? 0 : 1;
}

}  // namespace understory
