// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/scorer.hpp"

#include <algorithm>
#include <bitset>
#include <cassert>
#include <cmath>
#include <utility>

namespace understory {
namespace {

constexpr double kClearanceHorizonM = 10.0;
constexpr double kContactReleaseM = 0.01;  // a contact has ended this far out: jitter is no second
constexpr double kVolumePeriodS = 60.0;

// Rows of this tile lie inside the box within these bounds.
std::uint16_t column_mask(const VoxelBox& inside) {
  const auto first = static_cast<unsigned>(inside.min.x()) % kTileVoxels;
  const auto size = static_cast<unsigned>(inside.size().x());
  return static_cast<std::uint16_t>(((1U << size) - 1U) << first);
}

std::uint16_t bits_of(unsigned row) {
  return static_cast<std::uint16_t>(std::bitset<16>(row).count());
}

// How fast the heading turns: the body's x axis in the world's xy plane.
double heading_rate_radps(const VehicleState& state) {
  const Vector3d forward = state.world_from_body * Vector3d::UnitX();
  const Vector3d turning = (state.world_from_body * state.body_rates_radps).cross(forward);
  const double level = forward.head<2>().squaredNorm();
  return level > 0.0 ? (forward.x() * turning.y() - forward.y() * turning.x()) / level : 0.0;
}

}  // namespace

Scorer::Scorer(std::shared_ptr<const ForestTruth> forest,
               std::shared_ptr<const CoverageTruth> coverage,
               double vehicle_radius_m,
               Time start)
    : forest_(std::move(forest)),
      truth_(std::move(coverage)),
      geometry_(truth_->geometry()),
      vehicle_radius_m_(vehicle_radius_m),
      start_(start),
      tiles_(geometry_.slot_count()),
      min_clearance_m_(kClearanceHorizonM) {}

Scorer::Scorer(const GridGeometry& geometry, double vehicle_radius_m, Time start)
    : geometry_(geometry),
      vehicle_radius_m_(vehicle_radius_m),
      start_(start),
      tiles_(geometry_.slot_count()),
      min_clearance_m_(kClearanceHorizonM) {}

void Scorer::on_map(const MapSnapshot& map) {
  assert(map.geometry == geometry_);
  const double time_s = to_seconds(map.stamp - start_);
  record_volumes_before(time_s);
  const bool is_next = has_map_ && map.revision == last_revision_ + 1;
  if (is_next) {
    for (const TileSlot slot : map.changed_tiles) {
      recount(map, slot);
    }
  } else if (!has_map_ || map.revision != last_revision_) {
    for (TileSlot slot = 0; slot < map.tiles.size(); ++slot) {
      recount(map, slot);
    }
  }
  has_map_ = true;
  last_revision_ = map.revision;
  record_coverage_times(time_s);
}

void Scorer::recount(const MapSnapshot& map, TileSlot slot) {
  const TileCount now = count(map.tiles[slot].get(), slot);
  covered_voxels_ = covered_voxels_ + now.covered - tiles_[slot].covered;
  known_voxels_ = known_voxels_ + now.known - tiles_[slot].known;
  tiles_[slot] = now;
}

Scorer::TileCount Scorer::count(const Tile* tile, TileSlot slot) const {
  TileCount total;
  if (tile == nullptr) {
    return total;
  }
  const VoxelBox inside = geometry_.voxels_of_slot(slot);
  const CoverageTruth::Rows* truth = truth_ ? &truth_->rows(slot) : nullptr;
  const std::uint16_t columns = column_mask(inside);
  for (int z = inside.min.z(); z < inside.end.z(); ++z) {
    for (int y = inside.min.y(); y < inside.end.y(); ++y) {
      const std::size_t row = row_in_tile(y, z);
      const unsigned visible = truth == nullptr ? 0U : (*truth)[row];
      const unsigned covered = tile->free_rows[row] & visible;
      const unsigned known = tile->known_rows[row] & columns;
      total.covered = static_cast<std::uint16_t>(total.covered + bits_of(covered));
      total.known = static_cast<std::uint16_t>(total.known + bits_of(known));
    }
  }
  return total;
}

void Scorer::record_coverage_times(double time_s) {
  const double now = coverage();
  const auto record = [&](double share, std::optional<double>& reached_s) {
    if (!reached_s.has_value() && now >= share) {
      reached_s = time_s;
    }
  };
  record(0.50, score_.t50_s);
  record(0.90, score_.t90_s);
  record(0.95, score_.t95_s);
  record(0.99, score_.t99_s);
}

void Scorer::record_volumes_before(double time_s) {
  const auto next_s = [&] {
    return kVolumePeriodS * static_cast<double>(score_.volume_over_time.size() + 1);
  };
  while (next_s() < time_s) {
    score_.volume_over_time.push_back({next_s(), explored_volume_m3()});
  }
  latest_s_ = std::max(latest_s_, time_s);
}

void Scorer::on_vehicle(Time time, const VehicleState& state) {
  record_volumes_before(to_seconds(time - start_));
  const double speed_mps = state.velocity_mps.norm();
  if (has_vehicle_) {
    assert(time >= last_time_);
    const double step_s = to_seconds(time - last_time_);
    score_.distance_m += (state.position_m - last_position_m_).norm();
    flown_s_ += step_s;
    speed_integral_ += speed_mps * step_s;
    squared_speed_integral_ += speed_mps * speed_mps * step_s;
  }
  has_vehicle_ = true;
  last_time_ = time;
  last_position_m_ = state.position_m;
  score_.speed_max_mps = std::max(score_.speed_max_mps, speed_mps);
  score_.yaw_rate_max_radps =
      std::max(score_.yaw_rate_max_radps, std::abs(heading_rate_radps(state)));
  judge_clearance(state.position_m);
}

void Scorer::judge_clearance(const Vector3d& position_m) {
  if (!forest_) {
    return;
  }
  // Nothing farther away than this can change the verdict, and a short search is a quick one.
  const double enough_m = std::max(min_clearance_m_, vehicle_radius_m_ + kContactReleaseM);
  const double clearance_m = forest_->distance_to_nearest_surface_m(position_m, enough_m);
  min_clearance_m_ = std::min(min_clearance_m_, clearance_m);
  if (!in_contact_ && clearance_m < vehicle_radius_m_) {
    in_contact_ = true;
    ++collisions_;
  } else if (clearance_m >= vehicle_radius_m_ + kContactReleaseM) {
    in_contact_ = false;
  }
}

double Scorer::coverage() const {
  return truth_ ? static_cast<double>(covered_voxels_) / static_cast<double>(truth_->voxel_count())
                : 0.0;
}

double Scorer::explored_volume_m3() const {
  const double resolution_m = geometry_.resolution_m();
  return static_cast<double>(known_voxels_) * resolution_m * resolution_m * resolution_m;
}

Score Scorer::score() const {
  Score score = score_;
  if (truth_) {
    score.coverage = coverage();
  }
  if (forest_) {
    score.collisions = collisions_;
  }
  score.explored_volume_m3 = explored_volume_m3();
  if (flown_s_ > 0.0) {
    score.speed_mean_mps = speed_integral_ / flown_s_;
    const double variance =
        squared_speed_integral_ / flown_s_ - score.speed_mean_mps * score.speed_mean_mps;
    score.speed_std_mps = std::sqrt(std::max(0.0, variance));
  }
  if (min_clearance_m_ < kClearanceHorizonM) {
    score.min_clearance_m = min_clearance_m_;
  }
  const double next_s = kVolumePeriodS * static_cast<double>(score.volume_over_time.size() + 1);
  if (next_s <= latest_s_) {  // the period ends with the mission
    score.volume_over_time.push_back({next_s, score.explored_volume_m3});
  }
  return score;
}

}  // namespace understory
