// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// The points between which routes are searched: every second voxel centre in x and y, every fourth
// in z, all over the box. World frame, metres. Values; nothing fails.
#pragma once

#include <cstddef>

#include "understory/map/grid_geometry.hpp"

namespace understory {

class RouteLattice {
 public:
  static constexpr int kStepVoxels = 2;        // in x and y
  static constexpr int kLayerStepVoxels = 4;   // in z
  static constexpr int kFirstLayerVoxels = 1;  // above the lowest voxel of the box

  explicit RouteLattice(const GridGeometry& geometry);

  using Node = Vector3i;  // lattice coordinates, from zero

  [[nodiscard]] const Vector3i& count() const { return count_; }
  [[nodiscard]] std::size_t node_count() const {
    return static_cast<std::size_t>(count_.x()) * static_cast<std::size_t>(count_.y()) *
           static_cast<std::size_t>(count_.z());
  }
  [[nodiscard]] bool contains(const Node& node) const {
    return (node.array() >= 0).all() && (node.array() < count_.array()).all();
  }
  [[nodiscard]] std::size_t index_of(const Node& node) const {
    return (static_cast<std::size_t>(node.z()) * static_cast<std::size_t>(count_.y()) +
            static_cast<std::size_t>(node.y())) *
               static_cast<std::size_t>(count_.x()) +
           static_cast<std::size_t>(node.x());
  }
  [[nodiscard]] Node node_of_index(std::size_t index) const;
  [[nodiscard]] VoxelIndex voxel_of(const Node& node) const {
    return {first_.x() + node.x() * kStepVoxels,
            first_.y() + node.y() * kStepVoxels,
            first_.z() + node.z() * kLayerStepVoxels};
  }
  [[nodiscard]] Vector3d point_of(const Node& node) const {
    return (voxel_of(node).cast<double>().array() + 0.5) * resolution_m_;
  }
  // The node nearest to a point on each axis; may lie outside the lattice.
  [[nodiscard]] Node nearest(const Vector3d& point_m) const;

 private:
  double resolution_m_;
  VoxelIndex first_;
  Vector3i count_;
};

}  // namespace understory
