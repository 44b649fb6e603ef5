// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/team/layer_tile.hpp"

#include <algorithm>
#include <cassert>

#include <zstd.h>

namespace understory::team {
namespace {

constexpr std::size_t kPlaneBytes = 2 * kRowsPerTile;
constexpr std::size_t kRawBytes = 2 * kPlaneBytes;
constexpr int kCompressionLevel = 19;  // a few kilobytes take no time at any level

using Rows = std::array<std::uint16_t, kRowsPerTile>;

struct FreeCompressor {
  void operator()(ZSTD_CCtx* compressor) const { ZSTD_freeCCtx(compressor); }
};

void write_rows(const Rows& rows, std::uint8_t* bytes) {
  for (std::size_t row = 0; row < kRowsPerTile; ++row) {
    bytes[2 * row] = static_cast<std::uint8_t>(rows[row] & 0xFFU);
    bytes[2 * row + 1] = static_cast<std::uint8_t>(rows[row] >> 8U);
  }
}

Rows read_rows(const std::uint8_t* bytes) {
  Rows rows{};
  for (std::size_t row = 0; row < kRowsPerTile; ++row) {
    rows[row] = static_cast<std::uint16_t>(bytes[2 * row] | (bytes[2 * row + 1] << 8U));
  }
  return rows;
}

// Of these voxels of a row, those whose log-odds say occupied.
unsigned occupied_among(unsigned voxels, const std::int8_t* log_odds, int threshold) {
  unsigned occupied = 0;
  for (unsigned left = voxels; left != 0; left &= left - 1) {
    const auto x = static_cast<unsigned>(__builtin_ctz(left));
    occupied |= static_cast<int>(log_odds[x]) >= threshold ? 1U << x : 0U;
  }
  return occupied;
}

}  // namespace

VoxelState LayerTile::at(std::size_t offset) const {
  const unsigned bit = 1U << (offset & 15U);
  const bool maybe_free = (maybe_free_rows[offset >> 4U] & bit) != 0;
  const bool maybe_solid = (maybe_solid_rows[offset >> 4U] & bit) != 0;
  if (maybe_free) {
    return maybe_solid ? VoxelState::kUncertain : VoxelState::kFree;
  }
  return maybe_solid ? VoxelState::kOccupied : VoxelState::kUnknown;
}

void LayerTile::set(std::size_t offset, VoxelState state) {
  const auto bit = static_cast<std::uint16_t>(1U << (offset & 15U));
  const auto with = [bit](std::uint16_t row, bool on) {
    return static_cast<std::uint16_t>(on ? row | bit : row & ~bit);
  };
  const bool is_uncertain = state == VoxelState::kUncertain;
  std::uint16_t& maybe_free = maybe_free_rows[offset >> 4U];
  std::uint16_t& maybe_solid = maybe_solid_rows[offset >> 4U];
  maybe_free = with(maybe_free, is_uncertain || state == VoxelState::kFree);
  maybe_solid = with(maybe_solid, is_uncertain || state == VoxelState::kOccupied);
}

bool LayerTile::is_unknown() const {
  const auto is_zero = [](std::uint16_t row) { return row == 0; };
  return std::all_of(maybe_free_rows.begin(), maybe_free_rows.end(), is_zero) &&
         std::all_of(maybe_solid_rows.begin(), maybe_solid_rows.end(), is_zero);
}

LayerTile layer_of(const Tile& tile, const SensorModel& sensor_model) {
  LayerTile layer;
  for (std::size_t row = 0; row < kRowsPerTile; ++row) {
    const unsigned known = tile.known_rows[row];
    const unsigned not_free = known & ~static_cast<unsigned>(tile.free_rows[row]);
    const unsigned occupied = occupied_among(
        not_free, &tile.log_odds[row * kTileVoxels], sensor_model.occupied_threshold);
    layer.maybe_free_rows[row] = static_cast<std::uint16_t>(known & ~occupied);
    layer.maybe_solid_rows[row] = static_cast<std::uint16_t>(not_free);
  }
  return layer;
}

bool lies_within(const LayerTile& layer, const VoxelIndex& tile_origin, const VoxelBox& voxels) {
  unsigned inside = 0;  // of a row
  for (int x = 0; x < kTileVoxels; ++x) {
    const int voxel = tile_origin.x() + x;
    inside |=
        voxel >= voxels.min.x() && voxel < voxels.end.x() ? 1U << static_cast<unsigned>(x) : 0U;
  }
  unsigned outside_known = 0;
  for (int z = 0; z < kTileVoxels; ++z) {
    for (int y = 0; y < kTileVoxels; ++y) {
      const VoxelIndex voxel = tile_origin + VoxelIndex(0, y, z);
      const bool is_row_inside = voxel.y() >= voxels.min.y() && voxel.y() < voxels.end.y() &&
                                 voxel.z() >= voxels.min.z() && voxel.z() < voxels.end.z();
      const std::size_t row = row_in_tile(y, z);
      const unsigned known =
          static_cast<unsigned>(layer.maybe_free_rows[row]) | layer.maybe_solid_rows[row];
      outside_known |= is_row_inside ? known & ~inside : known;
    }
  }
  return outside_known == 0;
}

std::vector<std::uint8_t> encode_layers(const std::vector<LayerTile>& layers) {
  assert(!layers.empty() && layers.size() <= kMostLayers);
  std::vector<std::uint8_t> raw(layers.size() * kRawBytes);
  for (std::size_t i = 0; i < layers.size(); ++i) {
    write_rows(layers[i].maybe_free_rows, &raw[i * kRawBytes]);
    write_rows(layers[i].maybe_solid_rows, &raw[i * kRawBytes + kPlaneBytes]);
  }
  const std::unique_ptr<ZSTD_CCtx, FreeCompressor> compressor(ZSTD_createCCtx());
  ZSTD_CCtx_setParameter(compressor.get(), ZSTD_c_compressionLevel, kCompressionLevel);
  ZSTD_CCtx_setParameter(compressor.get(), ZSTD_c_checksumFlag, 1);
  std::vector<std::uint8_t> encoded(kMaxLayersBytes);
  static_assert(ZSTD_COMPRESSBOUND(kMostLayers * kRawBytes) <= kMaxLayersBytes);
  const std::size_t size =
      ZSTD_compress2(compressor.get(), encoded.data(), encoded.size(), raw.data(), raw.size());
  encoded.resize(ZSTD_isError(size) != 0 ? 0 : size);  // cannot be: there is room enough
  return encoded;
}

std::optional<std::vector<LayerTile>> decode_layers(const std::uint8_t* data, std::size_t size) {
  // One frame of exactly that content, nothing after it.
  const std::uint64_t raw_size = ZSTD_getFrameContentSize(data, size);
  if (size > kMaxLayersBytes || raw_size == 0 || raw_size > kMostLayers * kRawBytes ||
      raw_size % kRawBytes != 0 || ZSTD_findFrameCompressedSize(data, size) != size) {
    return std::nullopt;
  }
  std::vector<std::uint8_t> raw(raw_size);
  if (ZSTD_decompress(raw.data(), raw.size(), data, size) != raw_size) {
    return std::nullopt;
  }
  std::vector<LayerTile> layers;
  for (std::size_t at = 0; at < raw_size; at += kRawBytes) {
    layers.push_back({read_rows(&raw[at]), read_rows(&raw[at + kPlaneBytes])});
  }
  return layers;
}

}  // namespace understory::team
