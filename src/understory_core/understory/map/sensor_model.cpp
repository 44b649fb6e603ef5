// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/map/sensor_model.hpp"

#include <cmath>

namespace understory {
namespace {

int quantised(double probability) {
  return static_cast<int>(std::lround(log_odds_of(probability) / SensorModel::kLogOddsUnit));
}

}  // namespace

double log_odds_of(double probability) {
  return std::log(probability / (1.0 - probability));
}

SensorModel::SensorModel(const SensorModelConfig& config)
    : hit(quantised(config.hit_probability)),
      miss(quantised(config.miss_probability)),
      min(quantised(config.min_probability)),
      max(quantised(config.max_probability)),
      occupied_threshold(
          static_cast<int>(std::ceil(log_odds_of(config.occupied_probability) / kLogOddsUnit))) {
  if (min <= kUnknownLogOdds || max > 127 || occupied_threshold > max) {
    throw ConfigError(
        "map.sensor: occupied_probability must lie below max_probability, clamps within one byte");
  }
}

}  // namespace understory
