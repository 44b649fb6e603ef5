// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What one vehicle's own observations say of a tile: the state of each of its 16^3 voxels, two bits
// each, laid out as in Tile. A value. Several are encoded together, compressed and with a checksum;
// decoding takes any bytes and returns layers or nothing.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "understory/map/sensor_model.hpp"
#include "understory/map/tile.hpp"

namespace understory::team {

struct LayerTile {
  // Neither bit: unknown; both: uncertain.
  std::array<std::uint16_t, kRowsPerTile> maybe_free_rows{};
  std::array<std::uint16_t, kRowsPerTile> maybe_solid_rows{};

  [[nodiscard]] VoxelState at(std::size_t offset) const;
  void set(std::size_t offset, VoxelState state);
  [[nodiscard]] bool is_unknown() const;  // throughout

  friend bool operator==(const LayerTile& a, const LayerTile& b) {
    return a.maybe_free_rows == b.maybe_free_rows && a.maybe_solid_rows == b.maybe_solid_rows;
  }
};

using LayerTilePtr = std::shared_ptr<const LayerTile>;

[[nodiscard]] LayerTile layer_of(const Tile& tile, const SensorModel& sensor_model);

// Whether nothing is known outside of these voxels; `tile_origin` is the tile's first voxel.
[[nodiscard]] bool lies_within(const LayerTile& layer,
                               const VoxelIndex& tile_origin,
                               const VoxelBox& voxels);

inline constexpr std::size_t kMostLayers = 8;         // encoded together
inline constexpr std::size_t kMaxLayersBytes = 8400;  // that do not compress take less

// Of 1 to kMostLayers.
[[nodiscard]] std::vector<std::uint8_t> encode_layers(const std::vector<LayerTile>& layers);
[[nodiscard]] std::optional<std::vector<LayerTile>> decode_layers(const std::uint8_t* data,
                                                                  std::size_t size);

}  // namespace understory::team
