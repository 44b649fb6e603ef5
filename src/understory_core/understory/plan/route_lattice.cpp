// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/plan/route_lattice.hpp"

#include <algorithm>
#include <cmath>

namespace understory {

RouteLattice::RouteLattice(const GridGeometry& geometry, const Spacing& spacing)
    : resolution_m_(geometry.resolution_m()), spacing_(spacing), first_(geometry.voxels().min) {
  first_.z() += spacing_.first_layer_voxels;
  const Vector3i size = geometry.voxels().end - first_;
  const auto steps = [](int voxels, int step) { return (voxels + step - 1) / step; };
  count_ = Vector3i(steps(size.x(), spacing_.step_voxels),
                    steps(size.y(), spacing_.step_voxels),
                    steps(size.z(), spacing_.layer_step_voxels))
               .cwiseMax(0);
}

RouteLattice::Spacing RouteLattice::flat(const GridGeometry& geometry, int step_voxels) {
  const int height = geometry.voxels().end.z() - geometry.voxels().min.z();
  return {step_voxels, std::max(height, 1), height / 2};
}

RouteLattice::Node RouteLattice::node_of_index(std::size_t index) const {
  const auto nx = static_cast<std::size_t>(count_.x());
  const auto ny = static_cast<std::size_t>(count_.y());
  return {static_cast<int>(index % nx),
          static_cast<int>(index / nx % ny),
          static_cast<int>(index / (nx * ny))};
}

RouteLattice::Node RouteLattice::nearest(const Vector3d& point_m) const {
  const Vector3d local = point_m / resolution_m_ - (first_.cast<double>().array() + 0.5).matrix();
  return {static_cast<int>(std::lround(local.x() / spacing_.step_voxels)),
          static_cast<int>(std::lround(local.y() / spacing_.step_voxels)),
          static_cast<int>(std::lround(local.z() / spacing_.layer_step_voxels))};
}

}  // namespace understory
