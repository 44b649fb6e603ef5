// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Errors of a stereo depth camera: deviation growing with the square of the depth, and pixels
// without a measurement. Depths as camera_model.hpp has them. The same image, configuration and
// Rng state give the same result; nothing can fail.
#pragma once

#include "understory/base/config.hpp"
#include "understory/base/rng.hpp"
#include "understory/sense/camera_model.hpp"

namespace understory {

struct DepthNoiseConfig {
  double deviation_at_1m_m = 0.0;
  double dropout_probability = 0.0;

  void visit(FieldVisitor& f) {
    f.field("deviation_at_1m_m",
            deviation_at_1m_m,
            in_range(0.0, 0.1),
            "standard deviation of a depth of 1 m; grows with the square of the depth");
    f.field("dropout_probability",
            dropout_probability,
            in_range(0.0, 1.0),
            "share of the pixels that measure nothing");
  }
};

// A return stays a return and in front of the camera; no return stays no return; NaN stays NaN.
[[nodiscard]] DepthImage add_noise(DepthImage image, const DepthNoiseConfig& config, Rng& rng);

}  // namespace understory
