// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <limits>

#include "understory/map/projective_integration.hpp"
#include "understory/map/vector_float.hpp"

namespace understory {
namespace {

// A centre this little in front of the surface is not cleared: between two pixels a round trunk
// bulges towards the camera by less.
constexpr float kSurfaceMarginVox = 0.1F;

// Voxel of every pixel of a piece of an image row, counted from 1 within the window; 0 and
// size + 1 are outside.
struct PixelVoxels {
  static constexpr int kCapacity = 128;
  std::array<int, kCapacity> x;
  std::array<int, kCapacity> y;
  std::array<int, kCapacity> z;
};

float range_squared_m2(const CameraView& view) {
  const double range_m = static_cast<double>(view.range_vox()) * view.resolution_m();
  return static_cast<float>(range_m * range_m);
}

class ReturnLocator {
 public:
  ReturnLocator(const CameraView& view, const ScanWindow& window)
      : inverse_fx_(static_cast<float>(1.0 / view.camera().fx)),
        cx_(static_cast<float>(view.camera().cx)),
        range_squared_m2_(range_squared_m2(view)),
        view_(view),
        // One more, so that what lies just below the window truncates to 0.
        start_((view.origin_vox() - window.voxels().min.cast<double>()).cast<float>().array() + 1),
        limit_(window.voxels().size().cast<float>().array() + 1.0F) {
    const float scale = static_cast<float>(1.0 / view.resolution_m());
    per_column_ = view.world_from_optical().col(0) * (scale * inverse_fx_);
    scale_ = scale;
  }

  void start_row(int v) {
    const CameraModel& camera = view_.camera();
    const auto yn = static_cast<float>((v - camera.cy) / camera.fy);
    const Eigen::Vector3f ray(-cx_ * inverse_fx_, yn, 1.0F);
    row_ray_ = view_.world_from_optical() * ray * scale_;
    row_norm_squared_ = yn * yn + 1.0F;
  }

  void locate(const float* z_m, int first_u, int count, PixelVoxels& voxels) const {
    const Eigen::Vector3f ray0 = row_ray_ + per_column_ * static_cast<float>(first_u);
    const float sx = start_.x(), sy = start_.y(), sz = start_.z();
    const float lx = limit_.x(), ly = limit_.y(), lz = limit_.z();
    const float rx = ray0.x(), ry = ray0.y(), rz = ray0.z();
    const float dx = per_column_.x(), dy = per_column_.y(), dz = per_column_.z();
    const float xn0 = (static_cast<float>(first_u) - cx_) * inverse_fx_;
    const float dxn = inverse_fx_, norm0 = row_norm_squared_, range2 = range_squared_m2_;
    for (int i = 0; i < count; ++i) {
      const float z = z_m[i];
      const auto column = static_cast<float>(i);
      const float xn = xn0 + column * dxn;
      // NaN, zero, negative, infinite and too far all fail one of the two.
      const bool is_return = (z > 0.0F) & (z * z * (xn * xn + norm0) <= range2);
      const float x = smaller(larger(sx + z * (rx + column * dx), 0.0F), lx);
      const float y = smaller(larger(sy + z * (ry + column * dy), 0.0F), ly);
      const float w = smaller(larger(sz + z * (rz + column * dz), 0.0F), lz);
      const auto index = static_cast<std::size_t>(i);
      voxels.x[index] = static_cast<int>(is_return ? x : 0.0F);
      voxels.y[index] = static_cast<int>(y);
      voxels.z[index] = static_cast<int>(w);
    }
  }

 private:
  float inverse_fx_;
  float cx_;
  float range_squared_m2_;
  float scale_ = 0.0F;
  const CameraView& view_;
  Eigen::Vector3f start_;
  Eigen::Vector3f limit_;
  Eigen::Vector3f per_column_;
  Eigen::Vector3f row_ray_ = Eigen::Vector3f::Zero();
  float row_norm_squared_ = 0.0F;
};

void mark_located(const PixelVoxels& voxels, int count, ScanWindow& window) {
  const VoxelIndex before = window.voxels().min.array() - 1;
  const Vector3i size = window.voxels().size();
  const auto nx = static_cast<unsigned>(size.x());
  const auto ny = static_cast<unsigned>(size.y());
  const auto nz = static_cast<unsigned>(size.z());
  int px = 0;
  int py = 0;
  int pz = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    const int x = voxels.x[i];
    const int y = voxels.y[i];
    const int z = voxels.z[i];
    if (((x ^ px) | (y ^ py) | (z ^ pz)) == 0) {
      continue;  // neighbouring pixels mostly share their voxel
    }
    px = x;
    py = y;
    pz = z;
    if (static_cast<unsigned>(x) - 1U < nx && static_cast<unsigned>(y) - 1U < ny &&
        static_cast<unsigned>(z) - 1U < nz) {
      window.mark_hit(before + VoxelIndex(x, y, z));
    }
  }
}

}  // namespace

void ProjectiveIntegration::note_image_row(const float* z_m, int v, double inverse_resolution) {
  const auto width = static_cast<std::size_t>(width_px_);
  const auto scale = static_cast<float>(inverse_resolution);
  float* pairs = pair_depths_vox_.data();
  float* blocks = block_depths_vox_.data() + static_cast<std::size_t>(std::max(v - 1, 0)) * width;
  for (std::size_t u = 0; u + 1 < width; ++u) {
    // "No return" is infinitely far; what measured nothing (NaN, and 0 by many drivers) is at 0.
    const float here = larger(z_m[u], 0.0F);
    const float next = larger(z_m[u + 1], 0.0F);
    const float pair = smaller(here, next) * scale - kSurfaceMarginVox;
    blocks[u] = smaller(pair, pairs[u]);
    pairs[u] = pair;
  }
}

std::size_t ProjectiveIntegration::mark_hits(const CameraView& view,
                                             const DepthView& depth,
                                             ScanWindow& window) {
  width_px_ = depth.width_px;
  const auto width = static_cast<std::size_t>(depth.width_px);
  const auto height = static_cast<std::size_t>(depth.height_px);
  row_z_m_.resize(width);
  block_depths_vox_.resize(width * height);
  pair_depths_vox_.assign(width, std::numeric_limits<float>::max());

  ReturnLocator locator(view, window);
  PixelVoxels voxels;  // NOLINT(cppcoreguidelines-pro-type-member-init): filled piece by piece
  std::size_t skipped = 0;
  for (int v = 0; v < depth.height_px; ++v) {
    const float* source = depth.z_m + static_cast<std::size_t>(v) * width * depth.stride_floats;
    unsigned measured = 0;
    for (std::size_t u = 0; u < width; ++u) {
      const float z = source[u * depth.stride_floats];
      row_z_m_[u] = z;
      measured += z > 0.0F ? 1U : 0U;
    }
    skipped += width - measured;
    note_image_row(row_z_m_.data(), v, 1.0 / view.resolution_m());
    locator.start_row(v);
    for (int u = 0; u < depth.width_px; u += PixelVoxels::kCapacity) {
      const int count = std::min(PixelVoxels::kCapacity, depth.width_px - u);
      locator.locate(row_z_m_.data() + u, u, count, voxels);
      mark_located(voxels, count, window);
    }
  }
  return skipped;
}

}  // namespace understory
