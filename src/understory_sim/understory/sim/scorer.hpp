// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Judges a mission against the true world; knows nothing of the planner, which never sees it. On a
// real flight there is no truth: then only what was flown and mapped is counted. SI units, times
// since the mission's start. One thread. Nothing fails after construction; a map of another
// geometry is a bug (assert).
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "understory/autopilot/control_law.hpp"
#include "understory/base/time.hpp"
#include "understory/map/map_snapshot.hpp"
#include "understory/sim/coverage_truth.hpp"
#include "understory/sim/forest_truth.hpp"

namespace understory {

struct VolumeAtTime {
  double time_s;
  double volume_m3;
};

struct Score {
  std::optional<double> coverage;  // 0 .. 1
  std::optional<double> t50_s;
  std::optional<double> t90_s;
  std::optional<double> t95_s;
  std::optional<double> t99_s;
  double distance_m = 0.0;
  double speed_mean_mps = 0.0;  // over time, hovering included
  double speed_std_mps = 0.0;
  double speed_max_mps = 0.0;
  double yaw_rate_max_radps = 0.0;             // of the heading, absolute
  std::optional<int> collisions;               // contacts, however long each of them lasts
  std::optional<double> min_clearance_m;       // centre to surface; none if never within 10 m
  double explored_volume_m3 = 0.0;             // known voxels of the box
  std::vector<VolumeAtTime> volume_over_time;  // every 60 s
};

class Scorer {
 public:
  Scorer(std::shared_ptr<const ForestTruth> forest,
         std::shared_ptr<const CoverageTruth> coverage,
         double vehicle_radius_m,
         Time start);
  // Without truth.
  Scorer(const GridGeometry& geometry, double vehicle_radius_m, Time start);

  // With every map, in order; only the tiles that changed since the last one are counted.
  void on_map(const MapSnapshot& map);
  // With every simulation step, in order.
  void on_vehicle(Time time, const VehicleState& state);

  [[nodiscard]] double coverage() const;  // 0 without truth
  [[nodiscard]] double explored_volume_m3() const;
  [[nodiscard]] Score score() const;

 private:
  struct TileCount {
    std::uint16_t covered = 0;  // truly visible and known free
    std::uint16_t known = 0;
  };

  [[nodiscard]] TileCount count(const Tile* tile, TileSlot slot) const;
  void recount(const MapSnapshot& map, TileSlot slot);
  void record_coverage_times(double time_s);
  void record_volumes_before(double time_s);
  void judge_clearance(const Vector3d& position_m);

  std::shared_ptr<const ForestTruth> forest_;
  std::shared_ptr<const CoverageTruth> truth_;
  GridGeometry geometry_;
  double vehicle_radius_m_;
  Time start_;

  std::vector<TileCount> tiles_;
  std::size_t covered_voxels_ = 0;
  std::size_t known_voxels_ = 0;
  std::uint64_t last_revision_ = 0;
  bool has_map_ = false;
  double latest_s_ = 0.0;

  bool has_vehicle_ = false;
  Time last_time_{};
  Vector3d last_position_m_ = Vector3d::Zero();
  double flown_s_ = 0.0;
  double speed_integral_ = 0.0;
  double squared_speed_integral_ = 0.0;
  double min_clearance_m_;
  bool in_contact_ = false;
  int collisions_ = 0;
  Score score_;  // what is settled so far
};

}  // namespace understory
