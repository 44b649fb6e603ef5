// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "support/plan_scene.hpp"

#include <algorithm>
#include <map>
#include <queue>
#include <tuple>

#include "understory/plan/clearance_rule.hpp"

namespace understory::test {
namespace {

constexpr double kLattice_m = 0.2;
constexpr double kRouteClearance_m = 0.281;

using Key = std::tuple<int, int, int>;

Vector3d place_of(const Key& key) {
  return Vector3d(std::get<0>(key), std::get<1>(key), std::get<2>(key)) * kLattice_m;
}

Key key_near(const Vector3d& point_m) {
  const auto nearest = [](double x) { return static_cast<int>(std::lround(x / kLattice_m)); };
  return {nearest(point_m.x()), nearest(point_m.y()), nearest(point_m.z())};
}

class LatticeSearch {
 public:
  LatticeSearch(const ClearanceMap& map, double clearance_m)
      : map_(map), clearance_m_(clearance_m) {}

  [[nodiscard]] std::vector<Vector3d> run(const Key& start, const Key& goal) {
    const Vector3d goal_m = place_of(goal);
    best_[start] = 0.0;
    open_.emplace((place_of(start) - goal_m).norm(), start);
    while (!open_.empty()) {
      const auto [total_m, key] = open_.top();
      open_.pop();
      if (key == goal) {
        return route_to(goal);
      }
      if (total_m > best_.at(key) + (place_of(key) - goal_m).norm() + 1e-9) {
        continue;
      }
      expand(key, goal_m);
    }
    return {};
  }

 private:
  using Entry = std::pair<double, Key>;

  void expand(const Key& key, const Vector3d& goal_m) {
    for (int i = 0; i < 27; ++i) {
      const Key next{std::get<0>(key) + i % 3 - 1,
                     std::get<1>(key) + i / 3 % 3 - 1,
                     std::get<2>(key) + i / 9 - 1};
      const Vector3d from_m = place_of(key);
      const Vector3d to_m = place_of(next);
      const double length_m = best_.at(key) + (to_m - from_m).norm();
      const auto known = best_.find(next);
      if (known != best_.end() && known->second <= length_m + 1e-9) {
        continue;
      }
      if (!map_.clearance_at_least(to_m, clearance_m_) ||
          !map_.clearance_at_least(0.5 * (from_m + to_m), clearance_m_)) {
        continue;
      }
      best_[next] = length_m;
      parent_[next] = key;
      open_.emplace(length_m + (to_m - goal_m).norm(), next);
    }
  }

  [[nodiscard]] std::vector<Vector3d> route_to(const Key& goal) const {
    std::vector<Vector3d> route{place_of(goal)};
    for (auto at = parent_.find(goal); at != parent_.end(); at = parent_.find(at->second)) {
      route.push_back(place_of(at->second));
    }
    std::reverse(route.begin(), route.end());
    return route;
  }

  const ClearanceMap& map_;
  double clearance_m_;
  std::map<Key, double> best_;
  std::map<Key, Key> parent_;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<Entry>> open_;
};

}  // namespace

std::vector<Vector3d> lattice_route(const ClearanceMap& map,
                                    const Vector3d& start_m,
                                    const Vector3d& goal_m,
                                    double clearance_m) {
  const Key start = key_near(start_m);
  const Key goal = key_near(goal_m);
  const ClearanceRule rule{clearance_m, clearance_m};
  if (!leg_is_clear(map, start_m, place_of(start), rule, 0.0) ||
      !leg_is_clear(map, place_of(goal), goal_m, rule, 0.0)) {
    return {};
  }
  std::vector<Vector3d> route = LatticeSearch(map, clearance_m).run(start, goal);
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
