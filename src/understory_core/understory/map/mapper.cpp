// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/map/mapper.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "understory/map/intruders.hpp"
#include "understory/map/ray_integration.hpp"

namespace understory {
namespace {

// A quaternion of zeros, or one never normalised, yields a finite matrix that is no rotation.
constexpr double kRotationTolerance = 1e-3;
constexpr int kUnknown = -128;
static_assert(kUnknown == kUnknownLogOdds);

bool is_valid(const Pose& pose) {
  const Eigen::Matrix3d product = pose.linear() * pose.linear().transpose();
  return pose.matrix().allFinite() &&
         (product - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < kRotationTolerance;
}

MapSnapshot unknown_map(const MapConfig& config, const Box3d& box_m) {
  MapSnapshot map{
      GridGeometry(config.resolution_m, box_m), SensorModel(config.sensor), 0, Time{}, {}, {}, {}};
  map.tiles.resize(map.geometry.slot_count());
  return map;
}

// Where the point lies, or would if it were not infinitely far; zero if that cannot be told.
Vector3d direction_of(const Vector3d& point) {
  if (point.allFinite()) {
    return point;
  }
  Vector3d direction = Vector3d::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    if (std::isnan(point[axis])) {
      return Vector3d::Zero();
    }
    if (std::isinf(point[axis])) {
      if (!direction.isZero(0.0)) {
        return Vector3d::Zero();  // infinite along two axes: at any angle between them
      }
      direction[axis] = point[axis] > 0.0 ? 1.0 : -1.0;
    }
  }
  return direction;
}

}  // namespace

const char* to_string(IntegrateError error) {
  switch (error) {
    case IntegrateError::kBadPose:
      return "pose is not finite or its rotation is not orthonormal";
    case IntegrateError::kImageSizeMismatch:
      return "image size differs from the camera's";
  }
  return "unknown";
}

Mapper::Mapper(const MapConfig& config, const Box3d& box_m)
    : current_(unknown_map(config, box_m)), private_tiles_(current_.tiles.size()) {}

Mapper::Mapper(MapSnapshot resumed)
    : current_(std::move(resumed)), private_tiles_(current_.tiles.size()) {
  if (current_.tiles.size() != current_.geometry.slot_count()) {
    throw ConfigError("resumed map: its tiles do not fit its box");
  }
  // Nobody has followed this mapper so far: its first publication brings all there is.
  for (TileSlot slot = 0; slot < current_.tiles.size(); ++slot) {
    if (current_.tiles[slot]) {
      touched_.push_back(slot);
    }
  }
}

Result<IntegrateCounts, IntegrateError> Mapper::integrate(const CameraModel& camera,
                                                          const DepthView& depth,
                                                          const Pose& world_from_optical,
                                                          Time exposure) {
  if (!is_valid(world_from_optical)) {
    return IntegrateError::kBadPose;
  }
  if (depth.width_px != camera.width_px || depth.height_px != camera.height_px ||
      depth.width_px <= 0 || depth.height_px <= 0 || depth.z_m == nullptr) {
    return IntegrateError::kImageSizeMismatch;
  }
  const CameraView view(camera, world_from_optical, geometry().resolution_m());
  window_.reset(geometry(), view.reach_m());
  const std::size_t skipped = projective_.mark_hits(view, depth, window_);
  if (view.pixels_are_denser_than_voxels()) {
    projective_.mark_misses(view, current_, window_);
  } else {
    integrate_depth_rays(view, depth);
  }
  const Vector3d& eye_m = world_from_optical.translation();
  const std::size_t pixels =
      static_cast<std::size_t>(depth.width_px) * static_cast<std::size_t>(depth.height_px);
  if (skipped < pixels && geometry().box_m().contains(eye_m)) {
    const VoxelIndex own_voxel = geometry().index_of(eye_m);
    if (window_.voxels().contains(own_voxel)) {
      window_.mark_miss(own_voxel);  // every ray starts in it
    }
  }
  note_intruders();
  IntegrateCounts counts = apply_window();
  counts.skipped_points = skipped;
  current_.stamp = std::max(current_.stamp, exposure);
  return counts;
}

void Mapper::integrate_depth_rays(const CameraView& view, const DepthView& depth) {
  const CameraModel& camera = view.camera();
  const Eigen::Matrix3d rotation = view.world_from_optical().cast<double>();
  RayMarker marker(
      geometry(), view.origin_vox() * geometry().resolution_m(), camera.max_range_m, window_);
  for (int v = 0; v < depth.height_px; ++v) {
    for (int u = 0; u < depth.width_px; ++u) {
      const double z = static_cast<double>(depth.at(u, v));
      if (!(z > 0.0)) {
        continue;
      }
      const Vector3d ray =
          rotation * Vector3d((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1.0);
      if (std::isinf(z)) {
        marker.mark_no_return(ray);
      } else {
        marker.mark(ray * z);
      }
    }
  }
}

Result<IntegrateCounts, IntegrateError> Mapper::integrate_rays(const PointsView& points,
                                                               const Pose& world_from_sensor,
                                                               double max_range_m,
                                                               Time exposure) {
  if (!is_valid(world_from_sensor)) {
    return IntegrateError::kBadPose;
  }
  assert(max_range_m > 0.0);
  const Vector3d origin_m = world_from_sensor.translation();
  const Vector3d reach = Vector3d::Constant(max_range_m);
  window_.reset(geometry(), Box3d(origin_m - reach, origin_m + reach));
  RayMarker marker(geometry(), origin_m, max_range_m, window_);
  std::size_t skipped = 0;
  for (std::size_t i = 0; i < points.count; ++i) {
    const float* xyz_m = points.xyz_m + i * points.stride_floats;
    const Vector3d point = Eigen::Vector3f(xyz_m[0], xyz_m[1], xyz_m[2]).cast<double>();
    const Vector3d direction = direction_of(point);
    if (direction.isZero(0.0)) {
      ++skipped;
    } else if (point.allFinite()) {
      marker.mark(world_from_sensor.linear() * point);
    } else {
      marker.mark_no_return(world_from_sensor.linear() * direction);
    }
  }
  note_intruders();
  IntegrateCounts counts = apply_window();
  counts.skipped_points = skipped;
  current_.stamp = std::max(current_.stamp, exposure);
  return counts;
}

void Mapper::note_intruders() {
  const std::vector<Vector3d> seen_m = intruders_in(window_, current_);
  current_.intruders_m.insert(current_.intruders_m.end(), seen_m.begin(), seen_m.end());
}

IntegrateCounts Mapper::apply_window() {
  IntegrateCounts counts;
  const Vector3i end = window_.tile_min() + window_.tile_count();
  if (window_.empty()) {
    return counts;
  }
  for (int z = window_.tile_min().z(); z < end.z(); ++z) {
    for (int y = window_.tile_min().y(); y < end.y(); ++y) {
      for (int x = window_.tile_min().x(); x < end.x(); ++x) {
        const Vector3i tile(x, y, z);
        const IntegrateCounts of_tile =
            apply_marks(geometry().slot_of_tile(tile), window_.marks_of_tile(tile));
        counts.hit_voxels += of_tile.hit_voxels;
        counts.missed_voxels += of_tile.missed_voxels;
      }
    }
  }
  return counts;
}

IntegrateCounts Mapper::apply_marks(TileSlot slot, const TileMarks& marks) {
  IntegrateCounts counts;
  for (std::size_t row = 0; row < kRowsPerTile; ++row) {
    const unsigned hits = marks.hits[row];
    for (unsigned left = hits | marks.misses[row]; left != 0; left &= left - 1) {
      const auto x = static_cast<unsigned>(__builtin_ctz(left));
      const bool is_hit = ((hits >> x) & 1U) != 0;
      const bool changed = update_voxel(slot, row * kTileVoxels + x, is_hit);
      counts.hit_voxels += is_hit ? 1U : 0U;
      counts.missed_voxels += changed && !is_hit ? 1U : 0U;
    }
  }
  return counts;
}

bool Mapper::update_voxel(TileSlot slot, std::size_t offset, bool is_hit) {
  const SensorModel& model = current_.sensor_model;
  const Tile* tile = current_.tiles[slot].get();
  const int before = tile == nullptr ? kUnknown : tile->log_odds_at(offset);
  const int start = before == kUnknown ? 0 : before;
  const int after = std::clamp(start + (is_hit ? model.hit : model.miss), model.min, model.max);
  if (after == before) {
    return false;
  }
  writable_tile(slot).set(offset, static_cast<std::int8_t>(after));
  return true;
}

void Mapper::mark_free(const Box3d& region_m, Time stamp) {
  const auto free_clamp = static_cast<std::int8_t>(current_.sensor_model.min);
  const VoxelBox voxels = geometry().voxels_touched_by(region_m);
  for (int z = voxels.min.z(); z < voxels.end.z(); ++z) {
    for (int y = voxels.min.y(); y < voxels.end.y(); ++y) {
      for (int x = voxels.min.x(); x < voxels.end.x(); ++x) {
        const VoxelIndex voxel(x, y, z);
        const Tile* tile = current_.tile_at(voxel);
        const std::size_t offset = offset_in_tile(voxel);
        const int before = tile == nullptr ? kUnknown : tile->log_odds_at(offset);
        if (region_m.contains(geometry().center_of(voxel)) && before < 0 && before != free_clamp) {
          writable_tile(geometry().slot_of(voxel)).set(offset, free_clamp);
        }
      }
    }
  }
  current_.stamp = std::max(current_.stamp, stamp);
}

MapSnapshotPtr Mapper::publish() {
  ++current_.revision;
  std::sort(touched_.begin(), touched_.end());
  touched_.erase(std::unique(touched_.begin(), touched_.end()), touched_.end());
  for (const TileSlot slot : touched_) {
    private_tiles_[slot].reset();
  }
  current_.changed_tiles = std::move(touched_);
  touched_.clear();
  MapSnapshotPtr published = std::make_shared<const MapSnapshot>(current_);
  current_.intruders_m.clear();
  return published;
}

Tile& Mapper::writable_tile(TileSlot slot) {
  std::shared_ptr<Tile>& mine = private_tiles_[slot];
  if (!mine) {
    const TilePtr& shared = current_.tiles[slot];
    mine = shared ? std::make_shared<Tile>(*shared) : std::make_shared<Tile>();
    current_.tiles[slot] = mine;
    touched_.push_back(slot);
  }
  return *mine;
}

}  // namespace understory
