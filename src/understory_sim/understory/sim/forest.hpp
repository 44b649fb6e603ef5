// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// The true world: vertical trunks and, optionally, triangle meshes, above a ground plane at z = 0.
// World frame, metres. The same value drives rendering, collision truth and scoring. Reading and
// generating throw ForestError with one line that names file and line or key.
#pragma once

#include <array>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "understory/base/config.hpp"
#include "understory/base/geometry.hpp"

namespace understory {

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

}  // namespace understory
