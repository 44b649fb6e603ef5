// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Keeps team mates out of the map: what a depth image measured on them becomes "nothing measured",
// which neither marks nor clears a voxel. World frame, metres. Values only; nothing can fail, and a
// centre that is not finite masks nothing.
#pragma once

#include <vector>

#include "understory/sense/camera_model.hpp"

namespace understory::team {

// A pixel whose measured point lies within the radius of one of the centres becomes NaN. All other
// pixels stay as they are: what is seen in front of, beside and behind the team mates, and "no
// return". The radius is to hold the vehicle, how far its position may be wrong, and depth noise.
[[nodiscard]] DepthImage mask_teammates(DepthImage image,
                                        const CameraModel& camera,
                                        const Pose& world_from_optical,
                                        const std::vector<Vector3d>& centers_m,
                                        double radius_m);

}  // namespace understory::team
