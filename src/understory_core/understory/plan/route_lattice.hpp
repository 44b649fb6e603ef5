// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// The points between which routes are searched: voxel centres at equal steps all over the box, if
// nothing else is said every second one in x and y, every fourth in z. World frame, metres. Values;
// nothing fails.
#pragma once

#include <cstddef>

#include "understory/map/grid_geometry.hpp"

namespace understory {

class RouteLattice {
 public:
  struct Spacing {
    int step_voxels = 2;         // in x and y
    int layer_step_voxels = 4;   // in z
    int first_layer_voxels = 1;  // above the lowest voxel of the box
  };

  explicit RouteLattice(const GridGeometry& geometry) : RouteLattice(geometry, Spacing{}) {}
  RouteLattice(const GridGeometry& geometry, const Spacing& spacing);
  // One layer half-way up.
  [[nodiscard]] static Spacing flat(const GridGeometry& geometry, int step_voxels);

  using Node = Vector3i;  // lattice coordinates, from zero

  [[nodiscard]] double step_m() const { return spacing_.step_voxels * resolution_m_; }
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
    return {first_.x() + node.x() * spacing_.step_voxels,
            first_.y() + node.y() * spacing_.step_voxels,
            first_.z() + node.z() * spacing_.layer_step_voxels};
  }
  [[nodiscard]] Vector3d point_of(const Node& node) const {
    return (voxel_of(node).cast<double>().array() + 0.5) * resolution_m_;
  }
  // The node nearest to a point on each axis; may lie outside the lattice.
  [[nodiscard]] Node nearest(const Vector3d& point_m) const;

 private:
  double resolution_m_;
  Spacing spacing_;
  VoxelIndex first_;
  Vector3i count_;
};

}  // namespace understory
