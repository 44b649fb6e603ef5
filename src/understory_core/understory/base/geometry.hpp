// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Geometry shared by all modules. Metres and radians. Frames: world = map (ENU), body = base_link
// (x forward, z up), optical = camera_optical (z forward, x right, y down). Nothing here can fail.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace understory {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3i;
using Box3d = Eigen::AlignedBox3d;
using Pose = Eigen::Isometry3d;

inline constexpr double kPi = 3.14159265358979323846;

// Into (-pi, pi].
[[nodiscard]] double wrap_angle(double angle_rad);

// Signed smallest rotation that brings `from_rad` to `to_rad`, in (-pi, pi].
[[nodiscard]] double angle_difference(double to_rad, double from_rad);

// A level vehicle at this position with this heading.
[[nodiscard]] Pose level_pose(const Vector3d& position_m, double yaw_rad);

// Heading of the body's x axis in the world's xy plane.
[[nodiscard]] double yaw_of(const Eigen::Quaterniond& world_from_body);

}  // namespace understory
