// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Sets of voxels within a box, and how the true world fills them. World frame, metres. Values;
// nothing can fail.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "understory/map/grid_geometry.hpp"
#include "understory/sim/forest.hpp"

namespace understory {

class VoxelMask {
 public:
  VoxelMask(const VoxelBox& box, bool filled)
      : box_(box),
        size_(box.size()),
        cells_(static_cast<std::size_t>(size_.x()) * static_cast<std::size_t>(size_.y()) *
                   static_cast<std::size_t>(size_.z()),
               filled ? 1U : 0U) {}

  [[nodiscard]] const VoxelBox& box() const { return box_; }
  [[nodiscard]] bool contains(const VoxelIndex& voxel) const {  // false outside the box
    return box_.contains(voxel) && cells_[cell_of(voxel)] != 0;
  }
  void set(const VoxelIndex& voxel, bool member) { cells_[cell_of(voxel)] = member ? 1U : 0U; }

 private:
  [[nodiscard]] std::size_t cell_of(const VoxelIndex& voxel) const {
    const Vector3i local = voxel - box_.min;
    return (static_cast<std::size_t>(local.z()) * static_cast<std::size_t>(size_.y()) +
            static_cast<std::size_t>(local.y())) *
               static_cast<std::size_t>(size_.x()) +
           static_cast<std::size_t>(local.x());
  }

  VoxelBox box_;
  Vector3i size_;
  std::vector<std::uint8_t> cells_;
};

// Calls action(voxel) for every voxel of the box, x fastest.
template <class Action>
void for_each_voxel(const VoxelBox& box, const Action& action) {
  for (int z = box.min.z(); z < box.end.z(); ++z) {
    for (int y = box.min.y(); y < box.end.y(); ++y) {
      for (int x = box.min.x(); x < box.end.x(); ++x) {
        action(VoxelIndex(x, y, z));
      }
    }
  }
}

// Voxels of the box that no trunk and no triangle enters.
[[nodiscard]] VoxelMask free_voxels(const Forest& forest,
                                    const GridGeometry& geometry,
                                    const VoxelBox& box);

// What can be reached from the seeds by steps to face neighbours for which `admits` holds (asked at
// most once per voxel). Seeds that it does not hold for are left out.
[[nodiscard]] VoxelMask flooded(const VoxelBox& box,
                                const std::vector<VoxelIndex>& seeds,
                                const std::function<bool(const VoxelIndex&)>& admits);

// Whether a triangle and an axis-aligned box share a point.
[[nodiscard]] bool triangle_meets_box(const std::array<Vector3d, 3>& corners, const Box3d& box);

}  // namespace understory
