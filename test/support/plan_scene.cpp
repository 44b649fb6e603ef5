// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "support/plan_scene.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <utility>

#include "understory/plan/clearance_rule.hpp"

namespace understory::test {
namespace {

constexpr double kLattice_m = 0.2;
constexpr double kRouteClearance_m = 0.281;

using Entry = std::pair<double, std::size_t>;  // length so far and to go, lattice point

// A* over the lattice points in the map's box.
class LatticeSearch {
 public:
  LatticeSearch(const ClearanceMap& map, double clearance_m)
      : map_(map),
        clearance_m_(clearance_m),
        first_(nearest(map.geometry().box_m().min())),
        size_(nearest(map.geometry().box_m().max()) - first_ + Vector3i::Ones()) {
    const auto count = static_cast<std::size_t>(size_.prod());
    length_m_.assign(count, std::numeric_limits<double>::infinity());
    parent_.assign(count, count);
  }

  [[nodiscard]] Vector3d place_near(const Vector3d& point_m) const {
    return nearest(point_m).cast<double>() * kLattice_m;
  }

  [[nodiscard]] std::vector<Vector3d> run(const Vector3d& start_m, const Vector3d& goal_m) {
    const std::size_t start = slot_of(nearest(start_m));
    const std::size_t goal = slot_of(nearest(goal_m));
    length_m_[start] = 0.0;
    open_.emplace((start_m - goal_m).norm(), start);
    while (!open_.empty()) {
      const auto [total_m, slot] = open_.top();
      open_.pop();
      if (slot == goal) {
        return route_to(goal);
      }
      if (total_m <= length_m_[slot] + (place_of(slot) - goal_m).norm() + 1e-9) {
        expand(slot, goal_m);
      }
    }
    return {};
  }

 private:
  [[nodiscard]] static Vector3i nearest(const Vector3d& point_m) {
    return (point_m / kLattice_m).array().round().cast<int>();
  }
  [[nodiscard]] std::size_t slot_of(const Vector3i& lattice) const {
    const Vector3i local = lattice - first_;
    const int slot = (local.z() * size_.y() + local.y()) * size_.x() + local.x();
    return static_cast<std::size_t>(slot);
  }
  [[nodiscard]] Vector3i lattice_of(std::size_t slot) const {
    const int index = static_cast<int>(slot);
    return first_ + Vector3i(index % size_.x(),
                             index / size_.x() % size_.y(),
                             index / (size_.x() * size_.y()));
  }
  [[nodiscard]] Vector3d place_of(std::size_t slot) const {
    return lattice_of(slot).cast<double>() * kLattice_m;
  }

  void expand(std::size_t slot, const Vector3d& goal_m) {
    const Vector3d from_m = place_of(slot);
    for (int i = 0; i < 27; ++i) {
      const Vector3i next_lattice =
          lattice_of(slot) + Vector3i(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
      const Vector3d to_m = next_lattice.cast<double>() * kLattice_m;
      const std::size_t next = slot_of(next_lattice);
      const double length_m = length_m_[slot] + (to_m - from_m).norm();
      // Clearance last, it costs most. What is clear has all its neighbours in the box.
      if (length_m < length_m_[next] - 1e-9 && map_.clearance_at_least(to_m, clearance_m_) &&
          map_.clearance_at_least(0.5 * (from_m + to_m), clearance_m_)) {
        length_m_[next] = length_m;
        parent_[next] = slot;
        open_.emplace(length_m + (to_m - goal_m).norm(), next);
      }
    }
  }

  [[nodiscard]] std::vector<Vector3d> route_to(std::size_t goal) const {
    std::vector<Vector3d> route;
    for (std::size_t at = goal; at < parent_.size(); at = parent_[at]) {
      route.push_back(place_of(at));
    }
    std::reverse(route.begin(), route.end());
    return route;
  }

  const ClearanceMap& map_;
  double clearance_m_;
  Vector3i first_;
  Vector3i size_;
  std::vector<double> length_m_;
  std::vector<std::size_t> parent_;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<Entry>> open_;
};

}  // namespace

std::vector<Vector3d> lattice_route(const ClearanceMap& map,
                                    const Vector3d& start_m,
                                    const Vector3d& goal_m,
                                    double clearance_m) {
  LatticeSearch search(map, clearance_m);
  const Vector3d first_m = search.place_near(start_m);
  const Vector3d last_m = search.place_near(goal_m);
  const ClearanceRule rule{clearance_m, clearance_m};
  if (!leg_is_clear(map, start_m, first_m, rule, 0.0) ||
      !leg_is_clear(map, last_m, goal_m, rule, 0.0)) {
    return {};
  }
  std::vector<Vector3d> route = search.run(first_m, last_m);
  if (!route.empty()) {
    route.insert(route.begin(), start_m);
    route.push_back(goal_m);
  }
  return route;
}

std::optional<Vector3d> random_free_point(const ClearanceMap& map, double clearance_m, Rng& rng) {
  const Box3d box = map.geometry().box_m();
  for (int attempt = 0; attempt < 200; ++attempt) {
    Vector3d point;
    for (int axis = 0; axis < 3; ++axis) {
      point[axis] = rng.uniform(box.min()[axis], box.max()[axis]);
    }
    if (map.clearance_at_least(point, clearance_m)) {
      return point;
    }
  }
  return std::nullopt;
}

std::optional<PlanScene> random_scene(Rng& rng, double least_m) {
  PlanScene scene;
  scene.snapshot = random_forest({}, rng).build();
  scene.map.update(scene.snapshot);
  for (int attempt = 0; attempt < 20; ++attempt) {
    const std::optional<Vector3d> start = random_free_point(scene.map, kRouteClearance_m, rng);
    const std::optional<Vector3d> goal = random_free_point(scene.map, kRouteClearance_m, rng);
    if (!start || !goal || (*goal - *start).norm() < least_m) {
      continue;
    }
    scene.request.route_m = lattice_route(scene.map, *start, *goal, kRouteClearance_m);
    if (!scene.request.route_m.empty()) {
      scene.request.start.position_m = *start;
      scene.request.start.yaw_rad = rng.uniform(-kPi, kPi);
      scene.request.goal_yaw_rad = rng.uniform(-kPi, kPi);
      scene.request.start_time = Time(duration_from_seconds(rng.uniform(0.0, 1000.0)));
      return scene;
    }
  }
  return std::nullopt;
}

bool set_in_motion(PlanScene& scene, Rng& rng) {
  const Limits& limits = scene.request.limits;
  TrajectoryPoint& start = scene.request.start;
  for (int attempt = 0; attempt < 50; ++attempt) {
    const double heading_rad = rng.uniform(-kPi, kPi);
    const double climb = rng.uniform(-0.15, 0.15);
    const Vector3d direction =
        Vector3d(std::cos(heading_rad), std::sin(heading_rad), climb).normalized();
    const double speed_mps = rng.uniform(0.2, 0.98) * limits.speed_mps;
    // Half of the acceleration limit at most, and that across the motion or against it.
    const Vector3d across = direction.cross(Vector3d::UnitZ()).normalized();
    const Vector3d acceleration =
        0.5 * limits.acceleration_mps2 *
        (rng.uniform(-0.7, 0.7) * across - rng.uniform(0.0, 0.7) * direction);
    const double stop_m = speed_mps * speed_mps / (2.0 * limits.acceleration_mps2) + 0.25;
    const ClearanceRule rule{0.35, 0.35};
    if (leg_is_clear(
            scene.map, start.position_m, start.position_m + stop_m * direction, rule, 0.0)) {
      start.velocity_mps = speed_mps * direction;
      start.acceleration_mps2 = acceleration;
      start.yaw_rate_radps = rng.uniform(-0.9, 0.9) * limits.yaw_rate_radps;
      return true;
    }
  }
  return false;
}

}  // namespace understory::test
