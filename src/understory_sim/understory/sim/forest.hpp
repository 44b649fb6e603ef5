// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// The true world: vertical trunks and, optionally, triangle meshes, above a ground plane at z = 0.
// World frame, metres. The same value drives rendering, collision truth and scoring. Reading and
// generating throw ForestError with one line that names file and line or key.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "understory/base/config.hpp"
#include "understory/base/geometry.hpp"

namespace understory {

using Box2d = Eigen::AlignedBox2d;

class ForestError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct Trunk {
  Vector2d center_m;
  double radius_m;
};

struct TriangleMesh {
  std::vector<Eigen::Vector3f> vertices_m;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

struct Forest {
  std::vector<Trunk> trunks;
  double trunk_height_m = 3.0;
  std::vector<TriangleMesh> meshes;
};

// What touches the rectangle: trunks by their disc, triangles by their bounding box. Nothing moves.
[[nodiscard]] Forest crop(const Forest& forest, const Box2d& rectangle_m);

[[nodiscard]] Forest shifted(const Forest& forest, const Vector2d& offset_m);

// The scene made of a real stand: cropped, then shifted so that the rectangle's centre is (0, 0).
[[nodiscard]] Forest centered_crop(const Forest& forest, const Box2d& rectangle_m);

// The point nearest to `near_m` that keeps `clearance_m` (at least 0) to every trunk's surface and
// to the sides of the box; none when there is no such point. Exact, meshes are not looked at.
[[nodiscard]] std::optional<Vector2d> nearest_clear_point(const Forest& forest,
                                                          const Box2d& box_m,
                                                          const Vector2d& near_m,
                                                          double clearance_m);

}  // namespace understory
