// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// One simulated mission of a team: vehicles in lockstep on one clock, a radio between them, a score
// for each and for all. Who is lost on the way stays where it is, silent, as an obstacle to the
// others. The same configuration and seed give the same flights, bit for bit. World frame, SI
// units, one thread. Construction throws on wrong configuration; flying does not throw.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "understory/sim/mission_run.hpp"
#include "understory/sim/radio.hpp"

namespace understory {

class TeamRun {
 public:
  // The team is as large as the configuration says.
  explicit TeamRun(const RunSetup& setup);
  ~TeamRun();

  // Until all are down, or until `interrupted` says so; then all are brought to rest first.
  // `on_frame` sees every camera frame: a row per vehicle.
  void fly(const std::function<bool()>& interrupted,
           const std::function<void(const std::vector<TickRow>&)>& on_frame);

  [[nodiscard]] std::size_t size() const { return vehicles_.size(); }
  // Of all together: complete when the last of them has found nothing left.
  [[nodiscard]] MissionResult result() const;
  [[nodiscard]] MissionResult result_of(std::size_t id) const;
  // What vehicle `id` knows.
  [[nodiscard]] const MapSnapshot& map_of(std::size_t id) const;
  [[nodiscard]] double least_separation_m() const { return least_separation_m_; }
  [[nodiscard]] SimulatedRadio& radio() { return *radio_; }
  [[nodiscard]] double realtime_factor() const;
  // result.json of all, and a folder vehicle_ID for each.
  void write(const std::string& folder) const;
  [[nodiscard]] static std::string folder_of(const std::string& folder, std::size_t id);

 private:
  struct Vehicle;

  void add_vehicle(std::size_t id, const Rng& rng, const std::shared_ptr<const DepthRenderer>&);
  void lose_vehicles();
  [[nodiscard]] bool is_over() const;
  [[nodiscard]] bool are_all_down() const;
  [[nodiscard]] std::vector<Vector3d> others_of(std::size_t id) const;
  void fly_to_next_exposure();
  void judge_separation();
  void unite_maps();
  TickRow see_and_decide(std::size_t id);
  void add_mate(std::size_t id, const MissionResult& alone, MissionResult& team) const;

  World world_;
  std::shared_ptr<const CoverageTruth> coverage_;
  std::unique_ptr<SimulatedRadio> radio_;
  std::vector<std::unique_ptr<Vehicle>> vehicles_;
  std::unique_ptr<MissionRecord> record_;  // of all
  MapSnapshot united_;                     // what they have seen together
  Time now_{};
  Time last_flight_{};
  std::int64_t frame_ = 0;
  double least_separation_m_;
  std::uint64_t meetings_ = 0;
  std::chrono::nanoseconds wall_{0};
};

}  // namespace understory
