// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/forest_generator.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>

namespace understory {
namespace {

constexpr int kMostRejectionsInARow = 10000;
constexpr double kMostTrunks = 2e6;
constexpr double kMostCellsAlong = 2048.0;

Box2d rectangle_of(const ForestRegionConfig& region) {
  return {Vector2d(region.x_min_m, region.y_min_m), Vector2d(region.x_max_m, region.y_max_m)};
}

[[noreturn]] void fail(const std::string& key, const std::string& reason) {
  throw ForestError("forest generator: " + key + ": " + reason);
}

std::string region_key(std::size_t index) {
  return "regions[" + std::to_string(index) + "]";
}

void check(const GeneratorConfig& config) {
  if (!(config.min_radius_m > 0.0 && config.min_radius_m <= config.max_radius_m)) {
    fail("min_radius_m", "must be positive and at most max_radius_m");
  }
  if (!(config.min_gap_m >= 0.0)) {
    fail("min_gap_m", "must not be negative");
  }
  if (!(config.trunk_height_m > 0.0)) {
    fail("trunk_height_m", "must be positive");
  }
  if (config.regions.empty()) {
    fail("regions", "needs at least one rectangle");
  }
  double trunks = 0.0;
  for (std::size_t i = 0; i < config.regions.size(); ++i) {
    const Box2d rectangle = rectangle_of(config.regions[i]);
    if (!(rectangle.sizes().minCoeff() > 0.0) || !std::isfinite(rectangle.volume())) {
      fail(region_key(i), "x_max_m and y_max_m must exceed x_min_m and y_min_m");
    }
    if (!(config.regions[i].trees_per_m2 >= 0.0)) {
      fail(region_key(i), "trees_per_m2 must not be negative");
    }
    trunks += rectangle.volume() * config.regions[i].trees_per_m2;
  }
  if (!(trunks <= kMostTrunks)) {
    fail("regions", "more than 2 million trunks");
  }
}

// Spatial hash of the trunks placed so far: any two that could be too close lie in adjacent cells.
class PlacedTrunks {
 public:
  PlacedTrunks(const Box2d& extent_m, double reach_m) : origin_m_(extent_m.min()) {
    cell_m_ = std::max(reach_m, extent_m.sizes().maxCoeff() / kMostCellsAlong);
    count_x_ = cell_along(extent_m.sizes().x()) + 1;
    count_y_ = cell_along(extent_m.sizes().y()) + 1;
    cells_.resize(count_x_ * count_y_);
  }

  [[nodiscard]] bool has_room_for(const Trunk& trunk, double gap_m) const {
    const std::size_t cx = cell_along(trunk.center_m.x() - origin_m_.x());
    const std::size_t cy = cell_along(trunk.center_m.y() - origin_m_.y());
    for (std::size_t y = cy - std::min<std::size_t>(cy, 1); y <= std::min(cy + 1, count_y_ - 1);
         ++y) {
      for (std::size_t x = cx - std::min<std::size_t>(cx, 1); x <= std::min(cx + 1, count_x_ - 1);
           ++x) {
        for (const Trunk& other : cells_[y * count_x_ + x]) {
          const double least = trunk.radius_m + other.radius_m + gap_m;
          if ((trunk.center_m - other.center_m).squaredNorm() < least * least) {
            return false;
          }
        }
      }
    }
    return true;
  }

  void add(const Trunk& trunk) {
    const std::size_t cx = cell_along(trunk.center_m.x() - origin_m_.x());
    const std::size_t cy = cell_along(trunk.center_m.y() - origin_m_.y());
    cells_[cy * count_x_ + cx].push_back(trunk);
  }

 private:
  [[nodiscard]] std::size_t cell_along(double offset_m) const {
    return static_cast<std::size_t>(offset_m / cell_m_);
  }

  Vector2d origin_m_;
  double cell_m_ = 1.0;
  std::size_t count_x_ = 0;
  std::size_t count_y_ = 0;
  std::vector<std::vector<Trunk>> cells_;
};

bool leaves_starts_clear(const Trunk& trunk, const GeneratorConfig& config) {
  const double least = config.clear_radius_m + trunk.radius_m;
  return std::all_of(
      config.starts.begin(), config.starts.end(), [&](const ForestStartConfig& start) {
        return (trunk.center_m - Vector2d(start.x_m, start.y_m)).squaredNorm() >= least * least;
      });
}

// What write_forest_csv keeps, so that a forest read back is the very one that was generated.
double to_file_precision(double value_m) {
  return std::round(value_m * 1e4) / 1e4;
}

Trunk draw(const Box2d& rectangle, const GeneratorConfig& config, Rng& rng) {
  const double x_m = rng.uniform(rectangle.min().x(), rectangle.max().x());
  const double y_m = rng.uniform(rectangle.min().y(), rectangle.max().y());
  const double radius_m = rng.uniform(config.min_radius_m, config.max_radius_m);
  return {rectangle.min().cwiseMax(Vector2d(to_file_precision(x_m), to_file_precision(y_m))),
          std::clamp(to_file_precision(radius_m), config.min_radius_m, config.max_radius_m)};
}

}  // namespace

Forest generate_forest(const GeneratorConfig& config, Rng rng) {
  check(config);
  Box2d extent;
  for (const ForestRegionConfig& region : config.regions) {
    extent.extend(rectangle_of(region));
  }
  PlacedTrunks placed(extent, 2.0 * config.max_radius_m + config.min_gap_m);
  Forest forest;
  forest.trunk_height_m = config.trunk_height_m;
  for (std::size_t i = 0; i < config.regions.size(); ++i) {
    const Box2d rectangle = rectangle_of(config.regions[i]);
    const auto wanted =
        static_cast<std::size_t>(std::llround(rectangle.volume() * config.regions[i].trees_per_m2));
    int rejections = 0;
    for (std::size_t count = 0; count < wanted;) {
      const Trunk trunk = draw(rectangle, config, rng);
      if (leaves_starts_clear(trunk, config) && placed.has_room_for(trunk, config.min_gap_m)) {
        placed.add(trunk);
        forest.trunks.push_back(trunk);
        ++count;
        rejections = 0;
      } else if (++rejections > kMostRejectionsInARow) {
        fail(region_key(i) + ".trees_per_m2",
             "no room left after " + std::to_string(count) + " of " + std::to_string(wanted) +
                 " trunks");
      }
    }
  }
  return forest;
}

}  // namespace understory
