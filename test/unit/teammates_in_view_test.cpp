// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/teammates_in_view.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "support/small_images.hpp"
#include "understory/base/rng.hpp"
#include "understory/sense/sphere_pixels.hpp"

namespace understory {
namespace {

using test::count_changed;
using test::filled;
using test::looking_east_from;
using test::round_camera;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

TEST(TeammatesInView, SphereAheadHasTheDepthThatOneWorksOutByHand) {
  const CameraModel camera = round_camera();

  // World axes as the optical ones: the sphere's nearest point lies at 1.7 m.
  const DepthImage image =
      add_teammates(filled(camera, kInfinity), camera, Pose::Identity(), {{0, 0, 2}}, 0.3);

  EXPECT_FLOAT_EQ(image.view().at(50, 40), 1.7F);
  // Along (0.1, 0, 1): 1.01 z^2 - 4 z + 3.91 = 0, z = (2 - sqrt(0.0509)) / 1.01.
  EXPECT_NEAR(image.view().at(60, 40), 1.756820, 1e-5);
  EXPECT_NEAR(image.view().at(50, 30), 1.756820, 1e-5);
  // The edge: tan(asin(0.3 / 2)) = 0.15172 of the axis, between 15 and 16 pixels from the middle.
  EXPECT_TRUE(std::isfinite(image.view().at(65, 40)));
  EXPECT_TRUE(std::isfinite(image.view().at(50, 25)));
  EXPECT_EQ(image.view().at(66, 40), kInfinity);
  EXPECT_EQ(image.view().at(34, 40), kInfinity);
  EXPECT_EQ(image.view().at(50, 24), kInfinity);
}

TEST(TeammatesInView, SeesInTheFrameOfTheCamerasPose) {
  const CameraModel camera = round_camera();

  // 2 m east, 0.2 m to the north (left) and 0.1 m up of the camera.
  const DepthImage image = add_teammates(
      filled(camera, kInfinity), camera, looking_east_from({10, 20, 1}), {{12, 20.2, 1.1}}, 0.01);

  EXPECT_NEAR(image.view().at(40, 35), 1.99, 1e-4);
  EXPECT_EQ(count_changed(image, filled(camera, kInfinity)), 1);
}

TEST(TeammatesInView, NearerOfSceneAndTeammateIsSeenAndUnknownStaysUnknown) {
  const CameraModel camera = round_camera();
  DepthImage scene = filled(camera, 3.0F);
  scene.z_m[40 * 101 + 50] = 1.0F;  // a twig in front
  scene.z_m[40 * 101 + 51] = kNan;

  const DepthImage image =
      add_teammates(scene, camera, Pose::Identity(), {{0, 0, 2.5}, {0, 0, 2}, {0, 0, 9}}, 0.3);

  EXPECT_EQ(image.view().at(50, 40), 1.0F);
  EXPECT_TRUE(std::isnan(image.view().at(51, 40)));
  EXPECT_NEAR(image.view().at(49, 40), 1.7, 1e-3);
  EXPECT_EQ(image.view().at(0, 0), 3.0F);
}

TEST(TeammatesInView, BeyondTheRangeBehindAndAroundTheCameraNothingIsSeen) {
  const CameraModel camera = round_camera();
  const DepthImage empty = filled(camera, kInfinity);
  const double nan = std::numeric_limits<double>::quiet_NaN();

  for (const Vector3d& center_m : {Vector3d(0, 0, 4.81),
                                   Vector3d(0, 0, -2),
                                   Vector3d(0, 0, -0.31),
                                   Vector3d(0, 0, 0.2),
                                   Vector3d(0, nan, 2)}) {
    const DepthImage image = add_teammates(empty, camera, Pose::Identity(), {center_m}, 0.3);

    EXPECT_EQ(count_changed(image, empty), 0) << center_m.transpose();
  }
  EXPECT_GT(
      count_changed(add_teammates(empty, camera, Pose::Identity(), {{0, 0, 4.79}}, 0.3), empty), 0);
}

TEST(SpherePixels, HoldEveryPixelWhoseRayMeetsTheSphereAndFewOthers) {
  const CameraModel camera = round_camera();
  Rng rng(7);
  int met = 0;
  for (int i = 0; i < 2000; ++i) {
    const double radius_m = rng.uniform(0.05, 1.0);
    const Vector3d center_m(rng.uniform(-2, 2), rng.uniform(-2, 2), rng.uniform(-1, 4));

    const PixelRectangle pixels = pixels_of_sphere(camera, center_m, radius_m);

    PixelRectangle needed{camera.width_px, 0, camera.height_px, 0};
    for (int v = 0; v < camera.height_px; ++v) {
      for (int u = 0; u < camera.width_px; ++u) {
        const Vector3d ray((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1.0);
        const double nearest = std::max(center_m.dot(ray) / ray.squaredNorm(), 1e-9);
        if ((nearest * ray - center_m).norm() < radius_m) {
          needed = {std::min(needed.u_begin, u),
                    std::max(needed.u_end, u + 1),
                    std::min(needed.v_begin, v),
                    std::max(needed.v_end, v + 1)};
        }
      }
    }
    if (needed.u_end > 0) {
      ++met;
      ASSERT_LE(pixels.u_begin, needed.u_begin) << i;
      ASSERT_GE(pixels.u_end, needed.u_end) << i;
      ASSERT_LE(pixels.v_begin, needed.v_begin) << i;
      ASSERT_GE(pixels.v_end, needed.v_end) << i;
    }
    if (center_m.norm() < 1.5 * radius_m) {
      continue;  // so near the rectangle may be the whole image
    }
    // Where all of the sphere is in view the rectangle fits to three pixels.
    if (needed.u_begin > 0 && needed.u_end > 0 && needed.u_end < camera.width_px &&
        needed.v_begin > 0 && needed.v_end < camera.height_px) {
      ASSERT_GE(pixels.u_begin, needed.u_begin - 3) << i;
      ASSERT_LE(pixels.u_end, needed.u_end + 3) << i;
      ASSERT_GE(pixels.v_begin, needed.v_begin - 3) << i;
      ASSERT_LE(pixels.v_end, needed.v_end + 3) << i;
    }
  }
  EXPECT_GT(met, 500);
}

}  // namespace
}  // namespace understory
