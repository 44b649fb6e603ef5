// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Clamped log-odds occupancy (Moravec and Elfes 1985, with OctoMap's clamping, Hornung et al.
// 2013), quantised to one signed byte. Probabilities come from configuration; an inconsistent set
// throws ConfigError at start.
#pragma once

#include <cstdint>

#include "understory/base/config.hpp"
#include "understory/map/tile.hpp"

namespace understory {

struct SensorModelConfig {
  double hit_probability = 0.65;
  double miss_probability = 0.35;
  double min_probability = 0.12;
  double max_probability = 0.90;
  double occupied_probability = 0.80;

  void visit(FieldVisitor& f) {
    f.field("hit_probability", hit_probability, in_range(0.51, 0.99), "occupied, given a return");
    f.field(
        "miss_probability", miss_probability, in_range(0.01, 0.49), "occupied, given a ray passed");
    f.field("min_probability", min_probability, in_range(0.02, 0.49), "lower clamp");
    f.field("max_probability", max_probability, in_range(0.51, 0.98), "upper clamp");
    f.field(
        "occupied_probability", occupied_probability, in_range(0.5, 0.97), "occupied above this");
  }
};

class SensorModel {
 public:
  // One unit of a stored log-odds: ln(0.65 / 0.35) / 20, so that the default hit is exactly 20.
  static constexpr double kLogOddsUnit = 0.030951960420311175;

  explicit SensorModel(const SensorModelConfig& config);

  int hit;   // added by a return
  int miss;  // added by a passing ray, negative
  int min;   // clamps
  int max;
  int occupied_threshold;  // occupied at or above

  [[nodiscard]] VoxelState state_of(std::int8_t log_odds) const {
    if (log_odds == kUnknownLogOdds) {
      return VoxelState::kUnknown;
    }
    if (log_odds < 0) {
      return VoxelState::kFree;
    }
    return log_odds >= occupied_threshold ? VoxelState::kOccupied : VoxelState::kUncertain;
  }
};

[[nodiscard]] double log_odds_of(double probability);

}  // namespace understory
