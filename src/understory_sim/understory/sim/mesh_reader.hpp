// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Triangle meshes (terrain, scanned trees) from PLY, OBJ and STL files, into the world frame in
// metres. Polygons become fans of triangles, so they have to be convex. Everything wrong (missing
// file, other format, no triangle, a vertex that is not finite or farther than 100 km) throws
// ForestError naming the file.
#pragma once

#include <string>

#include "understory/sim/forest.hpp"

namespace understory {

enum class UpAxis { kY, kZ };  // of the file; the formats themselves do not say

struct MeshImport {
  double metres_per_unit = 1.0;
  UpAxis up_axis = UpAxis::kZ;
};

[[nodiscard]] TriangleMesh read_mesh(const std::string& path, const MeshImport& import = {});

}  // namespace understory
