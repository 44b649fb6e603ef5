// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/map/ray_integration.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace understory {
namespace {

// No box is that long, and an infinite range times a zero direction would be NaN.
constexpr double kMaxRangeVox = 1e7;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// The part of the segment start + t * ray, t in [0, 1], that lies in the box; empty if end < begin.
struct Span {
  double begin = 0.0;
  double end = 1.0;
};

Span span_in(const VoxelBox& box, const Vector3d& start, const Vector3d& ray) {
  Span span;
  for (int axis = 0; axis < 3; ++axis) {
    const double to_min = box.min[axis] - start[axis];
    const double to_end = box.end[axis] - start[axis];
    if (ray[axis] == 0.0) {
      if (to_min > 0.0 || to_end <= 0.0) {
        return {1.0, 0.0};
      }
      continue;
    }
    const double a = to_min / ray[axis];
    const double b = to_end / ray[axis];
    span.begin = std::max(span.begin, std::min(a, b));
    span.end = std::min(span.end, std::max(a, b));
  }
  return span;
}

VoxelIndex voxel_of(const Vector3d& point_vox, const VoxelBox& box) {
  const Vector3d low = box.min.cast<double>();
  const Vector3d high = (box.end.array() - 1).cast<double>();
  // Clamped before the conversion: rounding may put the entry point just outside.
  return point_vox.array().floor().max(low.array()).min(high.array()).cast<int>();
}

bool lies_in(const Vector3d& point_vox, const VoxelBox& box) {
  return (point_vox.array() >= box.min.cast<double>().array()).all() &&
         (point_vox.array() < box.end.cast<double>().array()).all();
}

}  // namespace

RayMarker::RayMarker(const GridGeometry& geometry,
                     const Vector3d& origin_m,
                     double max_range_m,
                     ScanWindow& window)
    : origin_vox_(origin_m / geometry.resolution_m()),
      inverse_resolution_(1.0 / geometry.resolution_m()),
      max_range_m_(std::min(max_range_m, kMaxRangeVox * geometry.resolution_m())),
      window_(window) {}

void RayMarker::mark(const Vector3d& ray_m) {
  if (ray_m.norm() > max_range_m_) {
    mark_no_return(ray_m);
    return;
  }
  const Vector3d end_vox = origin_vox_ + ray_m * inverse_resolution_;
  mark_passed(end_vox);
  if (lies_in(end_vox, window_.voxels())) {
    window_.mark_hit(voxel_of(end_vox, window_.voxels()));
  }
}

void RayMarker::mark_no_return(const Vector3d& direction) {
  mark_passed(origin_vox_ + direction.normalized() * (max_range_m_ * inverse_resolution_));
}

void RayMarker::mark_passed(const Vector3d& end_vox) {
  const VoxelBox& box = window_.voxels();
  if (box.empty()) {
    return;
  }
  const Vector3d ray = end_vox - origin_vox_;
  const Span span = span_in(box, origin_vox_, ray);
  if (!(span.begin <= span.end)) {
    return;
  }
  VoxelIndex voxel = voxel_of(origin_vox_ + span.begin * ray, box);
  // One beyond the box stands for everything beyond, which is never reached.
  const VoxelIndex end = voxel_of(end_vox, VoxelBox{box.min.array() - 1, box.end.array() + 1});
  Vector3i step = Vector3i::Zero();
  Vector3d next_border = Vector3d::Constant(kInfinity);  // t at which the ray leaves the voxel
  Vector3d border_spacing = Vector3d::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    if (ray[axis] != 0.0) {
      step[axis] = ray[axis] > 0.0 ? 1 : -1;
      const double border = voxel[axis] + (step[axis] > 0 ? 1.0 : 0.0);
      next_border[axis] = (border - origin_vox_[axis]) / ray[axis];
      border_spacing[axis] = 1.0 / std::abs(ray[axis]);
    }
  }
  while (box.contains(voxel) && voxel != end) {
    window_.mark_miss(voxel);
    int axis = next_border.x() < next_border.y() ? 0 : 1;
    axis = next_border[axis] < next_border.z() ? axis : 2;
    if (next_border[axis] > 1.0) {
      return;
    }
    voxel[axis] += step[axis];
    next_border[axis] += border_spacing[axis];
  }
}

}  // namespace understory
