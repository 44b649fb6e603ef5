// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/trunk_index.hpp"

#include <algorithm>
#include <cassert>

namespace understory {
namespace {

constexpr double kFinestCellM = 1.0;
constexpr double kCellsPerTrunk = 8.0;
constexpr double kCellsAtLeast = 4096.0;

Box2d disc_box(const Trunk& trunk) {
  const Vector2d reach = Vector2d::Constant(trunk.radius_m);
  return {trunk.center_m - reach, trunk.center_m + reach};
}

}  // namespace

TrunkIndex::TrunkIndex(const std::vector<Trunk>& trunks) {
  if (trunks.empty()) {
    return;
  }
  Box2d extent;
  for (const Trunk& trunk : trunks) {
    assert(trunk.center_m.allFinite() && trunk.radius_m > 0.0);
    extent.extend(disc_box(trunk));
  }
  // A stray trunk far away makes cells coarser instead of the table huge.
  const double most_cells =
      std::max(kCellsAtLeast, kCellsPerTrunk * static_cast<double>(trunks.size()));
  cell_m_ = std::max(kFinestCellM, std::sqrt(extent.volume() / most_cells));
  cell_m_ = std::max(cell_m_, extent.sizes().maxCoeff() / most_cells);
  origin_m_ = extent.min();
  count_x_ = static_cast<int>(extent.sizes().x() / cell_m_) + 1;
  count_y_ = static_cast<int>(extent.sizes().y() / cell_m_) + 1;

  const auto for_each_cell = [&](const Trunk& trunk, const auto& action) {
    const Vector2d low = trunk.center_m - origin_m_;
    const int x_end = cell_along(low.x() + trunk.radius_m, count_x_);
    const int y_end = cell_along(low.y() + trunk.radius_m, count_y_);
    for (int cy = cell_along(low.y() - trunk.radius_m, count_y_); cy <= y_end; ++cy) {
      for (int cx = cell_along(low.x() - trunk.radius_m, count_x_); cx <= x_end; ++cx) {
        action(static_cast<std::size_t>(cy) * static_cast<std::size_t>(count_x_) +
               static_cast<std::size_t>(cx));
      }
    }
  };
  first_.assign(static_cast<std::size_t>(count_x_) * static_cast<std::size_t>(count_y_) + 1, 0);
  for (const Trunk& trunk : trunks) {
    for_each_cell(trunk, [&](std::size_t cell) { ++first_[cell + 1]; });
  }
  for (std::size_t cell = 1; cell < first_.size(); ++cell) {
    first_[cell] += first_[cell - 1];
  }
  discs_.resize(first_.back());
  std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
  for (std::size_t i = 0; i < trunks.size(); ++i) {
    const Trunk& trunk = trunks[i];
    for_each_cell(trunk, [&](std::size_t cell) {
      discs_[next[cell]++] = {trunk.center_m.x(), trunk.center_m.y(), trunk.radius_m, i};
    });
  }
}

int TrunkIndex::cell_along(double offset_m, int count) const {
  return static_cast<int>(std::clamp(offset_m / cell_m_, 0.0, static_cast<double>(count - 1)));
}

double TrunkIndex::nearest_within(const Vector2d& p, double reach_m, double best_m) const {
  const Vector2d offset = p - origin_m_;
  const auto x_first = static_cast<std::size_t>(cell_along(offset.x() - reach_m, count_x_));
  const auto x_last = static_cast<std::size_t>(cell_along(offset.x() + reach_m, count_x_));
  const auto y_first = static_cast<std::size_t>(cell_along(offset.y() - reach_m, count_y_));
  const auto y_last = static_cast<std::size_t>(cell_along(offset.y() + reach_m, count_y_));
  for (std::size_t cy = y_first; cy <= y_last; ++cy) {
    const std::size_t row = cy * static_cast<std::size_t>(count_x_);
    for (std::uint32_t i = first_[row + x_first]; i < first_[row + x_last + 1]; ++i) {
      const Disc& disc = discs_[i];
      const double dx = p.x() - disc.x_m;
      const double dy = p.y() - disc.y_m;
      best_m = std::min(best_m, std::sqrt(dx * dx + dy * dy) - disc.radius_m);
    }
  }
  return best_m;
}

double TrunkIndex::distance_m(const Vector2d& point_m, double max_m) const {
  if (discs_.empty()) {
    return max_m;
  }
  double reach_m = std::min(cell_m_, max_m);
  double best_m = nearest_within(point_m, reach_m, max_m);
  while (best_m > reach_m) {  // what was found may hide something nearer outside the square
    reach_m = std::min(2.0 * reach_m, best_m);
    best_m = nearest_within(point_m, reach_m, best_m);
  }
  return best_m;
}

bool TrunkIndex::touches_line_in_row(const Vector2d& from_m, const Vector2d& to_m, int row) const {
  const Vector2d from = from_m - origin_m_;
  const Vector2d along = to_m - from_m;
  // The part of the line within the row, whose cells list every trunk that reaches into it.
  double begin = 0.0;
  double end = 1.0;
  if (std::abs(along.y()) > 1e-9) {
    const double low = (row * cell_m_ - from.y()) / along.y();
    const double high = ((row + 1) * cell_m_ - from.y()) / along.y();
    begin = std::clamp(std::min(low, high) - 1e-9, 0.0, 1.0);
    end = std::clamp(std::max(low, high) + 1e-9, 0.0, 1.0);
  }
  const double x_begin = from.x() + begin * along.x();
  const double x_end = from.x() + end * along.x();
  const std::size_t first_cell = static_cast<std::size_t>(row) * static_cast<std::size_t>(count_x_);
  const auto cell_of = [&](double x_m) {
    return first_cell + static_cast<std::size_t>(cell_along(x_m, count_x_));
  };
  const std::uint32_t discs_end = first_[cell_of(std::max(x_begin, x_end)) + 1];
  for (std::uint32_t i = first_[cell_of(std::min(x_begin, x_end))]; i < discs_end; ++i) {
    const Disc& disc = discs_[i];
    const Vector2d to_disc = Vector2d(disc.x_m, disc.y_m) - from_m;
    const double squared = std::max(along.squaredNorm(), 1e-18);
    const double nearest = std::clamp(to_disc.dot(along) / squared, 0.0, 1.0);
    if ((to_disc - nearest * along).squaredNorm() <= disc.radius_m * disc.radius_m) {
      return true;
    }
  }
  return false;
}

bool TrunkIndex::touches_line(const Vector2d& from_m, const Vector2d& to_m) const {
  if (discs_.empty()) {
    return false;
  }
  const int row_from = cell_along(from_m.y() - origin_m_.y(), count_y_);
  const int row_to = cell_along(to_m.y() - origin_m_.y(), count_y_);
  for (int row = std::min(row_from, row_to); row <= std::max(row_from, row_to); ++row) {
    if (touches_line_in_row(from_m, to_m, row)) {
      return true;
    }
  }
  return false;
}

std::vector<std::size_t> TrunkIndex::touching(const Box2d& rectangle_m) const {
  std::vector<std::size_t> found;
  if (discs_.empty() || rectangle_m.isEmpty()) {
    return found;
  }
  const Vector2d low = rectangle_m.min() - origin_m_;
  const Vector2d high = rectangle_m.max() - origin_m_;
  for (int cy = cell_along(low.y(), count_y_); cy <= cell_along(high.y(), count_y_); ++cy) {
    for (int cx = cell_along(low.x(), count_x_); cx <= cell_along(high.x(), count_x_); ++cx) {
      const std::size_t cell = static_cast<std::size_t>(cy) * static_cast<std::size_t>(count_x_) +
                               static_cast<std::size_t>(cx);
      for (std::uint32_t i = first_[cell]; i < first_[cell + 1]; ++i) {
        const Disc& disc = discs_[i];
        if (rectangle_m.squaredExteriorDistance(Vector2d(disc.x_m, disc.y_m)) <=
            disc.radius_m * disc.radius_m) {
          found.push_back(disc.trunk);
        }
      }
    }
  }
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  return found;
}

}  // namespace understory
