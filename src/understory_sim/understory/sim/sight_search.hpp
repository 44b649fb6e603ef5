// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Which free voxels are in view from somewhere the vehicle can be. World frame, metres. Used by
// CoverageTruth only. Nothing can fail but memory.
#pragma once

#include <functional>

#include "understory/map/grid_geometry.hpp"
#include "understory/sense/camera_model.hpp"
#include "understory/sim/forest_truth.hpp"
#include "understory/sim/voxel_mask.hpp"

namespace understory {

struct SightProblem {
  const ForestTruth& truth;
  const GridGeometry& geometry;
  const CameraConfig& camera;
  const VoxelMask& free;       // where voxels may be seen
  const VoxelMask& reachable;  // where the vehicle may be
  double lowest_m;             // the vehicle's centre flies in this band
  double highest_m;
};

using VoxelAction = std::function<void(const VoxelIndex&)>;

// For trunks that pass through the whole box: the masks are one layer thick and stand for columns;
// sight lines are settled in the plane. `found` is called once for every visible voxel.
void find_visible_in_columns(const SightProblem& problem, const VoxelAction& found);

// For any world, by ray casting; viewing places are every second voxel.
void find_visible_by_rays(const SightProblem& problem, const VoxelAction& found);

}  // namespace understory
