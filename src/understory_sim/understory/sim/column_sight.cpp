// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "understory/sim/sight_limits.hpp"
#include "understory/sim/sight_search.hpp"

namespace understory {
namespace {

constexpr int kBlockVoxels = 16;  // columns that share one list of trunks

// An offset and the layers of voxels that are in view over it from some height.
struct LayeredOffset {
  int dx;
  int dy;
  int first_layer;
  int last_layer;
};

std::vector<LayeredOffset> layered_offsets(const SightProblem& problem) {
  const double resolution_m = problem.geometry.resolution_m();
  const VoxelBox& voxels = problem.geometry.voxels();
  std::vector<LayeredOffset> layered;
  for (const ViewingOffset& offset :
       viewing_offsets(problem.camera, resolution_m, 1, problem.geometry.box_m().sizes().z())) {
    const double low_m = problem.lowest_m + offset.rise.low_m;
    const double high_m = problem.highest_m + offset.rise.high_m;
    const int first = static_cast<int>(std::ceil(low_m / resolution_m - 0.5));
    const int last = static_cast<int>(std::floor(high_m / resolution_m - 0.5));
    const LayeredOffset entry{
        offset.dx, offset.dy, std::max(first, voxels.min.z()), std::min(last, voxels.end.z() - 1)};
    if (entry.first_layer <= entry.last_layer) {
      layered.push_back(entry);
    }
  }
  return layered;
}

struct Blocker {
  double x_m;
  double y_m;
  double squared_radius_m2;
};

class SightLine {
 public:
  SightLine(const Vector2d& from, const Vector2d& to)
      : from_(from), along_(to - from), inverse_squared_length_(1.0 / along_.squaredNorm()) {}

  [[nodiscard]] bool is_cut_by(const Blocker& blocker) const {
    const double x = blocker.x_m - from_.x();
    const double y = blocker.y_m - from_.y();
    const double share =
        std::clamp((x * along_.x() + y * along_.y()) * inverse_squared_length_, 0.0, 1.0);
    const double dx = x - share * along_.x();
    const double dy = y - share * along_.y();
    return dx * dx + dy * dy < blocker.squared_radius_m2;
  }

 private:
  Vector2d from_;
  Vector2d along_;
  double inverse_squared_length_;
};

// The layers of one column that are still to be seen.
class OpenLayers {
 public:
  explicit OpenLayers(const VoxelBox& voxels)
      : first_(voxels.min.z()),
        open_(static_cast<std::size_t>(voxels.size().z()), 1),
        lowest_(voxels.min.z()),
        highest_(voxels.end.z() - 1) {}

  [[nodiscard]] bool done() const { return lowest_ > highest_; }
  [[nodiscard]] bool gains_from(const LayeredOffset& offset) const {
    return offset.first_layer <= highest_ && offset.last_layer >= lowest_;
  }
  template <class Action>
  void take(const LayeredOffset& offset, const Action& action) {
    for (int layer = offset.first_layer; layer <= offset.last_layer; ++layer) {
      std::uint8_t& open = open_[static_cast<std::size_t>(layer - first_)];
      if (open != 0) {
        open = 0;
        action(layer);
      }
    }
    while (!done() && open_[static_cast<std::size_t>(lowest_ - first_)] == 0) {
      ++lowest_;
    }
    while (!done() && open_[static_cast<std::size_t>(highest_ - first_)] == 0) {
      --highest_;
    }
  }

 private:
  int first_;
  std::vector<std::uint8_t> open_;
  int lowest_;
  int highest_;
};

class ColumnSearch {
 public:
  ColumnSearch(const SightProblem& problem, const VoxelAction& found)
      : problem_(problem), found_(found), offsets_(layered_offsets(problem)) {}

  void search_block(const VoxelBox& block) {
    gather_blockers(block);
    for_each_voxel(block, [&](const VoxelIndex& column) {
      if (problem_.free.contains(column)) {
        search_column(column);
      }
    });
  }

 private:
  void gather_blockers(const VoxelBox& block) {
    const double reach_m =
        problem_.camera.max_range_m + std::max(0.0, problem_.camera.mount_forward_m);
    const double resolution_m = problem_.geometry.resolution_m();
    const Vector2d margin = Vector2d::Constant(reach_m);
    const Vector2d low = block.min.head<2>().cast<double>() * resolution_m;
    const Vector2d high = block.end.head<2>().cast<double>() * resolution_m;
    blockers_.clear();
    for (const std::size_t i : problem_.truth.trunks().touching({low - margin, high + margin})) {
      const Trunk& trunk = problem_.truth.forest().trunks[i];
      blockers_.push_back(
          {trunk.center_m.x(), trunk.center_m.y(), trunk.radius_m * trunk.radius_m});
    }
  }

  void search_column(const VoxelIndex& column) {
    OpenLayers open(problem_.geometry.voxels());
    // Neighbouring columns are mostly seen over the same offset.
    if (last_success_ < offsets_.size()) {
      try_offset(column, last_success_, open);
    }
    for (std::size_t i = 0; i < offsets_.size() && !open.done(); ++i) {
      if (open.gains_from(offsets_[i])) {
        try_offset(column, i, open);
      }
    }
  }

  void try_offset(const VoxelIndex& column, std::size_t index, OpenLayers& open) {
    const LayeredOffset& offset = offsets_[index];
    const VoxelIndex place(column.x() + offset.dx, column.y() + offset.dy, column.z());
    if (!problem_.reachable.contains(place) || is_blocked(place, column)) {
      return;
    }
    last_success_ = index;
    open.take(offset, [&](int layer) { found_({column.x(), column.y(), layer}); });
  }

  [[nodiscard]] bool is_blocked(const VoxelIndex& place, const VoxelIndex& column) {
    const Vector2d vehicle = problem_.geometry.center_of(place).head<2>();
    const Vector2d target = problem_.geometry.center_of(column).head<2>();
    const Vector2d camera =
        vehicle + problem_.camera.mount_forward_m * (target - vehicle).normalized();
    const SightLine line(camera, target);
    // The trunk that was in the way last is likely to be so again.
    if (last_blocker_ < blockers_.size() && line.is_cut_by(blockers_[last_blocker_])) {
      return true;
    }
    for (std::size_t i = 0; i < blockers_.size(); ++i) {
      if (line.is_cut_by(blockers_[i])) {
        last_blocker_ = i;
        return true;
      }
    }
    return false;
  }

  const SightProblem& problem_;
  const VoxelAction& found_;
  std::vector<LayeredOffset> offsets_;
  std::vector<Blocker> blockers_;
  std::size_t last_success_ = static_cast<std::size_t>(-1);
  std::size_t last_blocker_ = 0;
};

}  // namespace

void find_visible_in_columns(const SightProblem& problem, const VoxelAction& found) {
  ColumnSearch search(problem, found);
  const VoxelBox& columns = problem.free.box();
  for (int y = columns.min.y(); y < columns.end.y(); y += kBlockVoxels) {
    for (int x = columns.min.x(); x < columns.end.x(); x += kBlockVoxels) {
      const VoxelBox block{{x, y, columns.min.z()},
                           {x + kBlockVoxels, y + kBlockVoxels, columns.end.z()}};
      search.search_block(block.clipped_to(columns));
    }
  }
}

}  // namespace understory
