// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/forest_truth.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "understory/sim/embree_scene.hpp"

namespace understory {
namespace {

// Ericson, Real-Time Collision Detection (2005), section 5.1.5.
Vector3d closest_on_triangle(const Vector3d& p,
                             const Vector3d& a,
                             const Vector3d& b,
                             const Vector3d& c) {
  const Vector3d ab = b - a;
  const Vector3d ac = c - a;
  const double d1 = ab.dot(p - a);
  const double d2 = ac.dot(p - a);
  if (d1 <= 0.0 && d2 <= 0.0) {
    return a;
  }
  const double d3 = ab.dot(p - b);
  const double d4 = ac.dot(p - b);
  if (d3 >= 0.0 && d4 <= d3) {
    return b;
  }
  const double d5 = ab.dot(p - c);
  const double d6 = ac.dot(p - c);
  if (d6 >= 0.0 && d5 <= d6) {
    return c;
  }
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) {
    return a + d1 / (d1 - d3) * ab;
  }
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) {
    return a + d2 / (d2 - d6) * ac;
  }
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0) {
    return b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b);
  }
  return a + (vb * ab + vc * ac) / (va + vb + vc);
}

struct MeshSearch {
  const Forest* forest;
  Vector3d p_world;
  double best_m;
};

// Called by Embree for every triangle whose box lies within the current radius.
bool visit_triangle(RTCPointQueryFunctionArguments* arguments) {
  auto& search = *static_cast<MeshSearch*>(arguments->userPtr);
  const TriangleMesh& mesh = search.forest->meshes[arguments->geomID];
  const std::array<std::uint32_t, 3>& triangle = mesh.triangles[arguments->primID];
  const Vector3d nearest = closest_on_triangle(search.p_world,
                                               mesh.vertices_m[triangle[0]].cast<double>(),
                                               mesh.vertices_m[triangle[1]].cast<double>(),
                                               mesh.vertices_m[triangle[2]].cast<double>());
  const double distance_m = (search.p_world - nearest).norm();
  if (distance_m >= search.best_m) {
    return false;
  }
  search.best_m = distance_m;
  arguments->query->radius = std::min(arguments->query->radius, static_cast<float>(distance_m));
  return true;
}

double mesh_distance_m(const EmbreeScene& scene,
                       const Forest& forest,
                       const Vector3d& p_world,
                       double max_m) {
  MeshSearch search{&forest, p_world, max_m};
  const Eigen::Vector3f p_scene = scene.to_scene(p_world);
  RTCPointQuery query{};
  query.x = p_scene.x();
  query.y = p_scene.y();
  query.z = p_scene.z();
  query.radius = static_cast<float>(max_m);
  RTCPointQueryContext context{};
  rtcInitPointQueryContext(&context);
  rtcPointQuery(scene.handle(), &query, &context, visit_triangle, &search);
  return search.best_m;
}

// To a cylinder's surface, from the horizontal distance to its side and the height above its top.
double cylinder_distance_m(double beside_m, double above_m) {
  if (beside_m <= 0.0 && above_m <= 0.0) {
    return std::max(beside_m, above_m);
  }
  return std::hypot(std::max(beside_m, 0.0), std::max(above_m, 0.0));
}

}  // namespace

ForestTruth::ForestTruth(Forest forest) : forest_(std::move(forest)), trunks_(forest_.trunks) {
  if (!forest_.meshes.empty()) {
    meshes_ = std::make_unique<EmbreeScene>(forest_, SceneContent::kMeshes);
  }
}

ForestTruth::~ForestTruth() = default;

double ForestTruth::distance_to_nearest_surface_m(const Vector3d& p_world, double max_m) const {
  assert(p_world.allFinite() && max_m >= 0.0);
  const double above_m = p_world.z() - forest_.trunk_height_m;
  double best_m = max_m;
  if (above_m < max_m) {
    const double beside_m = trunks_.distance_m(p_world.head<2>(), max_m);
    best_m = std::min(best_m, cylinder_distance_m(beside_m, above_m));
  }
  if (meshes_ != nullptr && best_m > 0.0) {
    best_m = std::min(best_m, mesh_distance_m(*meshes_, forest_, p_world, best_m));
  }
  return best_m;
}

}  // namespace understory
