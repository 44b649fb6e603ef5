// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/top_view.hpp"

#include <cassert>

namespace understory {
namespace {

template <class Predicate>
TopView share_of(const GridGeometry& geometry, const Predicate& counts) {
  const VoxelBox& voxels = geometry.voxels();
  TopView view;
  view.corner_m = geometry.box_m().min().head<2>();
  view.resolution_m = geometry.resolution_m();
  view.width = voxels.size().x();
  view.height = voxels.size().y();
  view.values.reserve(static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height));
  for (int y = voxels.min.y(); y < voxels.end.y(); ++y) {
    for (int x = voxels.min.x(); x < voxels.end.x(); ++x) {
      int counted = 0;
      for (int z = voxels.min.z(); z < voxels.end.z(); ++z) {
        counted += counts(VoxelIndex(x, y, z)) ? 1 : 0;
      }
      view.values.push_back(static_cast<float>(counted) / static_cast<float>(voxels.size().z()));
    }
  }
  return view;
}

}  // namespace

TopView unknown_share(const MapSnapshot& map) {
  return share_of(map.geometry, [&](const VoxelIndex& voxel) { return !map.is_known(voxel); });
}

TopView occupied_share(const MapSnapshot& map) {
  return share_of(map.geometry, [&](const VoxelIndex& voxel) {
    return map.state(voxel) == VoxelState::kOccupied;
  });
}

TopView missed_share(const CoverageTruth& truth, const MapSnapshot& map) {
  assert(map.geometry == truth.geometry());
  return share_of(map.geometry, [&](const VoxelIndex& voxel) {
    return truth.contains(voxel) && !map.is_free(voxel);
  });
}

}  // namespace understory
