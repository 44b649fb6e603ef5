// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Traces rays through a scan window's voxels (Amanatides and Woo 1987, visiting the voxels that
// octomap::OcTree::computeRayKeys visits). World frame, metres. Used by one thread; nothing here
// can fail.
#pragma once

#include "understory/map/scan_window.hpp"

namespace understory {

class RayMarker {
 public:
  RayMarker(const GridGeometry& geometry,
            const Vector3d& origin_m,
            double max_range_m,
            ScanWindow& window);

  // `ray_m` leads from the origin to the return, finite and not zero. Within range its end is hit;
  // beyond, the ray clears up to the range.
  void mark(const Vector3d& ray_m);

  // Nothing met within range; `direction` need not be of unit length.
  void mark_no_return(const Vector3d& direction);

 private:
  // Misses from the origin's voxel up to, but without, the one that holds the end.
  void mark_passed(const Vector3d& end_vox);

  Vector3d origin_vox_;
  double inverse_resolution_;
  double max_range_m_;
  ScanWindow& window_;
};

}  // namespace understory
