// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Where in an image a sphere may be seen. Optical frame, metres. Values only; nothing can fail.
#pragma once

#include "understory/sense/camera_model.hpp"

namespace understory {

// Half-open ranges of columns and rows, inside the image; empty when an end is not above its begin.
struct PixelRectangle {
  int u_begin = 0;
  int u_end = 0;
  int v_begin = 0;
  int v_end = 0;
};

// Holds every pixel whose ray meets the sphere in front of the camera, and not many others. Empty
// for a sphere that is not finite or all behind the camera.
[[nodiscard]] PixelRectangle pixels_of_sphere(const CameraModel& camera,
                                              const Vector3d& center_optical_m,
                                              double radius_m);

}  // namespace understory
