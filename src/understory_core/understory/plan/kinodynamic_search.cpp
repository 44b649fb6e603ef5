// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/plan/kinodynamic_search.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <queue>
#include <unordered_set>

namespace understory {
namespace {

constexpr double kInterval_s = 0.1;
constexpr int kIntervalsPerStep = 4;
constexpr double kStep_s = kInterval_s * kIntervalsPerStep;
constexpr int kMaxExpansions = 400;
// Close enough to the guide, in place and velocity, to go on along it.
constexpr double kMergeDistance_m = 0.15;
constexpr double kMergeSpeed_mps = 0.35;
// How long a detour off the guide, or a wrong velocity, takes to make good; guidance, not a bound.
constexpr double kOffsetCostSecondsPerMetre = 0.5;
constexpr double kMismatchCost = 0.4;  // of the time that the change of velocity takes

struct Node {
  Vector3d position_m;
  Vector3d velocity_mps;
  Vector3d acceleration_mps2;  // that led here
  double along_m;
  double flown_m;
  double time_s;
  double total_s;  // time so far and guess of the rest
  int parent;
};

// Nodes of one cell of place and velocity are the same as far as the search cares.
std::uint64_t cell_of(const Node& node, const Limits& limits) {
  constexpr double kCell_m = 0.2;
  const double cell_mps = 0.25 * limits.speed_mps;
  std::uint64_t key = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto place = static_cast<std::int64_t>(std::floor(node.position_m[axis] / kCell_m));
    const auto speed = static_cast<std::int64_t>(std::floor(node.velocity_mps[axis] / cell_mps));
    key = (key << 15U) | (static_cast<std::uint64_t>(place) & 0x7FFFU);
    key = (key << 6U) | (static_cast<std::uint64_t>(speed) & 0x3FU);
  }
  return key;
}

class KinodynamicSearch {
 public:
  KinodynamicSearch(const ClearanceMap& map,
                    const RouteGuide& guide,
                    const Limits& limits,
                    const ClearanceRule& rule)
      : map_(map), guide_(guide), limits_(limits), rule_(rule) {}

  // The nodes from the start to where the guide takes over: merged, or the most promising one.
  [[nodiscard]] std::vector<Node> run(const SearchStart& start) {
    Node root{start.position_m, start.velocity_mps, Vector3d::Zero(), 0.0, 0.0, 0.0, 0.0, -1};
    root.total_s = guessed_rest_s(root);
    push(root);
    int best = 0;
    for (int expansions = 0; !open_.empty() && expansions < kMaxExpansions; ++expansions) {
      const int index = open_.top().second;
      open_.pop();
      const Node node = nodes_[static_cast<std::size_t>(index)];
      if (has_merged(node)) {
        return path_to(index);
      }
      // Ties keep the earlier node: the order does not depend on anything but the input.
      if (node.along_m > nodes_[static_cast<std::size_t>(best)].along_m) {
        best = index;
      }
      expand(node, index);
    }
    return path_to(best);
  }

 private:
  using Entry = std::pair<double, int>;  // total, index

  void push(const Node& node) {
    if (visited_.insert(cell_of(node, limits_)).second) {
      nodes_.push_back(node);
      open_.emplace(node.total_s, static_cast<int>(nodes_.size()) - 1);
    }
  }

  [[nodiscard]] Vector3d guide_velocity(double along_m) const {
    return guide_.speed_at(along_m) * guide_.direction_at(along_m);
  }

  [[nodiscard]] double guessed_rest_s(const Node& node) const {
    const double offset_m = (node.position_m - guide_.point_at(node.along_m)).norm();
    const double mismatch_mps = (node.velocity_mps - guide_velocity(node.along_m)).norm();
    return guide_.time_to_go_s(node.along_m) + kOffsetCostSecondsPerMetre * offset_m +
           kMismatchCost * mismatch_mps / limits_.acceleration_mps2;
  }

  [[nodiscard]] bool has_merged(const Node& node) const {
    return (node.position_m - guide_.point_at(node.along_m)).norm() < kMergeDistance_m &&
           (node.velocity_mps - guide_velocity(node.along_m)).norm() < kMergeSpeed_mps;
  }

  // Towards a point ahead on the guide, at the speed that is right there.
  [[nodiscard]] Vector3d pursuing_velocity(const Node& node) const {
    const double ahead_m = std::max(0.4, 0.8 * node.velocity_mps.norm());
    const Vector3d to_target = guide_.point_at(node.along_m + ahead_m) - node.position_m;
    const double speed_mps = std::max(0.3, guide_.speed_at(node.along_m + 0.5 * ahead_m));
    const double distance_m = to_target.norm();
    return distance_m < 1e-9 ? Vector3d(Vector3d::Zero())
                             : Vector3d(to_target * (speed_mps / distance_m));
  }

  void expand(const Node& node, int index) {
    const Vector3d pursuing = pursuing_velocity(node);
    try_velocity(node, index, pursuing);
    try_velocity(node, index, node.velocity_mps);
    try_velocity(node, index, Vector3d::Zero());
    // All round in the plane, relative to the motion; height follows the guide.
    constexpr int kDirections = 8;
    const double heading_rad = std::atan2(node.velocity_mps.y(), node.velocity_mps.x());
    const double change_mps = limits_.acceleration_mps2 * kStep_s;
    for (int i = 0; i < kDirections; ++i) {
      const double angle_rad = heading_rad + 2.0 * kPi * i / kDirections;
      Vector3d wanted = node.velocity_mps;
      wanted.z() = pursuing.z();
      wanted += change_mps * Vector3d(std::cos(angle_rad), std::sin(angle_rad), 0.0);
      try_velocity(node, index, wanted);
    }
  }

  // One step towards the wanted velocity, as far as the limits allow.
  void try_velocity(const Node& node, int index, const Vector3d& wanted_mps) {
    const auto clamped = [](const Vector3d& x, double limit) {
      const double norm = x.norm();
      return norm > limit ? Vector3d(x * (limit / norm)) : x;
    };
    const double change_limit_mps = limits_.acceleration_mps2 * kStep_s;
    const Vector3d change =
        clamped(clamped(wanted_mps, limits_.speed_mps) - node.velocity_mps, change_limit_mps);
    Node next = node;
    next.parent = index;
    next.acceleration_mps2 = change / kStep_s;
    for (int i = 1; i <= kIntervalsPerStep; ++i) {
      const double t = kInterval_s * i;
      const Vector3d before_m = next.position_m;
      next.position_m =
          node.position_m + node.velocity_mps * t + (0.5 * t * t) * next.acceleration_mps2;
      next.flown_m += (next.position_m - before_m).norm();
      const double required_m = rule_.required_m(next.flown_m);
      if (map_.distance_lower_bound_m(next.position_m) < required_m &&
          !map_.clearance_at_least(next.position_m, required_m)) {
        return;
      }
    }
    next.velocity_mps = node.velocity_mps + change;
    next.time_s += kStep_s;
    const double reach_m = limits_.speed_mps * kStep_s + 0.3;
    next.along_m = guide_.nearest_along_m(next.position_m,
                                          std::max(0.0, node.along_m - reach_m),
                                          std::min(guide_.length_m(), node.along_m + reach_m));
    next.total_s = next.time_s + guessed_rest_s(next);
    push(next);
  }

  [[nodiscard]] std::vector<Node> path_to(int index) const {
    std::vector<Node> path;
    for (; index >= 0; index = path.back().parent) {
      path.push_back(nodes_[static_cast<std::size_t>(index)]);
    }
    std::reverse(path.begin(), path.end());
    return path;
  }

  const ClearanceMap& map_;
  const RouteGuide& guide_;
  const Limits& limits_;
  const ClearanceRule& rule_;
  std::vector<Node> nodes_;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<Entry>> open_;
  std::unordered_set<std::uint64_t> visited_;  // asked for membership only
};

// On along the guide; what is left of the offset from it fades out.
void append_guide(const RouteGuide& guide, double along_m, std::vector<Vector3d>& positions_m) {
  constexpr double kFade_s = 0.8;
  constexpr double kLeastSpeed_mps = 0.15;
  const Vector3d offset_m = positions_m.back() - guide.point_at(along_m);
  for (int i = 1; along_m < guide.length_m(); ++i) {
    const double speed_mps = std::max(kLeastSpeed_mps, guide.speed_at(along_m));
    along_m = std::min(guide.length_m(), along_m + speed_mps * kInterval_s);
    const double left = std::max(0.0, 1.0 - kInterval_s * i / kFade_s);
    positions_m.emplace_back(guide.point_at(along_m) + left * offset_m);
  }
  positions_m.back() = guide.point_at(guide.length_m());
}

}  // namespace

Vector3d SampledMotion::at(double time_s) const {
  const double last = static_cast<double>(positions_m.size() - 1);
  const double scaled = std::clamp(time_s / interval_s, 0.0, last);
  const auto low = std::min(static_cast<std::size_t>(scaled), positions_m.size() - 2);
  const double share = scaled - static_cast<double>(low);
  return positions_m[low] + share * (positions_m[low + 1] - positions_m[low]);
}

SampledMotion motion_along(const ClearanceMap& map,
                           const RouteGuide& guide,
                           const SearchStart& start,
                           const Limits& limits,
                           const ClearanceRule& rule) {
  const std::vector<Node> path = KinodynamicSearch(map, guide, limits, rule).run(start);
  SampledMotion motion{kInterval_s, {start.position_m}};
  for (std::size_t i = 1; i < path.size(); ++i) {
    const Node& from = path[i - 1];
    for (int k = 1; k <= kIntervalsPerStep; ++k) {
      const double t = kInterval_s * k;
      motion.positions_m.emplace_back(from.position_m + from.velocity_mps * t +
                                      (0.5 * t * t) * path[i].acceleration_mps2);
    }
  }
  append_guide(guide, path.back().along_m, motion.positions_m);
  if (motion.positions_m.size() < 2) {
    motion.positions_m.push_back(motion.positions_m.back());
  }
  return motion;
}

}  // namespace understory
