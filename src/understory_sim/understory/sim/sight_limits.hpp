// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// From where a level vehicle that may turn to any heading can have a point within its camera's
// range and vertical field of view. World frame, metres. Values; nothing can fail.
#pragma once

#include <vector>

#include "understory/map/grid_geometry.hpp"
#include "understory/sense/camera_model.hpp"

namespace understory {

// Of a point's height above the vehicle's centre; empty when low_m > high_m.
struct RiseInterval {
  double low_m;
  double high_m;

  [[nodiscard]] bool empty() const { return low_m > high_m; }
};

// The rises at which a point this far away horizontally is in view.
[[nodiscard]] RiseInterval visible_rise(const CameraConfig& camera, double horizontal_m);

// From a voxel's column to a vehicle's.
struct ViewingOffset {
  int dx;
  int dy;
  double distance_m;
  RiseInterval rise;
};

// All columns on a grid of `stride` voxels from which something may be in view: those first that
// see the widest band of heights, the nearest first among equals.
[[nodiscard]] std::vector<ViewingOffset> viewing_offsets(const CameraConfig& camera,
                                                         double resolution_m,
                                                         int stride,
                                                         double widest_band_m);

}  // namespace understory
