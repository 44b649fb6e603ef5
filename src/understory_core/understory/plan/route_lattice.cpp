// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/plan/route_lattice.hpp"

#include <cmath>

namespace understory {

RouteLattice::RouteLattice(const GridGeometry& geometry)
    : resolution_m_(geometry.resolution_m()), first_(geometry.voxels().min) {
  first_.z() += kFirstLayerVoxels;
  const Vector3i size = geometry.voxels().end - first_;
  count_ = Vector3i((size.x() + kStepVoxels - 1) / kStepVoxels,
                    (size.y() + kStepVoxels - 1) / kStepVoxels,
                    (size.z() + kLayerStepVoxels - 1) / kLayerStepVoxels)
               .cwiseMax(0);
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
  return {static_cast<int>(std::lround(local.x() / kStepVoxels)),
          static_cast<int>(std::lround(local.y() / kStepVoxels)),
          static_cast<int>(std::lround(local.z() / kLayerStepVoxels))};
}

}  // namespace understory
