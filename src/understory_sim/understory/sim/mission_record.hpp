// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Follows a flight and says what came of it: a row per frame, the result, the folder. Both hosts
// keep one; the planner never sees what it knows. On a real flight nothing is known of the truth.
// SI units, world frame; times in rows and results count from `start`. One thread. Construction
// throws on wrong configuration, write() when a file cannot be written; following a flight does not
// throw.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "understory/mission_status.hpp"
#include "understory/sim/forest_truth.hpp"
#include "understory/sim/result_writer.hpp"
#include "understory/sim/scorer.hpp"
#include "understory/sim/simulation_config.hpp"

namespace understory {

// A simulated world: the forest that follows from configuration and seed, and the configuration
// with box and start as the forest has them; or a real one, of which there is no truth.
struct World {
  SimulationConfig config;
  std::uint64_t seed = 1;
  std::shared_ptr<const ForestTruth> truth;

  World(SimulationConfig wanted, std::uint64_t world_seed);
  explicit World(SimulationConfig real) : config(std::move(real)) {}
  // As the vehicle team.id of a team finds it: with a start of its own. Without a team the same.
  [[nodiscard]] static World of_vehicle(SimulationConfig wanted, std::uint64_t world_seed);
  [[nodiscard]] Vector3d start_m() const;
  // What of it can be seen from where who starts there can fly; takes up to a few seconds. Null for
  // a real one.
  [[nodiscard]] std::shared_ptr<const CoverageTruth> coverage_truth(
      const std::vector<Vector3d>& starts_m) const;
  [[nodiscard]] std::shared_ptr<const CoverageTruth> coverage_truth() const {
    return coverage_truth({start_m()});
  }
};

class MissionRecord {
 public:
  MissionRecord(const World& world, std::shared_ptr<const CoverageTruth> coverage, Time start);

  // Every simulation step or odometry, in order.
  void on_vehicle(Time time, const VehicleState& state) { scorer_.on_vehicle(time, state); }
  // Every map, in order, with the mission and the vehicle as they are then.
  TickRow on_frame(const MapSnapshot& map,
                   const MissionStatus& status,
                   const VehicleState& vehicle);

  [[nodiscard]] MissionResult result(const MissionStatus& last, Time now) const;

  // config.yaml, trunks.csv, topview.pgm, map.ot and, last, result.json.
  void write(const std::string& folder, const MapSnapshot& map, MissionResult result) const;

 private:
  World world_;
  Time start_;
  Scorer scorer_;
  std::map<std::string, double> mode_frames_;
  double flown_frames_ = 0.0;
};

// One line for people.
[[nodiscard]] std::string summary_of(const MissionResult& result);

}  // namespace understory
