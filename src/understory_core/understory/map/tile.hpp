// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// 16^3 voxels of the map: quantised log-odds and, derived from them, one bit per voxel for "free"
// and for "known", so that readers test 16 voxels with one operation. Immutable once published;
// only the mapper writes tiles, and only those that nobody else holds.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "understory/map/grid_geometry.hpp"

namespace understory {

enum class VoxelState : std::uint8_t {
  kUnknown,    // never observed
  kFree,       // log-odds below 0: the only state to fly through
  kUncertain,  // observed, log-odds from 0 up to the occupied threshold; an obstacle for flight
  kOccupied,
};

inline constexpr std::size_t kVoxelsPerTile = 4096;
inline constexpr std::size_t kRowsPerTile = 256;
inline constexpr std::int8_t kUnknownLogOdds = -128;

// Of a voxel within its tile: x fastest, then y, then z; a row is 16 voxels along x.
[[nodiscard]] constexpr std::size_t row_in_tile(int y, int z) {
  return (static_cast<std::size_t>(z) & 15U) * 16U + (static_cast<std::size_t>(y) & 15U);
}
[[nodiscard]] inline std::size_t offset_in_tile(const VoxelIndex& voxel) {
  return row_in_tile(voxel.y(), voxel.z()) * 16U + (static_cast<std::size_t>(voxel.x()) & 15U);
}

struct Tile {
  std::array<std::int8_t, kVoxelsPerTile> log_odds{};    // unit: SensorModel::kLogOddsUnit
  std::array<std::uint16_t, kRowsPerTile> free_rows{};   // bit x set: free
  std::array<std::uint16_t, kRowsPerTile> known_rows{};  // bit x set: observed at least once

  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init): filled once, not twice
  Tile() { log_odds.fill(kUnknownLogOdds); }

  [[nodiscard]] bool is_free(const VoxelIndex& voxel) const { return test(free_rows, voxel); }
  [[nodiscard]] bool is_known(const VoxelIndex& voxel) const { return test(known_rows, voxel); }

  [[nodiscard]] int log_odds_at(std::size_t offset) const {
    return static_cast<int>(log_odds[offset]);  // NOLINT(bugprone-signed-char-misuse): it is signed
  }

  // Writes one voxel, log-odds and bits.
  void set(std::size_t offset, std::int8_t value) {
    const auto bit = static_cast<std::uint16_t>(1U << (offset & 15U));
    std::uint16_t& free_row = free_rows[offset >> 4U];
    std::uint16_t& known_row = known_rows[offset >> 4U];
    const bool is_known = value != kUnknownLogOdds;
    const bool is_free = is_known && value < 0;
    log_odds[offset] = value;
    free_row = static_cast<std::uint16_t>(is_free ? free_row | bit : free_row & ~bit);
    known_row = static_cast<std::uint16_t>(is_known ? known_row | bit : known_row & ~bit);
  }

 private:
  [[nodiscard]] static bool test(const std::array<std::uint16_t, kRowsPerTile>& rows,
                                 const VoxelIndex& voxel) {
    const std::size_t bit = static_cast<std::size_t>(voxel.x()) & 15U;
    const unsigned row = rows[row_in_tile(voxel.y(), voxel.z())];
    return ((row >> bit) & 1U) != 0;
  }
};

}  // namespace understory
