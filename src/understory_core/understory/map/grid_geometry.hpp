// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Where voxels and tiles lie. World frame, metres. Voxel i covers [i, i + 1) * resolution on each
// axis (as in OctoMap); a tile is 16 x 16 x 16 voxels, aligned to multiples of 16. The box may lie
// anywhere and have any size; its faces are widened to voxel borders. Values; nothing fails in
// flight, an empty or absurd box throws ConfigError.
#pragma once

#include <cmath>
#include <cstddef>

#include "understory/base/geometry.hpp"

namespace understory {

using VoxelIndex = Vector3i;

inline constexpr int kTileVoxels = 16;  // along each axis
inline constexpr int kTileShift = 4;

// Half-open range of voxels.
struct VoxelBox {
  VoxelIndex min = VoxelIndex::Zero();
  VoxelIndex end = VoxelIndex::Zero();

  [[nodiscard]] bool contains(const VoxelIndex& voxel) const {
    return is_between(voxel.x(), min.x(), end.x()) && is_between(voxel.y(), min.y(), end.y()) &&
           is_between(voxel.z(), min.z(), end.z());
  }
  [[nodiscard]] bool empty() const { return (min.array() >= end.array()).any(); }
  [[nodiscard]] Vector3i size() const { return end - min; }
  [[nodiscard]] VoxelBox clipped_to(const VoxelBox& other) const {
    return {min.cwiseMax(other.min), end.cwiseMin(other.end)};
  }

 private:
  [[nodiscard]] static bool is_between(int i, int begin, int end) { return begin <= i && i < end; }
};

using TileSlot = std::size_t;  // index into a dense table over the box

class GridGeometry {
 public:
  GridGeometry(double resolution_m, const Box3d& box_m);

  [[nodiscard]] double resolution_m() const { return resolution_m_; }
  [[nodiscard]] const VoxelBox& voxels() const { return voxels_; }  // of the box
  [[nodiscard]] Box3d box_m() const;
  [[nodiscard]] bool contains(const VoxelIndex& voxel) const { return voxels_.contains(voxel); }

  [[nodiscard]] VoxelIndex index_of(const Vector3d& point_m) const {
    return {floor_index(point_m.x()), floor_index(point_m.y()), floor_index(point_m.z())};
  }
  [[nodiscard]] Vector3d center_of(const VoxelIndex& voxel) const {
    return (voxel.cast<double>().array() + 0.5) * resolution_m_;
  }

  // The voxels of the box that a region touches. The region may lie anywhere and have any size,
  // infinite too; none if it has a NaN.
  [[nodiscard]] VoxelBox voxels_touched_by(const Box3d& region_m) const;

  // Tiles that the box touches; tile t covers voxels [16 t, 16 t + 16).
  [[nodiscard]] const Vector3i& tile_min() const { return tile_min_; }
  [[nodiscard]] const Vector3i& tile_count() const { return tile_count_; }
  [[nodiscard]] std::size_t slot_count() const {
    return static_cast<std::size_t>(tile_count_.x()) * static_cast<std::size_t>(tile_count_.y()) *
           static_cast<std::size_t>(tile_count_.z());
  }
  // Of a voxel inside the box.
  [[nodiscard]] TileSlot slot_of(const VoxelIndex& voxel) const {
    return slot_of_tile(
        {voxel.x() >> kTileShift, voxel.y() >> kTileShift, voxel.z() >> kTileShift});
  }
  [[nodiscard]] bool has_tile(const Vector3i& tile) const {
    const Vector3i local = tile - tile_min_;
    return (local.array() >= 0).all() && (local.array() < tile_count_.array()).all();
  }
  [[nodiscard]] TileSlot slot_of_tile(const Vector3i& tile) const {
    const Vector3i local = tile - tile_min_;
    return (static_cast<std::size_t>(local.z()) * static_cast<std::size_t>(tile_count_.y()) +
            static_cast<std::size_t>(local.y())) *
               static_cast<std::size_t>(tile_count_.x()) +
           static_cast<std::size_t>(local.x());
  }
  [[nodiscard]] Vector3i tile_of_slot(TileSlot slot) const;
  // The voxels of a tile that lie inside the box.
  [[nodiscard]] VoxelBox voxels_of_slot(TileSlot slot) const;

  [[nodiscard]] bool operator==(const GridGeometry& other) const;

 private:
  // std::floor is a library call without SSE4.1; this is not, and agrees within the int range.
  [[nodiscard]] int floor_index(double coordinate_m) const {
    const double scaled = coordinate_m * inverse_resolution_;
    const int truncated = static_cast<int>(scaled);
    return truncated - (scaled < truncated ? 1 : 0);
  }

  double resolution_m_;
  double inverse_resolution_;
  VoxelBox voxels_;
  Vector3i tile_min_;
  Vector3i tile_count_;
};

}  // namespace understory
