// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/embree_scene.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

namespace understory {
namespace {

constexpr double kLargestGapM = 0.0015;       // between the prism's faces and the true cylinder
constexpr double kBelowGroundM = 0.1;         // trunks reach into the ground
constexpr const char* kDevice = "threads=1";  // building must not start a pool of threads

struct Quad {
  std::array<std::uint32_t, 4> corner;
};

void append_prism(const Trunk& trunk,
                  double top_m,
                  const Vector3d& origin_m,
                  std::vector<Eigen::Vector3f>& vertices,
                  std::vector<Quad>& quads) {
  const auto first = static_cast<std::uint32_t>(vertices.size());
  const auto sides = static_cast<std::uint32_t>(prism_sides(trunk.radius_m));
  for (std::uint32_t i = 0; i < sides; ++i) {
    const double angle_rad = 2.0 * kPi * i / sides;
    const Vector2d rim =
        trunk.center_m + trunk.radius_m * Vector2d(std::cos(angle_rad), std::sin(angle_rad));
    for (const double z_m : {-kBelowGroundM, top_m}) {
      vertices.emplace_back((Vector3d(rim.x(), rim.y(), z_m) - origin_m).cast<float>());
    }
  }
  const auto bottom = [&](std::uint32_t i) { return first + 2 * (i % sides); };
  const auto top = [&](std::uint32_t i) { return bottom(i) + 1; };
  for (std::uint32_t i = 0; i < sides; ++i) {
    quads.push_back({{bottom(i), bottom(i + 1), top(i + 1), top(i)}});
  }
  for (std::uint32_t i = 0; i + 1 < sides / 2; ++i) {  // the cap, in strips
    quads.push_back({{top(i), top(i + 1), top(sides - 2 - i), top(sides - 1 - i)}});
  }
}

Box2d extent_of(const Forest& forest) {
  Box2d extent;
  for (const Trunk& trunk : forest.trunks) {
    extent.extend(trunk.center_m);
  }
  for (const TriangleMesh& mesh : forest.meshes) {
    for (const Eigen::Vector3f& vertex : mesh.vertices_m) {
      extent.extend(Vector2d(vertex.head<2>().cast<double>()));
    }
  }
  return extent;
}

}  // namespace

int prism_sides(double radius_m) {
  const double cosine = 1.0 - kLargestGapM / radius_m;
  const double sides = cosine > 0.8 ? std::ceil(kPi / std::acos(cosine)) : 5.0;
  return 2 * static_cast<int>(std::ceil(0.5 * sides));
}

EmbreeScene::EmbreeScene(const Forest& forest, SceneContent content) {
  device_ = rtcNewDevice(kDevice);
  if (device_ == nullptr) {
    throw ForestError("ray casting: no Embree device");
  }
  scene_ = rtcNewScene(device_);
  try {
    const Box2d extent = extent_of(forest);
    if (!extent.isEmpty()) {
      origin_m_.head<2>() = extent.center();
    }
    rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_HIGH);
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);  // no rays slip between neighbouring faces
    if (content == SceneContent::kTrunksAndMeshes && !forest.trunks.empty()) {
      add_trunks(forest);
    }
    for (const TriangleMesh& mesh : forest.meshes) {
      add_mesh(mesh);
    }
    rtcCommitScene(scene_);
    check("building the scene");
  } catch (...) {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
    throw;
  }
}

EmbreeScene::~EmbreeScene() {
  rtcReleaseScene(scene_);
  rtcReleaseDevice(device_);
}

void EmbreeScene::add_trunks(const Forest& forest) {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<Quad> quads;
  for (const Trunk& trunk : forest.trunks) {
    append_prism(trunk, forest.trunk_height_m, origin_m_, vertices, quads);
  }
  RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_QUAD);
  auto* vertex_buffer =
      static_cast<Eigen::Vector3f*>(rtcSetNewGeometryBuffer(geometry,
                                                            RTC_BUFFER_TYPE_VERTEX,
                                                            0,
                                                            RTC_FORMAT_FLOAT3,
                                                            sizeof(Eigen::Vector3f),
                                                            vertices.size()));
  auto* index_buffer = static_cast<Quad*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT4, sizeof(Quad), quads.size()));
  if (vertex_buffer != nullptr && index_buffer != nullptr) {
    std::copy(vertices.begin(), vertices.end(), vertex_buffer);
    std::copy(quads.begin(), quads.end(), index_buffer);
  }
  attach(geometry);
}

void EmbreeScene::add_mesh(const TriangleMesh& mesh) {
  using Triangle = std::array<std::uint32_t, 3>;
  RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertex_buffer =
      static_cast<Eigen::Vector3f*>(rtcSetNewGeometryBuffer(geometry,
                                                            RTC_BUFFER_TYPE_VERTEX,
                                                            0,
                                                            RTC_FORMAT_FLOAT3,
                                                            sizeof(Eigen::Vector3f),
                                                            mesh.vertices_m.size()));
  auto* index_buffer = static_cast<Triangle*>(rtcSetNewGeometryBuffer(geometry,
                                                                      RTC_BUFFER_TYPE_INDEX,
                                                                      0,
                                                                      RTC_FORMAT_UINT3,
                                                                      sizeof(Triangle),
                                                                      mesh.triangles.size()));
  if (vertex_buffer != nullptr && index_buffer != nullptr) {
    std::transform(mesh.vertices_m.begin(),
                   mesh.vertices_m.end(),
                   vertex_buffer,
                   [&](const Eigen::Vector3f& vertex) { return to_scene(vertex.cast<double>()); });
    std::copy(mesh.triangles.begin(), mesh.triangles.end(), index_buffer);
  }
  attach(geometry);
}

void EmbreeScene::attach(RTCGeometry geometry) {
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene_, geometry);
  rtcReleaseGeometry(geometry);
  check("adding a surface");
}

void EmbreeScene::check(const char* action) const {
  const RTCError error = rtcGetDeviceError(device_);
  if (error != RTC_ERROR_NONE) {
    throw ForestError(std::string("ray casting: ") + action + " failed" +
                      (error == RTC_ERROR_OUT_OF_MEMORY ? ": out of memory" : ""));
  }
}

bool EmbreeScene::blocks(const Vector3d& from_world, const Vector3d& to_world) const {
  const Eigen::Vector3f origin = to_scene(from_world);
  const Eigen::Vector3f direction = to_scene(to_world) - origin;
  RTCRay ray{};
  ray.org_x = origin.x();
  ray.org_y = origin.y();
  ray.org_z = origin.z();
  ray.dir_x = direction.x();
  ray.dir_y = direction.y();
  ray.dir_z = direction.z();
  ray.tfar = 1.0F;
  ray.mask = ~0U;
  RTCIntersectContext context{};
  rtcInitIntersectContext(&context);
  rtcOccluded1(scene_, &context, &ray);
  return ray.tfar < 0.0F;  // Embree's mark of an occluded ray
}

}  // namespace understory
