// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "support/synthetic_scene.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "understory/base/rng.hpp"

namespace understory::test {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kGapM = 0.8;
constexpr double kFlightClearanceM = 0.4;
constexpr double kFrameStepM = 2.0 / 15.0;

double distance_to_trunk_m(const RoundTrunk& trunk, const Vector3d& from_m, const Vector3d& ray) {
  const Vector2d offset = from_m.head<2>() - trunk.center_m;
  const double a = ray.head<2>().squaredNorm();
  const double half_b = offset.dot(ray.head<2>());
  const double c = offset.squaredNorm() - trunk.radius_m * trunk.radius_m;
  const double discriminant = half_b * half_b - a * c;
  if (a <= 0.0 || discriminant < 0.0 || half_b > 0.0) {
    return kInfinity;
  }
  return (-half_b - std::sqrt(discriminant)) / a;
}

Vector3d pixel_ray(const CameraModel& camera, int u, int v) {
  return {(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1.0};
}

}  // namespace

double SyntheticScene::distance_m(const Vector3d& from_m, const Vector3d& direction) const {
  double nearest_m = kInfinity;
  if (direction.z() < 0.0) {
    nearest_m = (ground_z_m - from_m.z()) / direction.z();
  }
  for (const RoundTrunk& trunk : trunks) {
    nearest_m = std::min(nearest_m, distance_to_trunk_m(trunk, from_m, direction));
  }
  return nearest_m;
}

bool SyntheticScene::inside_a_trunk(const Vector3d& point_m) const {
  return std::any_of(trunks.begin(), trunks.end(), [&](const RoundTrunk& trunk) {
    return (point_m.head<2>() - trunk.center_m).norm() < trunk.radius_m;
  });
}

SyntheticScene seeded_forest(double edge_m, double trunks_per_m2, std::uint64_t seed) {
  Rng rng(seed);
  SyntheticScene scene;
  const auto wanted = static_cast<std::size_t>(std::lround(edge_m * edge_m * trunks_per_m2));
  for (std::size_t attempt = 0; attempt < 200 * wanted && scene.trunks.size() < wanted; ++attempt) {
    const double x_m = rng.uniform(0.0, edge_m);
    const double y_m = rng.uniform(0.0, edge_m);
    const RoundTrunk trunk{{x_m, y_m}, rng.uniform(0.1, 0.3)};
    const bool fits =
        std::all_of(scene.trunks.begin(), scene.trunks.end(), [&](const RoundTrunk& other) {
          return (trunk.center_m - other.center_m).norm() > trunk.radius_m + other.radius_m + kGapM;
        });
    if (fits) {
      scene.trunks.push_back(trunk);
    }
  }
  return scene;
}

DepthImage render(const SyntheticScene& scene,
                  const CameraModel& camera,
                  const Pose& world_from_optical) {
  const Vector3d eye_m = world_from_optical.translation();
  SyntheticScene in_reach;
  in_reach.ground_z_m = scene.ground_z_m;
  std::copy_if(scene.trunks.begin(),
               scene.trunks.end(),
               std::back_inserter(in_reach.trunks),
               [&](const RoundTrunk& trunk) {
                 return (trunk.center_m - eye_m.head<2>()).norm() <
                        camera.max_range_m + trunk.radius_m;
               });
  DepthImage image;
  image.width_px = camera.width_px;
  image.height_px = camera.height_px;
  for (int v = 0; v < camera.height_px; ++v) {
    for (int u = 0; u < camera.width_px; ++u) {
      const Vector3d ray = pixel_ray(camera, u, v);
      const Vector3d direction = world_from_optical.linear() * ray.normalized();
      const double distance_m = in_reach.distance_m(eye_m, direction);
      image.z_m.push_back(distance_m <= camera.max_range_m
                              ? static_cast<float>(distance_m / ray.norm())
                              : std::numeric_limits<float>::infinity());
    }
  }
  return image;
}

std::vector<Pose> flight_through(const SyntheticScene& scene,
                                 double edge_m,
                                 double height_m,
                                 std::size_t frames) {
  const CameraConfig mount;
  std::vector<Pose> poses;
  Vector2d position_m = Vector2d::Constant(0.5 * edge_m);
  double yaw_rad = 0.3;
  const auto is_clear = [&](const Vector2d& point_m) {
    const bool inside = (point_m.array() > 1.0).all() && (point_m.array() < edge_m - 1.0).all();
    return inside && std::all_of(scene.trunks.begin(), scene.trunks.end(), [&](const auto& trunk) {
             return (point_m - trunk.center_m).norm() > trunk.radius_m + kFlightClearanceM;
           });
  };
  while (!is_clear(position_m)) {
    position_m.x() += 0.1;
  }
  while (poses.size() < frames) {
    const double drift_rad = 0.03 * std::sin(0.05 * static_cast<double>(poses.size()));
    const Vector2d ahead_m =
        position_m + kFrameStepM * Vector2d(std::cos(yaw_rad), std::sin(yaw_rad));
    if (is_clear(ahead_m)) {
      position_m = ahead_m;
      yaw_rad += drift_rad;
    } else {
      yaw_rad += 0.12;
    }
    poses.push_back(level_pose({position_m.x(), position_m.y(), height_m}, yaw_rad) *
                    body_from_optical(mount));
  }
  return poses;
}

std::vector<float> to_points(const DepthImage& image,
                             const CameraModel& camera,
                             double no_return_factor) {
  std::vector<float> points;
  for (int v = 0; v < image.height_px; ++v) {
    for (int u = 0; u < image.width_px; ++u) {
      const auto z = static_cast<double>(image.view().at(u, v));
      if (std::isnan(z)) {
        continue;
      }
      const Vector3d ray = pixel_ray(camera, u, v);
      const Vector3d point =
          std::isinf(z) ? ray.normalized() * (no_return_factor * camera.max_range_m) : ray * z;
      for (int axis = 0; axis < 3; ++axis) {
        points.push_back(static_cast<float>(point[axis]));
      }
    }
  }
  return points;
}

CameraConfig camera_config(int width_px, int height_px) {
  CameraConfig config;
  config.width_px = width_px;
  config.height_px = height_px;
  return config;
}

}  // namespace understory::test
