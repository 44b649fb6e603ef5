// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "understory/sim/embree_scene.hpp"
#include "understory/sim/sight_limits.hpp"
#include "understory/sim/sight_search.hpp"

namespace understory {
namespace {

constexpr int kStride = 2;

class RaySearch {
 public:
  explicit RaySearch(const SightProblem& problem)
      : problem_(problem),
        scene_(problem.truth.forest(), SceneContent::kTrunksAndMeshes),
        offsets_(viewing_offsets(problem.camera,
                                 problem.geometry.resolution_m(),
                                 kStride,
                                 problem.geometry.box_m().sizes().z())) {}

  [[nodiscard]] bool can_see(const VoxelIndex& voxel) {
    // Neighbouring voxels are mostly seen over the same offset.
    if (last_success_ < offsets_.size() && sees_over(voxel, offsets_[last_success_])) {
      return true;
    }
    for (std::size_t i = 0; i < offsets_.size(); ++i) {
      if (sees_over(voxel, offsets_[i])) {
        last_success_ = i;
        return true;
      }
    }
    return false;
  }

 private:
  [[nodiscard]] bool sees_over(const VoxelIndex& voxel, const ViewingOffset& offset) const {
    const std::optional<VoxelIndex> place = place_nearest_in_height(voxel, offset);
    if (!place.has_value()) {
      return false;
    }
    const Vector3d target = problem_.geometry.center_of(voxel);
    const Vector3d vehicle = problem_.geometry.center_of(*place);
    Vector3d heading = target - vehicle;
    heading.z() = 0.0;
    const Vector3d camera = vehicle + problem_.camera.mount_forward_m * heading.normalized() +
                            Vector3d(0.0, 0.0, problem_.camera.mount_up_m);
    return !scene_.blocks(camera, target);
  }

  // The reachable voxel over this offset that has the target in view and is nearest to its height.
  [[nodiscard]] std::optional<VoxelIndex> place_nearest_in_height(
      const VoxelIndex& voxel, const ViewingOffset& offset) const {
    const double resolution_m = problem_.geometry.resolution_m();
    const int highest_step = static_cast<int>(std::floor(-offset.rise.low_m / resolution_m));
    const int lowest_step = static_cast<int>(std::ceil(-offset.rise.high_m / resolution_m));
    const int nearest_step = std::clamp(0, lowest_step, std::max(lowest_step, highest_step));
    VoxelIndex place(voxel.x() + offset.dx, voxel.y() + offset.dy, 0);
    for (int away = 0; away <= highest_step - lowest_step; ++away) {
      for (const int step : {nearest_step + away, nearest_step - away}) {
        place.z() = voxel.z() + step;
        if (step >= lowest_step && step <= highest_step && problem_.reachable.contains(place)) {
          return place;
        }
      }
    }
    return std::nullopt;
  }

  const SightProblem& problem_;
  EmbreeScene scene_;
  std::vector<ViewingOffset> offsets_;
  std::size_t last_success_ = static_cast<std::size_t>(-1);
};

// What free voxels connect with the vehicle: the rest is below the ground or inside something.
VoxelMask connected_free_voxels(const SightProblem& problem) {
  std::vector<VoxelIndex> seeds;
  for_each_voxel(problem.reachable.box(), [&](const VoxelIndex& voxel) {
    if (problem.reachable.contains(voxel)) {
      seeds.push_back(voxel);
    }
  });
  return flooded(problem.free.box(), seeds, [&](const VoxelIndex& voxel) {
    return problem.free.contains(voxel);
  });
}

}  // namespace

void find_visible_by_rays(const SightProblem& problem, const VoxelAction& found) {
  const VoxelMask candidates = connected_free_voxels(problem);
  RaySearch search(problem);
  for_each_voxel(candidates.box(), [&](const VoxelIndex& voxel) {
    if (candidates.contains(voxel) && search.can_see(voxel)) {
      found(voxel);
    }
  });
}

}  // namespace understory
