// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// A depth image as an organised cloud in the camera's optical frame, metres. 32FC1 in metres (NaN
// or not positive: no measurement; +inf: no return within range) or 16UC1 in millimetres (0: no
// measurement). A pixel without measurement becomes NaN; one without return keeps z = +inf. Pure
// functions; an image that cannot be read is an error.
#pragma once

#include <string>

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <sensor_msgs/Image.h>

#include "understory/base/result.hpp"
#include "understory/nodelets/onboard_config.hpp"
#include "understory/sense/camera_model.hpp"

namespace understory {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;

enum class ImageError { kUnknownEncoding, kSizeMismatch, kBigEndian };
[[nodiscard]] const char* to_string(ImageError error);

// The camera of an image of which only every so many rows and columns are used.
[[nodiscard]] CameraModel decimated(const CameraModel& camera, int decimation);

// Writes into `cloud`, whose memory is used again; returns the number of measured points.
Result<std::size_t, ImageError> fill_cloud(const sensor_msgs::Image& image,
                                           const CameraModel& camera,
                                           const CloudConfig& config,
                                           Cloud& cloud);

}  // namespace understory
