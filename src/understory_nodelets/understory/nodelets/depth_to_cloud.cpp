// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/nodelets/depth_to_cloud.hpp"

#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include <pcl/filters/median_filter.h>
#include <sensor_msgs/image_encodings.h>

namespace understory {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kMetresPerMillimetre = 0.001F;

// Depths as drivers send them, in metres; NaN where nothing was measured.
class DepthRows {
 public:
  explicit DepthRows(const sensor_msgs::Image& image)
      : image_(image), is_float_(image.encoding == sensor_msgs::image_encodings::TYPE_32FC1) {}

  [[nodiscard]] float at(std::size_t u, std::size_t v) const {
    const std::uint8_t* row = image_.data.data() + v * image_.step;
    if (is_float_) {
      float depth_m = 0.0F;
      std::memcpy(&depth_m, row + u * sizeof(float), sizeof(float));
      return depth_m > 0.0F ? depth_m : kNan;  // NaN fails the comparison too
    }
    std::uint16_t depth_mm = 0;
    std::memcpy(&depth_mm, row + u * sizeof(depth_mm), sizeof(depth_mm));
    return depth_mm > 0 ? static_cast<float>(depth_mm) * kMetresPerMillimetre : kNan;
  }

 private:
  const sensor_msgs::Image& image_;
  bool is_float_;
};

std::optional<ImageError> what_is_wrong(const sensor_msgs::Image& image,
                                        const CameraModel& camera) {
  std::size_t pixel_bytes = 0;
  if (image.encoding == sensor_msgs::image_encodings::TYPE_32FC1) {
    pixel_bytes = sizeof(float);
  } else if (image.encoding == sensor_msgs::image_encodings::TYPE_16UC1 ||
             image.encoding == sensor_msgs::image_encodings::MONO16) {
    pixel_bytes = sizeof(std::uint16_t);
  } else {
    return ImageError::kUnknownEncoding;
  }
  if (image.is_bigendian != 0) {
    return ImageError::kBigEndian;
  }
  const bool is_sized = static_cast<int>(image.width) == camera.width_px &&
                        static_cast<int>(image.height) == camera.height_px &&
                        image.step >= image.width * pixel_bytes &&
                        image.data.size() >= std::size_t{image.step} * image.height;
  return is_sized ? std::nullopt : std::make_optional(ImageError::kSizeMismatch);
}

// A pixel between a near and a far surface measures neither.
void drop_flying_pixels(double jump_m, Cloud& cloud) {
  const auto jump = static_cast<float>(jump_m);
  const auto width = static_cast<int>(cloud.width);
  const auto height = static_cast<int>(cloud.height);
  std::vector<std::size_t> flying;
  for (int v = 1; v + 1 < height; ++v) {
    for (int u = 1; u + 1 < width; ++u) {
      const float z = cloud.at(u, v).z;
      const auto is_near = [&](int du, int dv) {
        return std::abs(cloud.at(u + du, v + dv).z - z) <= jump;
      };
      const bool is_lonely = !is_near(-1, 0) && !is_near(1, 0) && !is_near(0, -1) && !is_near(0, 1);
      if (std::isfinite(z) && is_lonely) {
        flying.push_back(static_cast<std::size_t>(v) * cloud.width + static_cast<std::size_t>(u));
      }
    }
  }
  for (const std::size_t i : flying) {
    cloud[i].x = cloud[i].y = cloud[i].z = kNan;
  }
}

// PCL's filter writes z alone; x and y follow, so that points stay on their rays.
void smooth(int window_px, Cloud& cloud) {
  pcl::MedianFilter<pcl::PointXYZ> filter;
  filter.setWindowSize(window_px);
  Cloud filtered;
  filter.setInputCloud(cloud.makeShared());
  filter.filter(filtered);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const float ratio = filtered[i].z / cloud[i].z;
    if (std::isfinite(ratio)) {
      cloud[i].x *= ratio;
      cloud[i].y *= ratio;
      cloud[i].z = filtered[i].z;
    }
  }
}

}  // namespace

const char* to_string(ImageError error) {
  switch (error) {
    case ImageError::kUnknownEncoding:
      return "encoding is neither 32FC1 nor 16UC1";
    case ImageError::kSizeMismatch:
      return "size differs from camera_info's, or data are missing";
    case ImageError::kBigEndian:
      return "data are big-endian";
  }
  return "unknown";
}

CameraModel decimated(const CameraModel& camera, int decimation) {
  CameraModel smaller = camera;
  smaller.width_px = (camera.width_px + decimation - 1) / decimation;
  smaller.height_px = (camera.height_px + decimation - 1) / decimation;
  smaller.fx /= decimation;
  smaller.fy /= decimation;
  smaller.cx /= decimation;
  smaller.cy /= decimation;
  return smaller;
}

Result<std::size_t, ImageError> fill_cloud(const sensor_msgs::Image& image,
                                           const CameraModel& camera,
                                           const CloudConfig& config,
                                           Cloud& cloud) {
  if (const std::optional<ImageError> wrong = what_is_wrong(image, camera)) {
    return *wrong;
  }
  const CameraModel smaller = decimated(camera, config.decimation);
  cloud.width = static_cast<std::uint32_t>(smaller.width_px);
  cloud.height = static_cast<std::uint32_t>(smaller.height_px);
  cloud.is_dense = false;
  cloud.points.resize(std::size_t{cloud.width} * cloud.height);
  const DepthRows depths(image);
  const auto step = static_cast<std::size_t>(config.decimation);
  const auto min_range = static_cast<float>(config.min_range_m);
  std::size_t measured = 0;
  for (std::size_t v = 0; v < cloud.height; ++v) {
    const auto slope_y = static_cast<float>((static_cast<double>(v) - smaller.cy) / smaller.fy);
    for (std::size_t u = 0; u < cloud.width; ++u) {
      const auto slope_x = static_cast<float>((static_cast<double>(u) - smaller.cx) / smaller.fx);
      const float depth = depths.at(u * step, v * step);
      const float z = depth >= min_range ? depth : kNan;
      pcl::PointXYZ& point = cloud.points[v * cloud.width + u];
      point.x = slope_x * z;
      point.y = slope_y * z;
      point.z = z;
      measured += std::isnan(z) ? 0U : 1U;
    }
  }
  if (config.flying_pixel_jump_m > 0.0) {
    drop_flying_pixels(config.flying_pixel_jump_m, cloud);
  }
  if (config.median_window_px > 1) {
    smooth(config.median_window_px, cloud);
  }
  return measured;
}

}  // namespace understory
