// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/nodelets/lidar_points.hpp"

#include <array>
#include <cmath>
#include <cstring>
#include <optional>

namespace understory {
namespace {

std::optional<std::size_t> float_offset(const sensor_msgs::PointCloud2& message, const char* name) {
  for (const sensor_msgs::PointField& field : message.fields) {
    const bool fits = std::size_t{field.offset} + sizeof(float) <= message.point_step;
    if (field.name == name && field.datatype == sensor_msgs::PointField::FLOAT32 && fits) {
      return field.offset;
    }
  }
  return std::nullopt;
}

float float_at(const std::uint8_t* bytes) {
  float value = 0.0F;
  std::memcpy(&value, bytes, sizeof(value));
  return value;
}

}  // namespace

const char* to_string(LidarError error) {
  switch (error) {
    case LidarError::kNoFloatXyz:
      return "cloud without x, y and z as 32 bit floats";
    case LidarError::kSizeMismatch:
      return "cloud with fewer data than it says";
    case LidarError::kBigEndian:
      return "cloud with big-endian data";
  }
  return "unknown";
}

Result<Cloud::Ptr, LidarError> lidar_points(const sensor_msgs::PointCloud2& message) {
  if (message.is_bigendian != 0) {
    return LidarError::kBigEndian;
  }
  const std::array<std::optional<std::size_t>, 3> offsets{
      float_offset(message, "x"), float_offset(message, "y"), float_offset(message, "z")};
  if (!offsets[0] || !offsets[1] || !offsets[2]) {
    return LidarError::kNoFloatXyz;
  }
  const std::size_t row_bytes = std::size_t{message.width} * message.point_step;
  const bool has_rows = message.height == 0 || message.row_step >= row_bytes;
  if (!has_rows || message.data.size() < std::size_t{message.row_step} * message.height) {
    return LidarError::kSizeMismatch;
  }
  auto cloud = std::make_shared<Cloud>();
  cloud->reserve(std::size_t{message.width} * message.height);
  for (std::size_t row = 0; row < message.height; ++row) {
    for (std::size_t column = 0; column < message.width; ++column) {
      const std::uint8_t* bytes =
          message.data.data() + row * message.row_step + column * message.point_step;
      const pcl::PointXYZ point(float_at(bytes + *offsets[0]),
                                float_at(bytes + *offsets[1]),
                                float_at(bytes + *offsets[2]));
      if (std::isfinite(point.x) && std::isfinite(point.y) && std::isfinite(point.z)) {
        cloud->push_back(point);
      }
    }
  }
  return cloud;
}

}  // namespace understory
