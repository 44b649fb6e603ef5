// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What is truly where, for collisions and scoring; the planner never sees it. World frame, metres.
// Trunks are exact cylinders (from the ground to their height), meshes are searched with Embree.
// The ground is no obstacle here: the vehicle starts and lands on it. Immutable, any thread.
// Constructing throws ForestError.
#pragma once

#include <memory>

#include "understory/base/geometry.hpp"
#include "understory/sim/forest.hpp"
#include "understory/sim/trunk_index.hpp"

namespace understory {

class EmbreeScene;

class ForestTruth {
 public:
  explicit ForestTruth(Forest forest);
  ~ForestTruth();
  ForestTruth(const ForestTruth&) = delete;
  ForestTruth& operator=(const ForestTruth&) = delete;

  [[nodiscard]] const Forest& forest() const { return forest_; }
  [[nodiscard]] const TrunkIndex& trunks() const { return trunks_; }

  // Negative inside a trunk; never negative for meshes, which need not be closed. `max_m` when
  // nothing is nearer than that: a small one makes the search quick.
  [[nodiscard]] double distance_to_nearest_surface_m(const Vector3d& p_world, double max_m) const;

 private:
  Forest forest_;
  TrunkIndex trunks_;
  std::unique_ptr<const EmbreeScene> meshes_;  // null without meshes
};

}  // namespace understory
