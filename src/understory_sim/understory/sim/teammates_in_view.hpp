// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Team mates as the simulated camera sees them: spheres put into a rendered depth image, before
// noise. World frame, metres; depths as camera_model.hpp has them. Values only; nothing can fail.
#pragma once

#include <vector>

#include "understory/sense/camera_model.hpp"

namespace understory {

// The nearer of what was there and the spheres, within range. NaN stays NaN. A sphere that holds
// the camera, or whose centre is not finite, is not seen.
[[nodiscard]] DepthImage add_teammates(DepthImage image,
                                       const CameraModel& camera,
                                       const Pose& world_from_optical,
                                       const std::vector<Vector3d>& centers_m,
                                       double radius_m);

}  // namespace understory
