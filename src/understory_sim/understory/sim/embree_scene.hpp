// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// A forest's surfaces as a static Embree scene; only the .cpp files of this folder include this.
// Trunks are prisms inscribed in the true cylinder, at most 1.5 mm inside it, so that no return
// falls into space that is truly free. The ground is not in it. Queries are thread-safe; building
// throws ForestError (out of memory).
#pragma once

#include <embree3/rtcore.h>

#include "understory/base/geometry.hpp"
#include "understory/sim/forest.hpp"

namespace understory {

enum class SceneContent { kTrunksAndMeshes, kMeshes };

class EmbreeScene {
 public:
  EmbreeScene(const Forest& forest, SceneContent content);
  ~EmbreeScene();
  EmbreeScene(const EmbreeScene&) = delete;
  EmbreeScene& operator=(const EmbreeScene&) = delete;

  [[nodiscard]] RTCScene handle() const { return scene_; }

  // Embree computes in single precision: the scene lies around its own origin, not the world's.
  [[nodiscard]] Eigen::Vector3f to_scene(const Vector3d& p_world) const {
    return (p_world - origin_m_).cast<float>();
  }

  // True when a surface lies between the two points.
  [[nodiscard]] bool blocks(const Vector3d& from_world, const Vector3d& to_world) const;

 private:
  void add_trunks(const Forest& forest);
  void add_mesh(const TriangleMesh& mesh);
  void attach(RTCGeometry geometry);
  void check(const char* action) const;

  RTCDevice device_ = nullptr;
  RTCScene scene_ = nullptr;
  Vector3d origin_m_ = Vector3d::Zero();
};

// Sides of the prism that stands for a trunk.
[[nodiscard]] int prism_sides(double radius_m);

}  // namespace understory
