// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// The points of a LiDAR's message, whatever else its points carry, in the sensor's frame, metres.
// Points that are not finite are left out. Read field by field and message by message: pcl_ros
// keeps the layout of the first message it meets for the whole process. A pure function; a message
// without x, y, z as floats, or shorter than it says, is an error.
#pragma once

#include <sensor_msgs/PointCloud2.h>

#include "understory/base/result.hpp"
#include "understory/nodelets/depth_to_cloud.hpp"

namespace understory {

enum class LidarError { kNoFloatXyz, kSizeMismatch, kBigEndian };
[[nodiscard]] const char* to_string(LidarError error);

[[nodiscard]] Result<Cloud::Ptr, LidarError> lidar_points(const sensor_msgs::PointCloud2& message);

}  // namespace understory
