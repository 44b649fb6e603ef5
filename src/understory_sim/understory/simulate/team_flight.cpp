// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/simulate/team_flight.hpp"

#include <deque>

#include "understory/sim/live_line.hpp"
#include "understory/sim/team_run.hpp"

namespace understory {
namespace {

// One line for all: the slowest's progress, the fastest's speed says nothing.
TickRow shown_of(const std::vector<TickRow>& rows) {
  TickRow shown = rows.front();
  for (const TickRow& row : rows) {
    if (row.coverage.value_or(0.0) > shown.coverage.value_or(0.0)) {
      shown = row;
    }
  }
  return shown;
}

}  // namespace

MissionResult fly_team(const RunSetup& setup,
                       const Options& options,
                       const std::string& folder,
                       const std::function<bool()>& interrupted) {
  TeamRun run(setup);
  std::deque<TickWriter> ticks;
  for (std::size_t id = 0; id < run.size(); ++id) {
    const std::string of_vehicle = TeamRun::folder_of(folder, id);
    prepare_result_folder(of_vehicle);
    ticks.emplace_back(of_vehicle + "/ticks.csv");
  }
  LiveLine live(options.quiet);
  TickRow last;
  run.fly(interrupted, [&](const std::vector<TickRow>& rows) {
    for (std::size_t id = 0; id < rows.size(); ++id) {
      ticks[id].append(rows[id]);
    }
    last = shown_of(rows);
    live.show(last, run.realtime_factor());
  });
  live.finish(last, run.realtime_factor());
  for (TickWriter& writer : ticks) {
    writer.close();
  }
  run.write(folder);
  return run.result();
}

}  // namespace understory
