// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Exact squared Euclidean distances within one map tile to the nearest voxel that is not free,
// saturating at 64, from the free bits of the tile and 8 voxels around it. Pure functions.
// Source: separable lower envelopes (Felzenszwalb and Huttenlocher 2012); the window is so small
// that a minimum over all offsets on bytes, 16 at a time, beats the envelope itself.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "understory/map/tile.hpp"

namespace understory {

inline constexpr int kHaloVoxels = 8;
inline constexpr int kBlockVoxels = kTileVoxels + 2 * kHaloVoxels;
inline constexpr int kSaturatedSquare = kHaloVoxels * kHaloVoxels;

// Bit x of row [z * kBlockVoxels + y] is set where the voxel (x, y, z) of the block is free.
using FreeBlock = std::array<std::uint32_t, std::size_t{kBlockVoxels} * std::size_t{kBlockVoxels}>;

// In the order of offset_in_tile.
[[nodiscard]] std::array<std::uint8_t, kVoxelsPerTile> squared_distances(const FreeBlock& block);

}  // namespace understory
