// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What moves, as a map sees it: returns in the midst of space that earlier clouds have shown to be
// free. Occupancy needs several returns in one voxel before it believes them, and what flies by is
// in none for that long. World frame, metres. A pure function; cannot fail.
#pragma once

#include <vector>

#include "understory/map/map_snapshot.hpp"
#include "understory/map/scan_window.hpp"

namespace understory {

// One point, the middle of what is seen of it, for each thing; in the order of the map's voxels.
// `before`: the map without this cloud.
[[nodiscard]] std::vector<Vector3d> intruders_in(const ScanWindow& cloud,
                                                 const MapSnapshot& before);

}  // namespace understory
