// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What the reader and the writer of OctoMap's files share. A file is a text header (first line,
// comments, id, size, res, data) and a tree in depth-first order, child i at bits x = i & 1,
// y = i >> 1 & 1, z = i >> 2. `.ot`: per node a little-endian float log-odds and a byte of child
// bits. `.bt`: per inner node 16 bits, two per child (1 free leaf, 2 occupied leaf, 3 inner).
#pragma once

#include <optional>
#include <string>

#include "understory/map/grid_geometry.hpp"

namespace understory::octomap_format {

enum class Encoding { kLogOdds, kMaximumLikelihood };

inline constexpr const char* kLogOddsFirstLine = "# Octomap OcTree file";
inline constexpr const char* kMaximumLikelihoodFirstLine = "# Octomap OcTree binary file";
inline constexpr const char* kTreeType = "OcTree";

inline constexpr int kTreeLevels = 16;                     // the root's cube is 2^16 voxels wide
inline constexpr int kKeyOrigin = 1 << (kTreeLevels - 1);  // key of voxel 0 on each axis

inline constexpr unsigned kFreeLeaf = 1;
inline constexpr unsigned kOccupiedLeaf = 2;
inline constexpr unsigned kInnerNode = 3;

[[nodiscard]] inline VoxelIndex root_corner() {
  return VoxelIndex::Constant(-kKeyOrigin);
}

// Corner of child i of a cube whose children are `child_edge` voxels wide.
[[nodiscard]] inline VoxelIndex child_corner(const VoxelIndex& corner, int child_edge, unsigned i) {
  return corner + child_edge * VoxelIndex(static_cast<int>(i & 1U),
                                          static_cast<int>((i >> 1U) & 1U),
                                          static_cast<int>((i >> 2U) & 1U));
}

// Nothing for an extension that is neither `.ot` nor `.bt`.
[[nodiscard]] std::optional<Encoding> encoding_of(const std::string& path);

}  // namespace understory::octomap_format
