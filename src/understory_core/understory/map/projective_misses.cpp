// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>

#include "understory/map/projective_integration.hpp"
#include "understory/map/vector_float.hpp"

namespace understory {
namespace {

// Not smaller than any depth, "no return" (infinite) included.
constexpr float kBeyondEverything = std::numeric_limits<float>::infinity();
constexpr int kLanes = kTileVoxels;  // a row of a tile

// The 16 rows along x of one layer of a tile: which voxels' centres lie between the planes.
struct RowSpans {
  std::array<float, kLanes> first;
  std::array<float, kLanes> last;

  void clip(float slope, float start, float start_per_row) {
    // start + start_per_row * row + slope * x >= 0
    if (std::abs(slope) < 1e-6F) {
      for (std::size_t row = 0; row < first.size(); ++row) {
        const float value = start + start_per_row * static_cast<float>(row);
        last[row] = value >= 0.0F ? last[row] : -1.0F;
      }
      return;
    }
    const float offset = -start / slope;
    const float per_row = -start_per_row / slope;
    if (slope > 0.0F) {
      for (int row = 0; row < kLanes; ++row) {
        const float bound = offset + per_row * static_cast<float>(row);
        first[static_cast<std::size_t>(row)] = larger(bound, first[static_cast<std::size_t>(row)]);
      }
    } else {
      for (int row = 0; row < kLanes; ++row) {
        const float bound = offset + per_row * static_cast<float>(row);
        last[static_cast<std::size_t>(row)] = smaller(bound, last[static_cast<std::size_t>(row)]);
      }
    }
  }

  // Bit x: inside.
  [[nodiscard]] std::uint32_t bits(std::size_t row) const {
    const float low = smaller(first[row], 16.0F);
    const float high = larger(last[row], -1.0F);
    int begin = static_cast<int>(low);
    begin += low > static_cast<float>(begin) ? 1 : 0;
    const int end = static_cast<int>(high + 1.0F);
    return begin < end ? (1U << static_cast<unsigned>(end)) - (1U << static_cast<unsigned>(begin))
                       : 0U;
  }
};

// Eight values as one number; bit 0 of each byte that is not zero, packed.
std::uint32_t nonzero_bytes(std::uint64_t bytes) {
  constexpr std::uint64_t kLow7 = 0x7F7F7F7F7F7F7F7FU;
  const std::uint64_t flags = ((((bytes & kLow7) + kLow7) | bytes) & ~kLow7) >> 7U;
  return static_cast<std::uint32_t>((flags * 0x0102040810204080U) >> 56U);
}

// Bit x: the row's voxel differs from `value`.
std::uint32_t bits_other_than(const std::int8_t* row, std::int8_t value) {
  std::uint64_t low = 0;
  std::uint64_t high = 0;
  std::memcpy(&low, row, sizeof(low));
  std::memcpy(&high, row + sizeof(low), sizeof(high));
  const std::uint64_t pattern = 0x0101010101010101U * static_cast<std::uint8_t>(value);
  return nonzero_bytes(low ^ pattern) | (nonzero_bytes(high ^ pattern) << 8U);
}

class FrustumMarker {
 public:
  FrustumMarker(const CameraView& view, const std::vector<float>& block_depths_vox)
      : view_(view),
        block_depths_vox_(block_depths_vox.data()),
        stride_(view.camera().width_px),
        // Up to the last block whose four pixels exist.
        u_limit_(static_cast<float>(view.camera().width_px) - 1.001F),
        v_limit_(static_cast<float>(view.camera().height_px) - 1.001F) {
    range_squared_ = view.range_vox() * view.range_vox();
  }

  [[nodiscard]] bool may_see(const VoxelBox& voxels) const {
    const Eigen::Vector3f half = 0.5F * (voxels.size().array() - 1).cast<float>();
    const Eigen::Vector3f center =
        (voxels.min.cast<double>().array() + 0.5 - view_.origin_vox().array()).cast<float>() +
        half.array();
    const Eigen::Vector3f gap = (center.cwiseAbs() - half).cwiseMax(0.0F);
    if (gap.squaredNorm() > range_squared_) {
      return false;
    }
    return std::all_of(view_.planes().begin(), view_.planes().end(), [&](const auto& plane) {
      const float reach = plane.inward_normal.cwiseAbs().dot(half);
      return plane.inward_normal.dot(center) + reach >= plane.offset_vox;
    });
  }

  // `cells` are the tile's log-odds. Rows and columns outside `voxels` stay unmarked.
  void mark_tile(const VoxelBox& voxels,
                 const std::int8_t* cells,
                 std::int8_t free_clamp,
                 BitRows& misses) const {
    const VoxelIndex corner(
        voxels.min.x() & ~(kTileVoxels - 1), voxels.min.y() & ~(kTileVoxels - 1), voxels.min.z());
    for (int z = voxels.min.z(); z < voxels.end.z(); ++z) {
      const Eigen::Vector3f start = (VoxelIndex(corner.x(), corner.y(), z).cast<double>().array() +
                                     0.5 - view_.origin_vox().array())
                                        .cast<float>();
      const RowSpans spans = spans_of_layer(start, voxels, corner.x());
      for (int y = voxels.min.y(); y < voxels.end.y(); ++y) {
        const std::size_t row = row_in_tile(y, z);
        const auto row_of_layer = static_cast<std::size_t>(y - corner.y());
        std::uint32_t bits = spans.bits(row_of_layer);
        if (bits != 0) {
          bits &= bits_other_than(cells + row * kTileVoxels, free_clamp);
        }
        if (bits != 0) {
          const Eigen::Vector3f row_start(
              start.x(), start.y() + static_cast<float>(row_of_layer), start.z());
          misses[row] = static_cast<std::uint16_t>(bits & seen_past(row_start));
        }
      }
    }
  }

 private:
  [[nodiscard]] RowSpans spans_of_layer(const Eigen::Vector3f& start,
                                        const VoxelBox& voxels,
                                        int corner_x) const {
    RowSpans spans{};
    spans.first.fill(static_cast<float>(voxels.min.x() - corner_x));
    spans.last.fill(static_cast<float>(voxels.end.x() - 1 - corner_x));
    for (const CameraView::Plane& plane : view_.planes()) {
      const Eigen::Vector3f& normal = plane.inward_normal;
      spans.clip(normal.x(), normal.dot(start) - plane.offset_vox, normal.y());
    }
    return spans;
  }

  // Bit x: the four pixels around the centre of voxel x of the row that starts here saw beyond it.
  [[nodiscard]] std::uint32_t seen_past(const Eigen::Vector3f& start) const {
    const Eigen::Matrix3f& image = view_.image_from_world();
    const Eigen::Vector3f image0 = image * start;
    const float u0 = image0.x(), v0 = image0.y(), z0 = image0.z();
    const float du = image(0, 0), dv = image(1, 0), dz = image(2, 0);
    const float x0 = start.x(), range_squared = range_squared_;
    const float yz_squared = start.y() * start.y() + start.z() * start.z();
    const float u_limit = u_limit_, v_limit = v_limit_;
    std::array<float, kLanes> depth;  // NOLINT(cppcoreguidelines-pro-type-member-init)
    std::array<int, kLanes> block_u;  // NOLINT(cppcoreguidelines-pro-type-member-init)
    std::array<int, kLanes> block_v;  // NOLINT(cppcoreguidelines-pro-type-member-init)
    for (int i = 0; i < kLanes; ++i) {
      const auto lane = static_cast<std::size_t>(i);
      const auto step = static_cast<float>(i);
      const float z = z0 + step * dz;
      const float inverse_z = 1.0F / z;
      const float u = (u0 + step * du) * inverse_z;
      const float v = (v0 + step * dv) * inverse_z;
      const float x = x0 + step;
      block_u[lane] = static_cast<int>(smaller(larger(u, 0.0F), u_limit));
      block_v[lane] = static_cast<int>(smaller(larger(v, 0.0F), v_limit));
      // NOLINTNEXTLINE(cppcoreguidelines-narrowing-conversions): a float constant stays a float
      depth[lane] = x * x + yz_squared <= range_squared ? z : kBeyondEverything;
    }
    std::uint32_t bits = 0;
    for (std::size_t lane = 0; lane < depth.size(); ++lane) {
      const int block = block_v[lane] * stride_ + block_u[lane];
      bits |= (depth[lane] < block_depths_vox_[block] ? 1U : 0U) << lane;
    }
    return bits;
  }

  const CameraView& view_;
  const float* block_depths_vox_;
  int stride_;
  float u_limit_;
  float v_limit_;
  float range_squared_ = 0.0F;
};

}  // namespace

void ProjectiveIntegration::mark_misses(const CameraView& view,
                                        const MapSnapshot& map,
                                        ScanWindow& window) const {
  const FrustumMarker marker(view, block_depths_vox_);
  const auto free_clamp = static_cast<std::int8_t>(map.sensor_model.min);
  const Vector3i end = window.tile_min() + window.tile_count();
  for (int z = window.tile_min().z(); z < end.z(); ++z) {
    for (int y = window.tile_min().y(); y < end.y(); ++y) {
      for (int x = window.tile_min().x(); x < end.x(); ++x) {
        const Vector3i tile(x, y, z);
        const VoxelIndex min = tile * kTileVoxels;
        const VoxelIndex tile_end = min.array() + kTileVoxels;
        const VoxelBox voxels = VoxelBox{min, tile_end}.clipped_to(window.voxels());
        if (marker.may_see(voxels)) {
          const TilePtr& current = map.tiles[map.geometry.slot_of_tile(tile)];
          const Tile& content = current ? *current : unknown_tile_;
          marker.mark_tile(
              voxels, content.log_odds.data(), free_clamp, window.marks_of_tile(tile).misses);
        }
      }
    }
  }
}

}  // namespace understory
