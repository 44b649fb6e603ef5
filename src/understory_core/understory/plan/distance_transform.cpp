// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/plan/distance_transform.hpp"

#include <algorithm>
#include <cstring>

namespace understory {
namespace {

constexpr std::size_t kRow = kTileVoxels;
constexpr std::size_t kPlane = kRow * kRow;
constexpr std::size_t kBlock = kBlockVoxels;
constexpr std::size_t kHalo = kHaloVoxels;
// Offsets of 8 and more cannot undercut the saturated value.
constexpr int kReach = kHaloVoxels - 1;

using Bytes8 = std::array<std::uint8_t, 8>;
using SpreadTable = std::array<Bytes8, 256>;

// Bit i of the index becomes byte i: 0xFF or 0.
constexpr SpreadTable make_spread_table() {
  SpreadTable table{};
  for (std::size_t bits = 0; bits < table.size(); ++bits) {
    for (std::size_t i = 0; i < 8; ++i) {
      table[bits][i] = ((bits >> i) & 1U) != 0 ? 0xFF : 0;
    }
  }
  return table;
}
constexpr SpreadTable kSpread = make_spread_table();

// Squared distances along x for the 16 voxels in the middle of a row: the set of voxels whose
// k neighbours on both sides are free shrinks with k, and k^2 grows by 2 k + 1.
void distances_along_x(std::uint32_t free_bits, std::uint8_t* out) {
  std::uint32_t surviving = (free_bits >> kHalo) & 0xFFFFU;
  if (free_bits == 0xFFFFFFFFU) {
    std::memset(out, kSaturatedSquare, kRow);
    return;
  }
  std::memset(out, 0, kRow);
  for (unsigned k = 0; surviving != 0 && k <= kReach; ++k) {
    surviving &= (free_bits >> (kHalo - k)) & (free_bits >> (kHalo + k));
    const auto step = static_cast<std::uint8_t>(2 * k + 1);
    const Bytes8& low = kSpread[surviving & 0xFFU];
    const Bytes8& high = kSpread[(surviving >> 8U) & 0xFFU];
    for (std::size_t i = 0; i < 8; ++i) {
      out[i] = static_cast<std::uint8_t>(out[i] + (low[i] & step));
    }
    for (std::size_t i = 0; i < 8; ++i) {
      out[8 + i] = static_cast<std::uint8_t>(out[8 + i] + (high[i] & step));
    }
  }
}

// out[i] = min over k of in[i + k * stride] + k^2 for one plane of bytes; `in` points to k = 0.
void lower_envelope(const std::uint8_t* in, std::size_t stride, std::uint8_t* __restrict out) {
  std::memcpy(out, in, kPlane);
  for (std::size_t k = 1; k <= kReach; ++k) {
    const auto square = static_cast<std::uint8_t>(k * k);
    const std::uint8_t* before = in - k * stride;
    const std::uint8_t* after = in + k * stride;
    for (std::size_t i = 0; i < kPlane; ++i) {
      const std::uint8_t nearer = std::min(before[i], after[i]);
      // At most 64 + 49: no overflow.
      out[i] = std::min(out[i], static_cast<std::uint8_t>(nearer + square));
    }
  }
}

// Is nothing free in a plane of rows?
bool is_blocked(const std::uint32_t* rows) {
  return std::all_of(rows, rows + kBlock, [](std::uint32_t row) { return row == 0; });
}

}  // namespace

std::array<std::uint8_t, kVoxelsPerTile> squared_distances(const FreeBlock& block) {
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init): written in full before it is read
  std::array<std::uint8_t, kBlock * kRow> plane;  // one z: 32 rows in y
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init): written in full before it is read
  std::array<std::uint8_t, kBlock * kPlane> xy;  // z from -8 to 23
  for (std::size_t z = 1; z < kBlock; ++z) {
    if (is_blocked(&block[z * kBlock])) {  // above and below the box, many are
      std::memset(&xy[z * kPlane], 0, kPlane);
      continue;
    }
    for (std::size_t y = 1; y < kBlock; ++y) {
      distances_along_x(block[z * kBlock + y], &plane[y * kRow]);
    }
    lower_envelope(&plane[kHalo * kRow], kRow, &xy[z * kPlane]);
  }
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init): written in full before it is read
  std::array<std::uint8_t, kVoxelsPerTile> out;
  for (std::size_t z = 0; z < kRow; ++z) {
    if (is_blocked(&block[(z + kHalo) * kBlock])) {
      std::memset(&out[z * kPlane], 0, kPlane);
      continue;
    }
    lower_envelope(&xy[(z + kHalo) * kPlane], kPlane, &out[z * kPlane]);
  }
  return out;
}

}  // namespace understory
