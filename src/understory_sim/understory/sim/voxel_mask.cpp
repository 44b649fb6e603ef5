// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/voxel_mask.hpp"

#include <algorithm>
#include <cmath>

namespace understory {
namespace {

Box3d box_of(const GridGeometry& geometry, const VoxelIndex& voxel) {
  const Vector3d min_m = voxel.cast<double>() * geometry.resolution_m();
  return {min_m, min_m + Vector3d::Constant(geometry.resolution_m())};
}

VoxelBox voxels_around(const GridGeometry& geometry, const Box3d& region_m, const VoxelBox& box) {
  // Clamped before the conversion: a trunk may be farther away than an int reaches.
  const Box3d all = geometry.box_m();
  const Vector3d low = region_m.min().cwiseMax(all.min()).cwiseMin(all.max());
  const Vector3d high = region_m.max().cwiseMax(all.min()).cwiseMin(all.max());
  const VoxelIndex end = geometry.index_of(high).array() + 1;
  return VoxelBox{geometry.index_of(low), end}.clipped_to(box);
}

void remove_trunk(const Trunk& trunk,
                  double height_m,
                  const GridGeometry& geometry,
                  VoxelMask& free) {
  const Vector3d reach(trunk.radius_m, trunk.radius_m, 0.0);
  const Vector3d foot(trunk.center_m.x(), trunk.center_m.y(), geometry.box_m().min().z());
  const Vector3d top(trunk.center_m.x(), trunk.center_m.y(), height_m);
  if (height_m <= foot.z()) {
    return;
  }
  for_each_voxel(
      voxels_around(geometry, {foot - reach, top + reach}, free.box()),
      [&](const VoxelIndex& voxel) {
        const Box3d cell = box_of(geometry, voxel);
        const Box2d square(Vector2d(cell.min().head<2>()), Vector2d(cell.max().head<2>()));
        if (cell.min().z() < height_m &&
            square.squaredExteriorDistance(trunk.center_m) < trunk.radius_m * trunk.radius_m) {
          free.set(voxel, false);
        }
      });
}

void remove_mesh(const TriangleMesh& mesh, const GridGeometry& geometry, VoxelMask& free) {
  for (const std::array<std::uint32_t, 3>& triangle : mesh.triangles) {
    std::array<Vector3d, 3> corners;
    Box3d bounds;
    for (std::size_t i = 0; i < 3; ++i) {
      corners[i] = mesh.vertices_m[triangle[i]].cast<double>();
      bounds.extend(corners[i]);
    }
    if (!bounds.intersects(geometry.box_m())) {
      continue;
    }
    for_each_voxel(voxels_around(geometry, bounds, free.box()), [&](const VoxelIndex& voxel) {
      if (free.contains(voxel) && triangle_meets_box(corners, box_of(geometry, voxel))) {
        free.set(voxel, false);
      }
    });
  }
}

// Along this axis the triangle's and the box's shadows do not overlap; both around the box's
// centre.
bool is_separated(const Vector3d& axis,
                  const std::array<Vector3d, 3>& corners,
                  const Vector3d& half) {
  const double a = axis.dot(corners[0]);
  const double b = axis.dot(corners[1]);
  const double c = axis.dot(corners[2]);
  const double reach = axis.cwiseAbs().dot(half);
  return std::min({a, b, c}) > reach || std::max({a, b, c}) < -reach;
}

}  // namespace

// Separating axes: Akenine-Moeller 2001, "Fast 3D triangle-box overlap testing".
bool triangle_meets_box(const std::array<Vector3d, 3>& corners, const Box3d& box) {
  const Vector3d half = 0.5 * box.sizes();
  const std::array<Vector3d, 3> local = {
      corners[0] - box.center(), corners[1] - box.center(), corners[2] - box.center()};
  const std::array<Vector3d, 3> edges = {
      local[1] - local[0], local[2] - local[1], local[0] - local[2]};
  if (is_separated(edges[0].cross(edges[1]), local, half)) {
    return false;
  }
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3d unit = Vector3d::Unit(axis);
    if (is_separated(unit, local, half)) {
      return false;
    }
    for (const Vector3d& edge : edges) {
      if (is_separated(unit.cross(edge), local, half)) {
        return false;
      }
    }
  }
  return true;
}

VoxelMask free_voxels(const Forest& forest, const GridGeometry& geometry, const VoxelBox& box) {
  VoxelMask free(box, true);
  for (const Trunk& trunk : forest.trunks) {
    remove_trunk(trunk, forest.trunk_height_m, geometry, free);
  }
  for (const TriangleMesh& mesh : forest.meshes) {
    remove_mesh(mesh, geometry, free);
  }
  return free;
}

VoxelMask flooded(const VoxelBox& box,
                  const std::vector<VoxelIndex>& seeds,
                  const std::function<bool(const VoxelIndex&)>& admits) {
  VoxelMask asked(box, false);
  VoxelMask reached(box, false);
  std::vector<VoxelIndex> open;
  const auto visit = [&](const VoxelIndex& voxel) {
    if (box.contains(voxel) && !asked.contains(voxel)) {
      asked.set(voxel, true);
      if (admits(voxel)) {
        reached.set(voxel, true);
        open.push_back(voxel);
      }
    }
  };
  for (const VoxelIndex& seed : seeds) {
    visit(seed);
  }
  while (!open.empty()) {
    const VoxelIndex voxel = open.back();
    open.pop_back();
    for (int axis = 0; axis < 3; ++axis) {
      visit(voxel + VoxelIndex::Unit(axis));
      visit(voxel - VoxelIndex::Unit(axis));
    }
  }
  return reached;
}

}  // namespace understory
