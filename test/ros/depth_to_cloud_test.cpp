// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/nodelets/depth_to_cloud.hpp"

#include <cstring>
#include <limits>

#include <gtest/gtest.h>
#include <sensor_msgs/image_encodings.h>

namespace understory {
namespace {

namespace enc = sensor_msgs::image_encodings;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr int kWidth = 16;
constexpr int kHeight = 12;

CameraModel small_camera() {
  CameraConfig config;
  config.width_px = kWidth;
  config.height_px = kHeight;
  return CameraModel(config);
}

template <class Pixel>
sensor_msgs::Image image_of(const char* encoding, Pixel value, std::uint32_t padding_bytes = 0) {
  sensor_msgs::Image image;
  image.width = kWidth;
  image.height = kHeight;
  image.encoding = encoding;
  image.step = kWidth * static_cast<std::uint32_t>(sizeof(Pixel)) + padding_bytes;
  image.data.assign(std::size_t{image.step} * kHeight, 0xEE);
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      std::memcpy(&image.data[static_cast<std::size_t>(v) * image.step +
                              static_cast<std::size_t>(u) * sizeof(Pixel)],
                  &value,
                  sizeof(Pixel));
    }
  }
  return image;
}

template <class Pixel>
void set(sensor_msgs::Image& image, int u, int v, Pixel value) {
  std::memcpy(&image.data[static_cast<std::size_t>(v) * image.step +
                          static_cast<std::size_t>(u) * sizeof(Pixel)],
              &value,
              sizeof(Pixel));
}

void expect_on_ray(const pcl::PointXYZ& point, const CameraModel& camera, int u, int v) {
  EXPECT_NEAR(camera.fx * static_cast<double>(point.x / point.z) + camera.cx, u, 1e-4);
  EXPECT_NEAR(camera.fy * static_cast<double>(point.y / point.z) + camera.cy, v, 1e-4);
}

TEST(FillCloud, PutsEveryPointOnTheRayOfItsPixel) {
  const CameraModel camera = small_camera();
  Cloud cloud;

  const auto measured =
      fill_cloud(image_of(enc::TYPE_32FC1.c_str(), 2.0F, 12), camera, CloudConfig(), cloud);

  ASSERT_TRUE(measured);
  EXPECT_EQ(*measured, std::size_t{kWidth} * kHeight);
  ASSERT_EQ(cloud.width, static_cast<std::uint32_t>(kWidth));
  ASSERT_EQ(cloud.height, static_cast<std::uint32_t>(kHeight));
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      EXPECT_EQ(cloud.at(u, v).z, 2.0F);
      expect_on_ray(cloud.at(u, v), camera, u, v);
    }
  }
}

TEST(FillCloud, ReadsMillimetres) {
  for (const std::string& encoding : {enc::TYPE_16UC1, enc::MONO16}) {
    sensor_msgs::Image image = image_of<std::uint16_t>(encoding.c_str(), 1234, 6);
    set<std::uint16_t>(image, 3, 4, 0);
    Cloud cloud;

    const auto measured = fill_cloud(image, small_camera(), CloudConfig(), cloud);

    ASSERT_TRUE(measured);
    EXPECT_EQ(*measured, std::size_t{kWidth} * kHeight - 1U);
    EXPECT_FLOAT_EQ(cloud.at(7, 7).z, 1.234F);
    EXPECT_TRUE(std::isnan(cloud.at(3, 4).x) && std::isnan(cloud.at(3, 4).z));
    expect_on_ray(cloud.at(7, 7), small_camera(), 7, 7);
  }
}

TEST(FillCloud, TellsNoMeasurementFromNoReturn) {
  sensor_msgs::Image image = image_of(enc::TYPE_32FC1.c_str(), 2.0F);
  set(image, 1, 1, kNan);
  set(image, 2, 1, 0.0F);
  set(image, 3, 1, -1.0F);
  set(image, 4, 1, -kInfinity);
  set(image, 5, 1, 0.1F);  // nearer than min_range_m
  set(image, 6, 1, kInfinity);
  Cloud cloud;

  const auto measured = fill_cloud(image, small_camera(), CloudConfig(), cloud);

  ASSERT_TRUE(measured);
  EXPECT_EQ(*measured, std::size_t{kWidth} * kHeight - 5U);
  for (int u = 1; u <= 5; ++u) {
    EXPECT_TRUE(std::isnan(cloud.at(u, 1).z)) << u;
  }
  EXPECT_EQ(cloud.at(6, 1).z, kInfinity);
}

TEST(FillCloud, RefusesImagesItCannotRead) {
  const sensor_msgs::Image good = image_of(enc::TYPE_32FC1.c_str(), 2.0F);
  const auto error_of = [](const sensor_msgs::Image& image) {
    Cloud cloud;
    const auto measured = fill_cloud(image, small_camera(), CloudConfig(), cloud);
    return measured ? std::nullopt : std::make_optional(measured.error());
  };
  ASSERT_EQ(error_of(good), std::nullopt);

  sensor_msgs::Image image = good;
  image.data.pop_back();
  EXPECT_EQ(error_of(image), ImageError::kSizeMismatch);
  image = good;
  image.data.clear();
  EXPECT_EQ(error_of(image), ImageError::kSizeMismatch);
  image = good;
  image.step -= 4;
  EXPECT_EQ(error_of(image), ImageError::kSizeMismatch);
  image = good;
  image.width += 1;
  EXPECT_EQ(error_of(image), ImageError::kSizeMismatch);
  image = good;
  image.height = std::numeric_limits<std::uint32_t>::max();
  EXPECT_EQ(error_of(image), ImageError::kSizeMismatch);
  for (const std::string& encoding : {enc::RGB8, enc::TYPE_64FC1, std::string()}) {
    image = good;
    image.encoding = encoding;
    EXPECT_EQ(error_of(image), ImageError::kUnknownEncoding);
  }
  image = good;
  image.is_bigendian = 1;
  EXPECT_EQ(error_of(image), ImageError::kBigEndian);
}

TEST(FillCloud, RefusesAWidthThatOverflowsTheStep) {
  sensor_msgs::Image image = image_of(enc::TYPE_32FC1.c_str(), 2.0F);
  image.step = std::numeric_limits<std::uint32_t>::max();
  Cloud cloud;

  EXPECT_FALSE(fill_cloud(image, small_camera(), CloudConfig(), cloud));
}

TEST(FillCloud, DecimationKeepsPointsOnTheRaysOfTheirPixels) {
  const CameraModel camera = small_camera();
  for (const int decimation : {2, 3, 5}) {
    CloudConfig config;
    config.decimation = decimation;
    sensor_msgs::Image image = image_of(enc::TYPE_32FC1.c_str(), 2.0F);
    set(image, decimation, 2 * decimation, 3.0F);
    Cloud cloud;

    ASSERT_TRUE(fill_cloud(image, camera, config, cloud));

    const CameraModel smaller = decimated(camera, decimation);
    EXPECT_EQ(static_cast<int>(cloud.width), smaller.width_px);
    EXPECT_EQ(static_cast<int>(cloud.height), smaller.height_px);
    for (int v = 0; v < smaller.height_px; ++v) {
      for (int u = 0; u < smaller.width_px; ++u) {
        expect_on_ray(cloud.at(u, v), camera, u * decimation, v * decimation);
        expect_on_ray(cloud.at(u, v), smaller, u, v);
      }
    }
    EXPECT_EQ(cloud.at(1, 2).z, 3.0F);
  }
}

TEST(FillCloud, DropsPixelsThatFlyBetweenSurfaces) {
  CloudConfig config;
  config.flying_pixel_jump_m = 0.3;
  sensor_msgs::Image image = image_of(enc::TYPE_32FC1.c_str(), 4.0F);
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 8; u < kWidth; ++u) {
      set(image, u, v, 1.0F);  // a trunk before a wall
    }
  }
  set(image, 7, 5, 2.5F);
  Cloud cloud;

  ASSERT_TRUE(fill_cloud(image, small_camera(), config, cloud));

  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const bool is_flying = u == 7 && v == 5;
      EXPECT_EQ(std::isnan(cloud.at(u, v).z), is_flying) << u << ", " << v;
    }
  }
}

// Two pixels without return have an infinite, not a small difference.
TEST(FillCloud, DoesNotDropPixelsWithoutReturn) {
  CloudConfig config;
  config.flying_pixel_jump_m = 0.3;
  Cloud cloud;

  ASSERT_TRUE(
      fill_cloud(image_of(enc::TYPE_32FC1.c_str(), kInfinity), small_camera(), config, cloud));

  for (const pcl::PointXYZ& point : cloud) {
    EXPECT_EQ(point.z, kInfinity);
  }
}

TEST(FillCloud, MedianRemovesASpeckAndKeepsTheRays) {
  CloudConfig config;
  config.median_window_px = 3;
  sensor_msgs::Image image = image_of(enc::TYPE_32FC1.c_str(), 2.0F);
  set(image, 6, 6, 3.0F);
  Cloud cloud;

  ASSERT_TRUE(fill_cloud(image, small_camera(), config, cloud));

  EXPECT_FLOAT_EQ(cloud.at(6, 6).z, 2.0F);
  expect_on_ray(cloud.at(6, 6), small_camera(), 6, 6);
}

TEST(FillCloud, UsesTheCloudsMemoryAgain) {
  const sensor_msgs::Image image = image_of(enc::TYPE_32FC1.c_str(), 2.0F);
  Cloud cloud;
  ASSERT_TRUE(fill_cloud(image, small_camera(), CloudConfig(), cloud));
  const pcl::PointXYZ* memory = cloud.points.data();

  ASSERT_TRUE(fill_cloud(image, small_camera(), CloudConfig(), cloud));

  EXPECT_EQ(cloud.points.data(), memory);
}

}  // namespace
}  // namespace understory
