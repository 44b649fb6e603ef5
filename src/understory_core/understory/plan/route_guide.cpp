// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/plan/route_guide.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace understory {
namespace {

constexpr double kTableStep_m = 0.1;
// How far from a corner's vertex the turn may pass; sets the turn's radius and so its speed.
constexpr double kCornerDeviation_m = 0.35;
constexpr double kShortestLeg_m = 1e-6;
constexpr double kCrawl_mps = 0.05;  // keeps times finite where the speed is zero

// Doubling, then halving: sight along a route is nearly monotonic, and the answer is verified.
template <class Sees>
std::size_t farthest_in_sight(std::size_t from, std::size_t last, const Sees& sees) {
  std::size_t seen = from + 1;
  std::size_t stride = 2;
  std::size_t hidden = last + 1;
  while (seen < last) {
    const std::size_t next = std::min(last, from + stride);
    if (!sees(next)) {
      hidden = next;
      break;
    }
    seen = next;
    stride *= 2;
  }
  while (hidden - seen > 1 && hidden <= last) {
    const std::size_t middle = (seen + hidden) / 2;
    (sees(middle) ? seen : hidden) = middle;
  }
  return seen;
}

std::vector<Vector3d> without_repetitions(const std::vector<Vector3d>& route_m) {
  std::vector<Vector3d> distinct;
  for (const Vector3d& point : route_m) {
    if (distinct.empty() || (point - distinct.back()).norm() > kShortestLeg_m) {
      distinct.push_back(point);
    }
  }
  return distinct;
}

}  // namespace

std::vector<Vector3d> shortcut_route(const ClearanceMap& map,
                                     const std::vector<Vector3d>& route_m,
                                     const ClearanceRule& rule,
                                     double horizon_m,
                                     const Barriers& barriers) {
  const std::vector<Vector3d> route = without_repetitions(route_m);
  std::vector<Vector3d> vertices;
  double length_m = 0.0;
  for (std::size_t at = 0; at < route.size();) {
    vertices.push_back(route[at]);
    if (at + 1 == route.size()) {
      break;
    }
    const auto sees = [&](std::size_t to) {
      return leg_is_clear(map, route[at], route[to], rule, length_m) &&
             !is_barred(barriers, route[at], route[to]);
    };
    const std::size_t next = farthest_in_sight(at, route.size() - 1, sees);
    const double leg_m = (route[next] - route[at]).norm();
    if (length_m + leg_m >= horizon_m) {
      vertices.emplace_back(route[at] + (horizon_m - length_m) / leg_m * (route[next] - route[at]));
      break;
    }
    length_m += leg_m;
    at = next;
  }
  return vertices;
}

RouteGuide::RouteGuide(std::vector<Vector3d> vertices_m,
                       const Vector3d& start_velocity_mps,
                       const Limits& limits)
    : vertices_m_(std::move(vertices_m)), vertex_at_m_{0.0} {
  assert(vertices_m_.size() >= 2);
  for (std::size_t i = 1; i < vertices_m_.size(); ++i) {
    vertex_at_m_.push_back(vertex_at_m_.back() + (vertices_m_[i] - vertices_m_[i - 1]).norm());
  }
  const auto steps = static_cast<std::size_t>(std::ceil(length_m() / kTableStep_m));
  step_m_ = length_m() / static_cast<double>(steps);
  speed_mps_.assign(steps + 1, limits.speed_mps);
  limit_corner_speeds(limits);
  speed_mps_.back() = 0.0;
  speed_mps_.front() =
      std::clamp(start_velocity_mps.dot(direction_at(0.0)), 0.0, speed_mps_.front());
  const auto reachable = [&](double speed_mps) {
    return std::sqrt(speed_mps * speed_mps + 2.0 * limits.acceleration_mps2 * step_m_);
  };
  for (std::size_t i = 1; i <= steps; ++i) {
    speed_mps_[i] = std::min(speed_mps_[i], reachable(speed_mps_[i - 1]));
  }
  time_to_go_s_.assign(steps + 1, 0.0);
  for (std::size_t i = steps; i-- > 0;) {
    speed_mps_[i] = std::min(speed_mps_[i], reachable(speed_mps_[i + 1]));
    time_to_go_s_[i] = time_to_go_s_[i + 1] +
                       2.0 * step_m_ / std::max(kCrawl_mps, speed_mps_[i] + speed_mps_[i + 1]);
  }
}

void RouteGuide::limit_corner_speeds(const Limits& limits) {
  for (std::size_t i = 1; i + 1 < vertices_m_.size(); ++i) {
    const Vector3d before = vertices_m_[i] - vertices_m_[i - 1];
    const Vector3d after = vertices_m_[i + 1] - vertices_m_[i];
    const double cos_turn =
        std::clamp(before.dot(after) / (before.norm() * after.norm()), -1.0, 1.0);
    const double half_turn_rad = 0.5 * std::acos(cos_turn);
    // The arc that touches both legs: by how far it may miss the vertex, and by the legs' lengths.
    const double cos_half = std::max(1e-3, std::cos(half_turn_rad));
    const double by_deviation_m = kCornerDeviation_m * cos_half / std::max(1e-9, 1.0 - cos_half);
    const double shorter_m = std::min(before.norm(), after.norm());
    const double by_legs_m = 0.5 * shorter_m / std::max(1e-9, std::tan(half_turn_rad));
    const double radius_m = std::min(by_deviation_m, std::max(by_legs_m, 0.05));
    const double corner_mps = std::sqrt(limits.acceleration_mps2 * radius_m);
    const auto at = static_cast<std::size_t>(std::lround(vertex_at_m_[i] / step_m_));
    speed_mps_[at] = std::min(speed_mps_[at], corner_mps);
  }
}

std::size_t RouteGuide::leg_at(double along_m) const {
  const auto next = std::upper_bound(vertex_at_m_.begin(), vertex_at_m_.end(), along_m);
  const auto index = static_cast<std::size_t>(next - vertex_at_m_.begin());
  return std::clamp<std::size_t>(index, 1, vertices_m_.size() - 1) - 1;
}

Vector3d RouteGuide::point_at(double along_m) const {
  const std::size_t leg = leg_at(along_m);
  const double length = vertex_at_m_[leg + 1] - vertex_at_m_[leg];
  const double share = std::clamp((along_m - vertex_at_m_[leg]) / length, 0.0, 1.0);
  return vertices_m_[leg] + share * (vertices_m_[leg + 1] - vertices_m_[leg]);
}

Vector3d RouteGuide::direction_at(double along_m) const {
  const std::size_t leg = leg_at(along_m);
  return (vertices_m_[leg + 1] - vertices_m_[leg]).normalized();
}

double RouteGuide::interpolated(const std::vector<double>& table, double along_m) const {
  const double scaled = std::clamp(along_m / step_m_, 0.0, static_cast<double>(table.size() - 1));
  const auto low = std::min(static_cast<std::size_t>(scaled), table.size() - 2);
  const double share = scaled - static_cast<double>(low);
  return table[low] + share * (table[low + 1] - table[low]);
}

double RouteGuide::speed_at(double along_m) const {
  return interpolated(speed_mps_, along_m);
}

double RouteGuide::time_to_go_s(double along_m) const {
  return interpolated(time_to_go_s_, along_m);
}

double RouteGuide::nearest_along_m(const Vector3d& point_m, double from_m, double to_m) const {
  double best_along_m = from_m;
  double best_square = (point_at(from_m) - point_m).squaredNorm();
  for (std::size_t leg = leg_at(from_m); leg <= leg_at(to_m); ++leg) {
    const Vector3d edge = vertices_m_[leg + 1] - vertices_m_[leg];
    const double share = (point_m - vertices_m_[leg]).dot(edge) / edge.squaredNorm();
    const double along_m = std::clamp(vertex_at_m_[leg] + std::clamp(share, 0.0, 1.0) * edge.norm(),
                                      from_m,
                                      std::max(from_m, to_m));
    const double distance_square = (point_at(along_m) - point_m).squaredNorm();
    if (distance_square < best_square) {
      best_square = distance_square;
      best_along_m = along_m;
    }
  }
  return best_along_m;
}

}  // namespace understory
