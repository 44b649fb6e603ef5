// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/strategy/fuel.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>

namespace understory {
namespace {

constexpr double kStandsStillMps = 1e-3;
constexpr std::uint64_t kTourSeed = 1;

}  // namespace

Fuel::Fuel(const FuelConfig& config, const FuelRates& rates, const GridGeometry& geometry)
    : config_(config), rates_(rates), lengths_(geometry, rates.clearance_m) {}

std::vector<Fuel::Group> Fuel::groups_of(const std::vector<Candidate>& candidates) {
  std::vector<Group> groups;
  for (const Candidate& candidate : candidates) {
    if (groups.empty() || groups.back().begin->cluster != candidate.cluster) {
      groups.push_back({&candidate, &candidate + 1});
    } else {
      groups.back().end = &candidate + 1;
    }
  }
  return groups;
}

// FUEL, eq. 1: what takes longer, the way or the turn of the camera.
double Fuel::cost(const Viewpoint& from, const Viewpoint& to, double length_m) const {
  const double turn_s =
      std::abs(angle_difference(to.yaw_rad, from.yaw_rad)) / rates_.yaw_rate_radps;
  return std::max(length_m / rates_.speed_mps, turn_s);
}

// FUEL, eq. 3: and what the velocity has to be turned by.
double Fuel::first_cost(const TrajectoryPoint& vehicle, const Candidate& to) const {
  const Vector3d way_m = to.viewpoint.position_m - vehicle.position_m;
  const double speed_mps = vehicle.velocity_mps.norm();
  double turn_rad = 0.0;
  if (speed_mps > kStandsStillMps && way_m.norm() > kStandsStillMps) {
    const double cosine = vehicle.velocity_mps.dot(way_m) / (speed_mps * way_m.norm());
    turn_rad = std::acos(std::clamp(cosine, -1.0, 1.0));
  }
  const double yaw_s =
      std::abs(angle_difference(to.viewpoint.yaw_rad, vehicle.yaw_rad)) / rates_.yaw_rate_radps;
  return std::max(to.route_length_m / rates_.speed_mps + config_.direction_weight * turn_rad,
                  yaw_s);
}

Tour Fuel::tour_over(const StrategyInput& input, const std::vector<Group>& groups) {
  std::vector<const Cluster*> clusters;
  std::unordered_map<std::uint32_t, std::size_t> place_of;
  for (const Group& group : groups) {
    place_of.emplace(group.begin->cluster->id, clusters.size());
    clusters.push_back(group.begin->cluster.get());
  }
  lengths_.update(*input.map, clusters);
  TourCosts costs(groups.size());
  for (std::size_t a = 0; a < groups.size(); ++a) {
    const Candidate& from = *groups[a].begin;
    costs.set_first(a, first_cost(input.vehicle, from));
    for (std::size_t b = a + 1; b < groups.size(); ++b) {
      const Viewpoint& to = groups[b].begin->viewpoint;
      costs.set_between(a, b, cost(from.viewpoint, to, lengths_.between(a, b)));
    }
  }
  Tour hint;
  for (const std::uint32_t id : last_tour_) {
    const auto place = place_of.find(id);
    if (place != place_of.end()) {
      hint.push_back(place->second);
    }
  }
  Tour tour = short_open_tour(costs, hint, config_.tour_kicks, Rng(kTourSeed));
  last_tour_.clear();
  for (const std::size_t place : tour) {
    last_tour_.push_back(clusters[place]->id);
  }
  return tour;
}

// The clusters whose views are chosen together, with those views that are good enough.
std::vector<Fuel::Group> Fuel::next_of(const StrategyInput& input,
                                       const std::vector<Group>& groups,
                                       const Tour& tour) const {
  std::vector<Group> next;
  for (const std::size_t place : tour) {
    Group group = groups[place];
    const Viewpoint& best = group.begin->viewpoint;
    const Candidate* end = group.begin;
    while (end < group.end && end - group.begin < config_.refined_views &&
           end->viewpoint.coverage >= config_.least_view_share * best.coverage) {
      ++end;
    }
    group.end = end;
    next.push_back(group);
    const double distance_m = (best.position_m - input.vehicle.position_m).norm();
    const bool is_last = distance_m > config_.refined_radius_m && next.size() >= 2;
    if (is_last || next.size() >= static_cast<std::size_t>(config_.refined_clusters)) {
      break;
    }
  }
  if (next.size() > 1) {
    next.back().end = next.back().begin + 1;  // there the way goes on as the tour says
  }
  return next;
}

// The shortest way through one view of each cluster in turn, from the last one to the first.
const Candidate& Fuel::refine(const StrategyInput& input, const std::vector<Group>& next) const {
  std::vector<double> onward(static_cast<std::size_t>(next.back().end - next.back().begin), 0.0);
  for (std::size_t layer = next.size() - 1; layer > 0; --layer) {
    std::vector<double> shorter;
    for (const Candidate* from = next[layer - 1].begin; from < next[layer - 1].end; ++from) {
      double least = std::numeric_limits<double>::infinity();
      for (const Candidate* to = next[layer].begin; to < next[layer].end; ++to) {
        // Near enough for a straight line to say how far.
        const double length_m = (to->viewpoint.position_m - from->viewpoint.position_m).norm();
        least = std::min(least,
                         cost(from->viewpoint, to->viewpoint, length_m) +
                             onward[static_cast<std::size_t>(to - next[layer].begin)]);
      }
      shorter.push_back(least);
    }
    onward = std::move(shorter);
  }
  const Candidate* best = next.front().begin;
  double least = std::numeric_limits<double>::infinity();
  for (const Candidate* to = next.front().begin; to < next.front().end; ++to) {
    const double total =
        first_cost(input.vehicle, *to) + onward[static_cast<std::size_t>(to - next.front().begin)];
    if (total < least) {
      least = total;
      best = to;
    }
  }
  return *best;
}

std::optional<Target> Fuel::choose(const StrategyInput& input) {
  if (!input.is_complete || input.candidates.empty()) {
    return std::nullopt;
  }
  const std::vector<Group> groups = groups_of(input.candidates);
  const Tour tour = tour_over(input, groups);
  return Target{refine(input, next_of(input, groups, tour)), FlightMode::kExplorer};
}

}  // namespace understory
