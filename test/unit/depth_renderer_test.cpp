// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/depth_renderer.hpp"

#include <cfenv>
#include <cmath>
#include <limits>
#include <optional>

#include <gtest/gtest.h>

#include "understory/base/rng.hpp"
#include "understory/sim/depth_noise.hpp"
#include "understory/sim/embree_scene.hpp"
#include "understory/sim/forest_generator.hpp"

namespace understory {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kTolerance_m = 0.002;
constexpr double kRange_m = 4.5;

CameraConfig small_camera(int width_px, int height_px) {
  CameraConfig config;
  config.width_px = width_px;
  config.height_px = height_px;
  return config;
}

struct Ray {
  Vector3d origin;
  Vector3d direction;  // optical z = 1: the parameter is the depth
};

// First hit of the side of an endless vertical cylinder from outside.
double cylinder_depth(const Ray& ray, const Trunk& trunk) {
  const Vector2d offset = ray.origin.head<2>() - trunk.center_m;
  const Vector2d along = ray.direction.head<2>();
  const double a = along.squaredNorm();
  const double b = offset.dot(along);
  const double c = offset.squaredNorm() - trunk.radius_m * trunk.radius_m;
  const double discriminant = b * b - a * c;
  if (discriminant < 0.0 || a == 0.0) {
    return kInfinity;
  }
  const double depth = (-b - std::sqrt(discriminant)) / a;
  return depth > 0.0 ? depth : kInfinity;
}

// Of the forest with every surface moved back by `sunk_m`.
double true_depth(const Ray& ray, const Forest& forest, double sunk_m) {
  const double height_m = ray.origin.z() + sunk_m;
  double depth = ray.direction.z() < 0.0 ? -height_m / ray.direction.z() : kInfinity;
  for (const Trunk& trunk : forest.trunks) {
    depth = std::min(depth, cylinder_depth(ray, {trunk.center_m, trunk.radius_m - sunk_m}));
  }
  return depth * ray.direction.norm() <= kRange_m ? depth : kInfinity;
}

Ray ray_of(const CameraModel& camera, const Pose& world_from_optical, int u, int v) {
  const Vector3d d_optical((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1.0);
  return {world_from_optical.translation(), world_from_optical.linear() * d_optical};
}

Forest one_trunk(double x_m, double y_m, double radius_m) {
  Forest forest;
  forest.trunks = {{Vector2d(x_m, y_m), radius_m}};
  return forest;
}

float center_of(const DepthImage& image) {
  return image.view().at(image.width_px / 2, image.height_px / 2);
}

TEST(DepthRenderer, LiesBetweenTheTrueSurfaceAndTwoMillimetresBehindItInEveryPixel) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Rng rng(seed);
    GeneratorConfig generator;
    generator.regions = {{-8, -8, 8, 8, 0.3}};
    generator.trunk_height_m = 20.0;  // as good as endless
    const Forest forest = generate_forest(generator, rng.fork("forest"));
    const DepthRenderer renderer(forest);
    const CameraModel camera(small_camera(63, 50));  // not a multiple of a packet
    Pose world_from_body = level_pose({0, 0, rng.uniform(0.3, 1.8)}, rng.uniform(-3, 3));
    world_from_body.rotate(Eigen::AngleAxisd(rng.uniform(-0.2, 0.2), Vector3d::UnitY()));
    const Pose world_from_optical = world_from_body * body_from_optical(CameraConfig{});

    const DepthImage image = renderer.render(camera, world_from_optical);

    ASSERT_EQ(image.z_m.size(), 63U * 50U);
    for (int v = 0; v < 50; ++v) {
      for (int u = 0; u < 63; ++u) {
        const Ray ray = ray_of(camera, world_from_optical, u, v);
        const auto seen = static_cast<double>(image.view().at(u, v));
        ASSERT_GE(seen, true_depth(ray, forest, 0.0) - 1e-5)
            << "seed " << seed << ", pixel " << u << ' ' << v;
        ASSERT_LE(seen, true_depth(ray, forest, kTolerance_m) + 1e-5)
            << "seed " << seed << ", pixel " << u << ' ' << v;
      }
    }
  }
}

TEST(DepthRenderer, MeasuresATrunkAheadToTwoMillimetresAllAround) {
  for (const double radius_m : {0.02, 0.1, 0.3, 1.1, 5.0}) {
    const DepthRenderer renderer(one_trunk(10, 20, radius_m));
    const CameraModel camera(small_camera(9, 9));
    for (int i = 0; i < 97; ++i) {
      const double yaw_rad = 2 * kPi * i / 97.0;
      const Vector3d heading(std::cos(yaw_rad), std::sin(yaw_rad), 0);
      const Pose pose = level_pose(Vector3d(10, 20, 1) - (radius_m + 2.0) * heading, yaw_rad) *
                        body_from_optical(CameraConfig{});

      const float seen = center_of(renderer.render(camera, pose));

      // The prism stands inside the cylinder: never in front of the true surface.
      EXPECT_GE(seen, 2.0F - 1e-5F) << radius_m << " m, heading " << yaw_rad;
      EXPECT_LE(seen, 2.0 + kTolerance_m) << radius_m << " m, heading " << yaw_rad;
    }
  }
}

TEST(DepthRenderer, MeasuresTheGroundJustBelowZero) {
  const DepthRenderer renderer(Forest{});
  CameraConfig config = small_camera(9, 9);
  config.mount_pitch_rad = 0.5 * kPi;
  const Pose pose = level_pose({1e4, -3e4, 1.5}, 0.3) * body_from_optical(config);

  const float seen = center_of(renderer.render(CameraModel(config), pose));

  EXPECT_GT(seen, 1.5F);
  EXPECT_LT(seen, 1.5 + kTolerance_m);
}

TEST(DepthRenderer, CountsTheRangeAlongTheRayAndNotAlongTheAxis) {
  const DepthRenderer renderer(one_trunk(1000, 0, 5.0));
  CameraConfig config = small_camera(161, 9);
  config.vertical_fov_rad = 0.1;
  config.max_range_m = 4.0;
  const CameraModel camera(config);
  Forest wall;  // a wall 3.5 m ahead: its corners are farther than 4 m
  wall.meshes = {
      {{{3.5F, -9, 0}, {3.5F, 9, 0}, {3.5F, 9, 3}, {3.5F, -9, 3}}, {{0, 1, 2}, {0, 2, 3}}}};
  const Pose pose = level_pose({0, 0, 1}, 0) * body_from_optical(config);

  const DepthImage image = DepthRenderer(wall).render(camera, pose);

  for (int u = 0; u < 161; ++u) {
    const double range_m = 3.5 * ray_of(camera, pose, u, 4).direction.norm();
    const auto seen = static_cast<double>(image.view().at(u, 4));
    if (range_m < 4.0) {
      EXPECT_NEAR(seen, 3.5, 1e-5) << u;
    } else {
      EXPECT_EQ(seen, kInfinity) << u;
    }
  }
}

TEST(DepthRenderer, SeesFarFromTheOriginAsWellAsNearIt) {
  const DepthRenderer renderer(one_trunk(90002.5, -80000, 0.5));
  const Pose pose = level_pose({90000, -80000, 1}, 0) * body_from_optical(CameraConfig{});

  const float seen = center_of(renderer.render(CameraModel(small_camera(9, 9)), pose));

  EXPECT_NEAR(static_cast<double>(seen), 2.0, kTolerance_m);
}

TEST(DepthRenderer, SeesTheTopOfAStump) {
  Forest forest = one_trunk(2, 0, 0.5);
  forest.trunk_height_m = 1.0;
  CameraConfig config = small_camera(9, 9);
  config.mount_pitch_rad = 0.5 * kPi;
  const DepthRenderer renderer(forest);

  for (const double x_m : {1.6, 1.9, 2.0, 2.2, 2.45}) {
    const Pose pose = level_pose({x_m, 0.05, 2.0}, 0) * body_from_optical(config);
    EXPECT_NEAR(center_of(renderer.render(CameraModel(config), pose)), 1.0F, 1e-5F) << x_m;
  }
}

TEST(DepthRenderer, MeasuresNothingBelowTheGround) {
  const DepthRenderer renderer(one_trunk(2, 0, 0.5));
  const Pose pose = level_pose({0, 0, -0.5}, 0) * body_from_optical(CameraConfig{});

  for (const float z_m : renderer.render(CameraModel(small_camera(8, 8)), pose).z_m) {
    EXPECT_TRUE(std::isnan(z_m));
  }
}

TEST(DepthRenderer, GivesTheSameBitsAgainAndInReusedMemory) {
  const Forest forest = generate_forest(GeneratorConfig{}, Rng(4));
  const DepthRenderer renderer(forest);
  const DepthRenderer twin(forest);
  const CameraModel camera(small_camera(50, 38));
  const Pose pose = level_pose({0, 0, 1}, 1.0) * body_from_optical(CameraConfig{});

  const DepthImage image = renderer.render(camera, pose);
  DepthImage dirty{3, 700, std::vector<float>(2100, 7.0F)};
  const float* memory = dirty.z_m.data();
  const DepthImage reused = twin.render(camera, pose, std::move(dirty));

  EXPECT_EQ(image.z_m, reused.z_m);
  EXPECT_EQ(reused.z_m.data(), memory);
}

TEST(DepthRenderer, IgnoresAndKeepsTheCallersFloatingPointState) {
  const Forest forest = one_trunk(2, 0.3, 0.3);
  const CameraModel camera(small_camera(40, 30));
  const Pose pose = level_pose({0, 0, 1}, 0.1) * body_from_optical(CameraConfig{});
  const DepthImage usual = DepthRenderer(forest).render(camera, pose);

  std::fesetround(FE_UPWARD);
  const DepthRenderer renderer(forest);
  const int after_building = std::fegetround();
  const DepthImage rounded = renderer.render(camera, pose);
  const int after_rendering = std::fegetround();
  std::fesetround(FE_TONEAREST);

  EXPECT_EQ(after_building, FE_UPWARD);
  EXPECT_EQ(after_rendering, FE_UPWARD);
  EXPECT_NEAR(static_cast<double>(center_of(usual)), static_cast<double>(center_of(rounded)), 1e-5);
}

TEST(PrismSides, KeepTheFacesWithinTwoMillimetresOfTheCylinder) {
  for (int step = 0; step <= 26; ++step) {
    const double radius_m = 0.005 * std::pow(1.3, step);
    const int sides = prism_sides(radius_m);

    EXPECT_LT(radius_m * (1.0 - std::cos(kPi / sides)), kTolerance_m) << radius_m;
    EXPECT_LE(sides, 160) << radius_m;
  }
}

TEST(DepthNoise, GrowsWithTheSquareOfTheDepth) {
  const DepthNoiseConfig config{0.002, 0.0};
  for (const float true_m : {1.0F, 3.0F}) {
    Rng rng(1);
    const DepthImage noisy = add_noise({200, 200, std::vector<float>(40000, true_m)}, config, rng);

    double sum = 0.0;
    double squares = 0.0;
    for (const float z_m : noisy.z_m) {
      const double error_m = static_cast<double>(z_m) - static_cast<double>(true_m);
      sum += error_m / 40000;
      squares += error_m * error_m / 40000;
    }
    const double expected_m = 0.002 * static_cast<double>(true_m * true_m);
    EXPECT_NEAR(sum, 0.0, 0.02 * expected_m) << true_m;
    EXPECT_NEAR(std::sqrt(squares), expected_m, 0.02 * expected_m) << true_m;
  }
}

TEST(DepthNoise, DropsTheConfiguredShareAndKeepsNoReturnsAndNaN) {
  const DepthNoiseConfig config{0.002, 0.1};
  const float nothing = std::numeric_limits<float>::infinity();
  Rng rng(1);

  const DepthImage noisy = add_noise({200, 200, std::vector<float>(40000, nothing)}, config, rng);
  const auto dropped =
      std::count_if(noisy.z_m.begin(), noisy.z_m.end(), [](float z_m) { return std::isnan(z_m); });
  const auto kept = std::count(noisy.z_m.begin(), noisy.z_m.end(), nothing);
  const DepthImage still_nan =
      add_noise({1, 1, {std::numeric_limits<float>::quiet_NaN()}}, {0.1, 0.0}, rng);

  EXPECT_NEAR(static_cast<double>(dropped), 4000.0, 200.0);
  EXPECT_EQ(dropped + kept, 40000);
  EXPECT_TRUE(std::isnan(still_nan.z_m[0]));
}

TEST(DepthNoise, NeverPutsAReturnBehindTheCamera) {
  Rng rng(1);
  const DepthImage noisy = add_noise({100, 100, std::vector<float>(10000, 20.0F)}, {0.1, 0.0}, rng);

  for (const float z_m : noisy.z_m) {
    EXPECT_GT(z_m, 0.0F);
  }
}

TEST(DepthNoise, ChangesAndDrawsNothingWhenItIsOff) {
  Rng rng(1);
  const DepthImage same = add_noise({2, 1, {1.0F, 2.0F}}, DepthNoiseConfig{}, rng);

  EXPECT_EQ(same.z_m, (std::vector<float>{1.0F, 2.0F}));
  EXPECT_EQ(rng.next(), Rng(1).next());
}

}  // namespace
}  // namespace understory
