// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/depth_noise.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace understory {
namespace {

constexpr double kNearestM = 0.01;

}  // namespace

DepthImage add_noise(DepthImage image, const DepthNoiseConfig& config, Rng& rng) {
  const bool blurs = config.deviation_at_1m_m > 0.0;
  const bool drops = config.dropout_probability > 0.0;
  if (!blurs && !drops) {
    return image;
  }
  for (float& z_m : image.z_m) {
    if (drops && rng.uniform() < config.dropout_probability) {
      z_m = std::numeric_limits<float>::quiet_NaN();
    } else if (blurs && std::isfinite(z_m)) {
      const double true_m = static_cast<double>(z_m);
      const double noisy_m = true_m + config.deviation_at_1m_m * true_m * true_m * rng.normal();
      z_m = static_cast<float>(std::max(noisy_m, kNearestM));
    }
  }
  return image;
}

}  // namespace understory
