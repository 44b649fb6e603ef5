// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/strategy/explorer_collector.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace understory {
namespace {

// The candidate with the least cost among those admitted; the first of equals.
template <class Admit, class Cost>
std::optional<Candidate> cheapest(const std::vector<Candidate>& candidates,
                                  const Admit& admit,
                                  const Cost& cost) {
  const Candidate* best = nullptr;
  double least = std::numeric_limits<double>::infinity();
  for (const Candidate& candidate : candidates) {
    if (!admit(candidate)) {
      continue;
    }
    const double candidate_cost = cost(candidate);
    if (candidate_cost < least) {
      least = candidate_cost;
      best = &candidate;
    }
  }
  return best == nullptr ? std::nullopt : std::make_optional(*best);
}

// Candidates of a cluster follow on one another.
double cluster_count(const StrategyInput& input) {
  double count = 0.0;
  const Cluster* counted = nullptr;
  for (const Candidate& candidate : input.candidates) {
    count += candidate.cluster.get() != counted ? 1.0 : 0.0;
    counted = candidate.cluster.get();
  }
  return count;
}

bool is_same_target(const ClusterPtr& target, const Candidate& candidate) {
  return target != nullptr && is_same_place(*target, *candidate.cluster);
}

}  // namespace

// A trail within the radius that is worth the detour; both are wider for who is a Collector
// already.
bool ExplorerCollector::is_near_trail(const StrategyInput& input,
                                      const Candidate& candidate) const {
  const double factor = input.mode == FlightMode::kCollector ? config_.mode.leave_factor : 1.0;
  return candidate.cluster->is_trail() &&
         candidate.route_length_m <= factor * config_.mode.near_radius_m &&
         collector_cost(input, candidate) <= factor * config_.mode.max_detour_s;
}

FlightMode ExplorerCollector::select_mode(const StrategyInput& input) const {
  int near_trails = 0;
  const Cluster* counted = nullptr;
  for (const Candidate& candidate : input.candidates) {
    if (candidate.cluster.get() != counted && is_near_trail(input, candidate)) {
      counted = candidate.cluster.get();
      ++near_trails;
    }
  }
  const int needed = input.mode == FlightMode::kCollector ? 1 : config_.mode.min_near_trails;
  return near_trails >= needed ? FlightMode::kCollector : FlightMode::kExplorer;
}

double ExplorerCollector::turn_angle(const StrategyInput& input, const Vector3d& position_m) const {
  const Vector3d to_target = position_m - input.vehicle.position_m;
  const double speed_mps = input.vehicle.velocity_mps.norm();
  if (to_target.norm() < 1e-6) {
    return 0.0;
  }
  // Eq. 2 has no direction at hover; there the heading is where the vehicle can go on.
  const Vector3d direction =
      speed_mps >= config_.explorer.min_heading_speed_mps
          ? Vector3d(input.vehicle.velocity_mps / speed_mps)
          : Vector3d(std::cos(input.vehicle.yaw_rad), std::sin(input.vehicle.yaw_rad), 0.0);
  return std::acos(std::clamp(direction.dot(to_target.normalized()), -1.0, 1.0));
}

double ExplorerCollector::yaw_time_s(const StrategyInput& input, const Candidate& candidate) const {
  return std::abs(angle_difference(candidate.viewpoint.yaw_rad, input.vehicle.yaw_rad)) /
         rates_.yaw_rate_radps;
}

// Of the camera's turn, what is left of it when the vehicle could be there.
double ExplorerCollector::wait_time_s(const StrategyInput& input,
                                      const Candidate& candidate) const {
  return std::max(0.0, yaw_time_s(input, candidate) - path_time_s(candidate));
}

// Where there is little choice, who passes over what is near has to come back for it.
double ExplorerCollector::wait_weight_for(const StrategyInput& input) const {
  const double share = cluster_count(input) / config_.explorer.wait_ample_clusters;
  return config_.explorer.wait_weight * std::min(1.0, share);
}

double ExplorerCollector::path_time_s(const Candidate& candidate) const {
  return candidate.route_length_m / rates_.collector_speed_mps;
}

double ExplorerCollector::greedy_cost(const StrategyInput& input,
                                      const Candidate& candidate) const {
  const ExplorerCostConfig& weights = config_.explorer;
  const double label_cost = candidate.cluster->is_trail() ? weights.trail_penalty : 0.0;
  return weights.distance_weight * candidate.route_length_m + weights.label_weight * label_cost +
         weights.ring_weight * ring_m(candidate.cluster->mean_m) +
         weights.yaw_weight * yaw_time_s(input, candidate) +
         shared_cost(input, candidate, FlightMode::kExplorer);
}

// Half the edge of the ring around the box's middle that a place lies on, rings having the box's
// proportions.
double ExplorerCollector::ring_m(const Vector3d& position_m) const {
  const Vector2d half = 0.5 * rates_.box_m.sizes().head<2>();
  const Vector2d offset = (position_m - rates_.box_m.center()).head<2>().cwiseAbs();
  return offset.cwiseQuotient(half).maxCoeff() * half.mean();
}

double ExplorerCollector::explorer_cost(const StrategyInput& input,
                                        const Candidate& candidate) const {
  return greedy_cost(input, candidate) +
         config_.explorer.direction_weight * turn_angle(input, candidate.viewpoint.position_m);
}

double ExplorerCollector::collector_cost(const StrategyInput& input,
                                         const Candidate& candidate) const {
  return config_.collector.path_weight * path_time_s(candidate) +
         config_.collector.yaw_weight * yaw_time_s(input, candidate) +
         config_.collector.momentum_weight *
             momentum_time_s(input, candidate.viewpoint.position_m) +
         shared_cost(input, candidate, FlightMode::kCollector);
}

// Of the part of the box where another vehicle began.
bool ExplorerCollector::is_foreign(const Candidate& candidate) const {
  return !rates_.box_m.contains(candidate.cluster->mean_m);
}

double ExplorerCollector::shared_cost(const StrategyInput& input,
                                      const Candidate& candidate,
                                      FlightMode mode) const {
  return team::team_cost(
      rates_.team, {candidate.viewpoint.position_m, candidate.route_length_m, mode}, input.peers);
}

// What of the velocity does not lead to the target has to be braked away first.
double ExplorerCollector::momentum_time_s(const StrategyInput& input,
                                          const Vector3d& position_m) const {
  const Vector3d to_target = position_m - input.vehicle.position_m;
  const Vector3d& velocity_mps = input.vehicle.velocity_mps;
  if (to_target.norm() < 1e-6) {
    return 0.0;
  }
  const double onward_mps = std::max(velocity_mps.dot(to_target.normalized()), 0.0);
  return (velocity_mps - onward_mps * to_target.normalized()).norm() /
         rates_.collector_acceleration_mps2;
}

std::optional<Candidate> ExplorerCollector::choose_as_explorer(const StrategyInput& input) const {
  const ExplorerCostConfig& settings = config_.explorer;
  const auto kept = [&](const Candidate& candidate, double cost) {
    return is_same_target(input.target, candidate) ? cost - config_.keep_target_bonus : cost;
  };
  const double wait_weight = wait_weight_for(input);
  const auto waited = [&](const Candidate& candidate, double cost) {
    return kept(candidate, cost + wait_weight * wait_time_s(input, candidate));
  };
  const auto distance_m = [&](const Candidate& candidate) {
    return (candidate.viewpoint.position_m - input.vehicle.position_m).norm();
  };
  std::optional<Candidate> ahead = cheapest(
      input.candidates,
      [&](const Candidate& candidate) {
        return distance_m(candidate) <= settings.ahead_distance_m &&
               turn_angle(input, candidate.cluster->mean_m) <= settings.ahead_angle_rad;
      },
      [&](const Candidate& candidate) {
        return waited(candidate, explorer_cost(input, candidate));
      });
  if (ahead) {
    return ahead;
  }
  std::optional<Candidate> near = cheapest(
      input.candidates,
      [&](const Candidate& candidate) {
        return distance_m(candidate) <= settings.greedy_distance_m;
      },
      [&](const Candidate& candidate) { return waited(candidate, greedy_cost(input, candidate)); });
  if (near || !input.is_complete) {
    return near;
  }
  return cheapest(
      input.candidates,
      [](const Candidate&) { return true; },
      [&](const Candidate& candidate) { return kept(candidate, candidate.route_length_m); });
}

std::optional<Candidate> ExplorerCollector::choose_as_collector(const StrategyInput& input) const {
  return cheapest(
      input.candidates,
      [&](const Candidate& candidate) { return is_near_trail(input, candidate); },
      [&](const Candidate& candidate) {
        const double cost = collector_cost(input, candidate);
        return is_same_target(input.target, candidate) ? cost - config_.keep_target_bonus : cost;
      });
}

// The cheapest view of a cluster decides which cluster is next. It is flown to beyond that view, to
// one nearer the cluster: the cluster is seen on the way there, and the vehicle need not slow down.
Candidate ExplorerCollector::far_view_of(const StrategyInput& input,
                                         const Candidate& cheapest) const {
  const Vector3d direction = cheapest.viewpoint.position_m - input.vehicle.position_m;
  const Candidate* far = &cheapest;
  for (const Candidate& candidate : input.candidates) {
    const Vector3d onward = candidate.viewpoint.position_m - input.vehicle.position_m;
    const double detour_m = candidate.route_length_m - cheapest.route_length_m;
    if (candidate.cluster == cheapest.cluster && candidate.route_length_m > far->route_length_m &&
        detour_m <= config_.overshoot_m &&
        candidate.viewpoint.coverage >= 0.8 * cheapest.viewpoint.coverage &&
        std::abs(angle_difference(candidate.viewpoint.yaw_rad, cheapest.viewpoint.yaw_rad)) < 0.4 &&
        (direction.norm() < 0.5 || onward.normalized().dot(direction.normalized()) > 0.8)) {
      far = &candidate;
    }
  }
  return *far;
}

std::optional<Candidate> ExplorerCollector::choose_among(const StrategyInput& input,
                                                         FlightMode mode) const {
  const bool is_greedy = mode == FlightMode::kCollector && !config_.mode.only_sets_pace;
  return is_greedy ? choose_as_collector(input) : choose_as_explorer(input);
}

std::optional<Target> ExplorerCollector::choose(const StrategyInput& input) {
  const FlightMode mode = select_mode(input);
  std::optional<Candidate> candidate = choose_among(input, mode);
  if (candidate && is_foreign(*candidate)) {
    if (!input.is_complete) {
      return std::nullopt;  // there may be more of its own further away
    }
    StrategyInput own = input;
    own.candidates.erase(std::remove_if(own.candidates.begin(),
                                        own.candidates.end(),
                                        [this](const Candidate& c) { return is_foreign(c); }),
                         own.candidates.end());
    const std::optional<Candidate> of_own = choose_among(own, mode);
    const double worth_m = candidate->route_length_m + rates_.team.foreign_cost_m;
    candidate = of_own && of_own->route_length_m <= worth_m ? of_own : candidate;
  }
  if (!candidate) {
    return std::nullopt;
  }
  return Target{far_view_of(input, *candidate), mode};
}

}  // namespace understory
