// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/nodelets/lidar_points.hpp"

#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

namespace understory {
namespace {

sensor_msgs::PointField field(const char* name, std::uint32_t offset, std::uint8_t datatype) {
  sensor_msgs::PointField made;
  made.name = name;
  made.offset = offset;
  made.datatype = datatype;
  made.count = 1;
  return made;
}

// As drivers lay them out: x, y, z, a gap, intensity.
sensor_msgs::PointCloud2 message_of(const std::vector<std::array<float, 3>>& points) {
  constexpr std::uint32_t kPointBytes = 20;
  sensor_msgs::PointCloud2 message;
  message.fields = {field("x", 0, sensor_msgs::PointField::FLOAT32),
                    field("y", 4, sensor_msgs::PointField::FLOAT32),
                    field("z", 8, sensor_msgs::PointField::FLOAT32),
                    field("intensity", 16, sensor_msgs::PointField::FLOAT32)};
  message.height = 1;
  message.width = static_cast<std::uint32_t>(points.size());
  message.point_step = kPointBytes;
  message.row_step = kPointBytes * message.width;
  message.is_dense = 1;  // as drivers say, whatever the points are
  message.data.resize(message.row_step);
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::memcpy(&message.data[i * kPointBytes], points[i].data(), 3 * sizeof(float));
  }
  return message;
}

TEST(LidarPoints, AreReadWhateverElseAPointCarries) {
  const sensor_msgs::PointCloud2 message = message_of({{1.0F, 2.0F, 3.0F}, {-4.0F, 5.0F, 0.5F}});

  const Result<Cloud::Ptr, LidarError> read = lidar_points(message);

  ASSERT_TRUE(read.has_value());
  const Cloud& cloud = *read.value();
  ASSERT_EQ(cloud.size(), 2U);
  EXPECT_EQ(cloud[0].z, 3.0F);
  EXPECT_EQ(cloud[1].x, -4.0F);
}

TEST(LidarPoints, ThatAreNotFiniteAreLeftOutEvenOfADenseCloud) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float inf = std::numeric_limits<float>::infinity();
  const sensor_msgs::PointCloud2 message =
      message_of({{nan, 0.0F, 0.0F}, {0.0F, inf, 0.0F}, {1.0F, 1.0F, 1.0F}, {0.0F, 0.0F, nan}});

  const Result<Cloud::Ptr, LidarError> read = lidar_points(message);

  ASSERT_TRUE(read.has_value());
  ASSERT_EQ(read.value()->size(), 1U);
  EXPECT_EQ(read.value()->front().x, 1.0F);
}

TEST(LidarPoints, OfAnotherLayoutInTheNextMessageAreReadRight) {
  sensor_msgs::PointCloud2 message = message_of({{1.0F, 2.0F, 3.0F}});
  message.fields[0].offset = 8;  // z, y, x
  message.fields[2].offset = 0;

  ASSERT_TRUE(lidar_points(message_of({{9.0F, 9.0F, 9.0F}})).has_value());
  const Result<Cloud::Ptr, LidarError> read = lidar_points(message);

  ASSERT_TRUE(read.has_value());
  EXPECT_EQ(read.value()->front().x, 3.0F);
  EXPECT_EQ(read.value()->front().z, 1.0F);
}

TEST(LidarPoints, AnEmptyCloudHasNone) {
  const Result<Cloud::Ptr, LidarError> read = lidar_points(message_of({}));

  ASSERT_TRUE(read.has_value());
  EXPECT_TRUE(read.value()->empty());
}

TEST(LidarPoints, OfAMessageThatLiesAreAnError) {
  const sensor_msgs::PointCloud2 good = message_of({{1.0F, 2.0F, 3.0F}, {4.0F, 5.0F, 6.0F}});
  sensor_msgs::PointCloud2 cut = good;
  cut.data.pop_back();
  sensor_msgs::PointCloud2 doubles = good;
  doubles.fields[1].datatype = sensor_msgs::PointField::FLOAT64;
  sensor_msgs::PointCloud2 beyond = good;
  beyond.fields[2].offset = beyond.point_step - 2;
  sensor_msgs::PointCloud2 short_rows = good;
  short_rows.row_step = 4;
  sensor_msgs::PointCloud2 big_endian = good;
  big_endian.is_bigendian = 1;

  EXPECT_EQ(lidar_points(cut).error(), LidarError::kSizeMismatch);
  EXPECT_EQ(lidar_points(doubles).error(), LidarError::kNoFloatXyz);
  EXPECT_EQ(lidar_points(beyond).error(), LidarError::kNoFloatXyz);
  EXPECT_EQ(lidar_points(short_rows).error(), LidarError::kSizeMismatch);
  EXPECT_EQ(lidar_points(big_endian).error(), LidarError::kBigEndian);
}

}  // namespace
}  // namespace understory
