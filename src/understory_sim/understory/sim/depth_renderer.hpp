// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What a depth camera sees of the true world: trunks, meshes and the ground, cast ray by ray with
// Embree. World frame, metres; depths as camera_model.hpp has them, without noise. Surfaces are
// true to 1.5 mm; the ground lies 1 mm below z = 0, so that its returns fall into the voxels below
// a box that begins at z = 0 and not, by rounding, half of them inside. The same arguments give the
// same bits on one machine (Embree picks its instruction set, so the last bit may differ between
// processors). Constructing throws ForestError; rendering is thread-safe, cannot fail, and leaves
// the floating-point environment as it found it.
#pragma once

#include <memory>

#include "understory/sense/camera_model.hpp"
#include "understory/sim/forest.hpp"

namespace understory {

class EmbreeScene;

class DepthRenderer {
 public:
  explicit DepthRenderer(const Forest& forest);
  ~DepthRenderer();
  DepthRenderer(const DepthRenderer&) = delete;
  DepthRenderer& operator=(const DepthRenderer&) = delete;

  // The image at this pose, in the memory of `reused` where that suffices. From below the ground
  // nothing is measured: all NaN.
  [[nodiscard]] DepthImage render(const CameraModel& camera,
                                  const Pose& world_from_optical,
                                  DepthImage reused = {}) const;

 private:
  std::unique_ptr<const EmbreeScene> scene_;
};

}  // namespace understory
