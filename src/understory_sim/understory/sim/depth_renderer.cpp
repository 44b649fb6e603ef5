// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/depth_renderer.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cfenv>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "understory/sim/embree_scene.hpp"

namespace understory {
namespace {

constexpr double kGroundM = -0.001;
constexpr float kInfinity = std::numeric_limits<float>::infinity();

// Packets of 4 x 4 neighbouring pixels, for Embree's widest kernel and coherent traversal.
constexpr int kTilePx = 4;
constexpr std::size_t kLanes = 16;
using Lanes = std::array<float, kLanes>;

// Rounding and denormals as the standard has them, whatever the caller flies with, and the caller's
// state back afterwards. Embree's advice to flush denormals gained nothing measurable here.
class DefaultFloatEnvironment {
 public:
  DefaultFloatEnvironment() {
    std::fegetenv(&callers_);
    std::fesetenv(FE_DFL_ENV);
  }
  ~DefaultFloatEnvironment() { std::fesetenv(&callers_); }
  DefaultFloatEnvironment(const DefaultFloatEnvironment&) = delete;
  DefaultFloatEnvironment& operator=(const DefaultFloatEnvironment&) = delete;

 private:
  std::fenv_t callers_{};
};

struct View {
  Eigen::Matrix3f world_from_optical;
  Eigen::Vector3f origin;  // in the scene
  float height_m;          // above the ground
  float max_range_m;
};

// Optical x and y per unit of optical z, so that a ray's parameter is the depth. Padded to tiles.
struct PixelDirections {
  std::vector<float> x_of_column;
  std::vector<float> y_of_row;

  explicit PixelDirections(const CameraModel& camera) {
    for (int u = 0; u < camera.width_px + kTilePx; ++u) {
      x_of_column.push_back(static_cast<float>((u - camera.cx) / camera.fx));
    }
    for (int v = 0; v < camera.height_px + kTilePx; ++v) {
      y_of_row.push_back(static_cast<float>((v - camera.cy) / camera.fy));
    }
  }
};

struct Tile {
  Lanes x{};
  Lanes y{};
  Lanes no_hit_z_m{};  // depth where no surface is hit: the ground's, or infinity
};

Tile tile_at(const PixelDirections& directions, int u0, int v0) {
  Tile tile;
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    tile.x[lane] = directions.x_of_column[static_cast<std::size_t>(u0) + lane % kTilePx];
    tile.y[lane] = directions.y_of_row[static_cast<std::size_t>(v0) + lane / kTilePx];
  }
  return tile;
}

void prepare(const View& view, Tile& tile, RTCRayHit16& packet) {
  const Eigen::Matrix3f& r = view.world_from_optical;
  RTCRay16& ray = packet.ray;
  for (std::size_t i = 0; i < kLanes; ++i) {
    const float x = tile.x[i];
    const float y = tile.y[i];
    ray.org_x[i] = view.origin.x();
    ray.org_y[i] = view.origin.y();
    ray.org_z[i] = view.origin.z();
    ray.tnear[i] = 0.0F;
    ray.dir_x[i] = r(0, 0) * x + r(0, 1) * y + r(0, 2);
    ray.dir_y[i] = r(1, 0) * x + r(1, 1) * y + r(1, 2);
    ray.dir_z[i] = r(2, 0) * x + r(2, 1) * y + r(2, 2);
    const float range_z_m = view.max_range_m / std::sqrt(x * x + y * y + 1.0F);
    const float ground_z_m = ray.dir_z[i] < 0.0F ? -view.height_m / ray.dir_z[i] : kInfinity;
    tile.no_hit_z_m[i] = ground_z_m <= range_z_m ? ground_z_m : kInfinity;
    ray.tfar[i] = std::min(range_z_m, ground_z_m);
    packet.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
  }
}

// Lanes of a tile that lie within the image.
void mark_valid(const CameraModel& camera, int u0, int v0, std::array<int, kLanes>& valid) {
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const bool inside = u0 + static_cast<int>(lane) % kTilePx < camera.width_px &&
                        v0 + static_cast<int>(lane) / kTilePx < camera.height_px;
    valid[lane] = inside ? -1 : 0;
  }
}

void store(const RTCRayHit16& packet, const Tile& tile, int u0, int v0, DepthImage& image) {
  const auto columns = static_cast<std::size_t>(std::min(kTilePx, image.width_px - u0));
  const auto rows = static_cast<std::size_t>(std::min(kTilePx, image.height_px - v0));
  const auto width = static_cast<std::size_t>(image.width_px);
  float* out =
      image.z_m.data() + static_cast<std::size_t>(v0) * width + static_cast<std::size_t>(u0);
  for (std::size_t row = 0; row < rows; ++row) {
    for (std::size_t column = 0; column < columns; ++column) {
      const std::size_t lane = row * kTilePx + column;
      out[row * width + column] = packet.hit.geomID[lane] != RTC_INVALID_GEOMETRY_ID
                                      ? packet.ray.tfar[lane]
                                      : tile.no_hit_z_m[lane];
    }
  }
}

}  // namespace

DepthRenderer::DepthRenderer(const Forest& forest)
    : scene_(std::make_unique<EmbreeScene>(forest, SceneContent::kTrunksAndMeshes)) {}

DepthRenderer::~DepthRenderer() = default;

DepthImage DepthRenderer::render(const CameraModel& camera,
                                 const Pose& world_from_optical,
                                 DepthImage reused) const {
  assert(world_from_optical.matrix().allFinite());
  DepthImage image = std::move(reused);
  image.width_px = camera.width_px;
  image.height_px = camera.height_px;
  image.z_m.resize(static_cast<std::size_t>(camera.width_px) *
                   static_cast<std::size_t>(camera.height_px));
  const double height_m = world_from_optical.translation().z() - kGroundM;
  if (height_m <= 0.0) {
    std::fill(image.z_m.begin(), image.z_m.end(), std::numeric_limits<float>::quiet_NaN());
    return image;
  }

  const DefaultFloatEnvironment environment;
  const PixelDirections directions(camera);
  const View view{world_from_optical.linear().cast<float>(),
                  scene_->to_scene(world_from_optical.translation()),
                  static_cast<float>(height_m),
                  static_cast<float>(camera.max_range_m)};
  RTCIntersectContext context{};
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  alignas(64) RTCRayHit16 packet{};
  std::fill(std::begin(packet.ray.mask), std::end(packet.ray.mask), ~0U);
  alignas(64) std::array<int, kLanes> valid{};
  for (int v = 0; v < camera.height_px; v += kTilePx) {
    for (int u = 0; u < camera.width_px; u += kTilePx) {
      Tile tile = tile_at(directions, u, v);
      prepare(view, tile, packet);
      mark_valid(camera, u, v, valid);
      rtcIntersect16(valid.data(), scene_->handle(), &context, &packet);
      store(packet, tile, u, v, image);
    }
  }
  return image;
}

}  // namespace understory
