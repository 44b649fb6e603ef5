// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/team/coordination.hpp"

#include <algorithm>

namespace understory::team {
namespace {

constexpr double kLeastDistanceM = 0.1;  // 1/d has no value at 0
constexpr double kDoubtPeriods = 3.0;    // without a word, a vehicle may have stopped
constexpr Duration kStopStep = std::chrono::milliseconds(50);
constexpr double kStopSpacingM = 0.3;
constexpr double kRestMarginM = 0.1;  // over the safety distance, to who stands
constexpr double kEdge = 0.8;         // of the range: from here on a vehicle is held back

// The part of `box` for `index` of `count`, counted from its low end.
Box3d part_of(const Box3d& box_m, int index, int count) {
  if (count <= 1) {
    return box_m;
  }
  const int axis = box_m.sizes().y() > box_m.sizes().x() ? 1 : 0;
  const int low = count / 2;
  const double cut_m = box_m.min()[axis] + box_m.sizes()[axis] * low / count;
  Box3d half = box_m;
  if (index < low) {
    half.max()[axis] = cut_m;
    return part_of(half, index, low);
  }
  half.min()[axis] = cut_m;
  return part_of(half, index - low, count - low);
}

// Who is silent may have stopped anywhere on its way.
std::vector<Vector3d> stops_m(const Trajectory& flown, Time from) {
  std::vector<Vector3d> found{flown.sample(flown.end()).position_m};
  for (Time time = from; time < flown.end(); time += kStopStep) {
    const Vector3d place_m = flown.sample(time).position_m;
    if ((place_m - found.back()).norm() > kStopSpacingM) {
      found.push_back(place_m);
    }
  }
  return found;
}

}  // namespace

double repulsion(const CoordinationConfig& config, double distance_m) {
  const double inner_m = config.inner_radius_m;
  const double outer_m = config.outer_radius_m;
  if (distance_m > outer_m) {
    return 0.0;
  }
  const double gap_m = inner_m - outer_m;
  if (distance_m > inner_m) {
    return config.repulsion * (distance_m - outer_m) * (distance_m - outer_m);
  }
  const double nearness = 1.0 / std::max(distance_m, kLeastDistanceM) - 1.0 / outer_m;
  return config.repulsion * gap_m * gap_m * (inner_m * outer_m / (outer_m - inner_m)) * nearness;
}

double attraction(const CoordinationConfig& config, double distance_m) {
  return 0.5 * config.attraction * std::max(0.0, distance_m - kEdge * config.range_m);
}

bool is_attracted(FlightMode own, FlightMode other) {
  return !(own == FlightMode::kExplorer && other == FlightMode::kCollector);
}

double team_cost(const CoordinationConfig& config, const Errand& errand, const Peers& peers) {
  double cost = 0.0;
  for (const Peer& peer : peers) {
    if (!peer.in_contact) {
      continue;
    }
    const double distance_m = (errand.position_m - peer.position_m).norm();
    double shared = repulsion(config, distance_m);
    if (is_attracted(errand.mode, peer.mode)) {
      shared += attraction(config, distance_m);
    }
    if (peer.target_m) {
      shared += repulsion(config, (errand.position_m - *peer.target_m).norm());
    }
    cost += config.weight * shared +
            config.claim_weight * std::max(0.0, errand.route_length_m - distance_m);
  }
  return cost;
}

Box3d region_of(const TeamConfig& config, const Box3d& box_m) {
  return part_of(box_m, config.id, config.size);
}

Traffic traffic_of(const TeamConfig& config,
                   const Peers& peers,
                   std::vector<Mover> seen,
                   Time now) {
  const SeparationConfig& separation = config.separation;
  const double doubt_s = kDoubtPeriods / config.exchange.state_rate_hz;
  std::vector<Mover> movers = std::move(seen);
  for (const Peer& peer : peers) {
    const double silent_s = std::max(0.0, to_seconds(now - peer.heard_at));
    Mover mover;
    mover.position_m = peer.position_m;
    mover.has_way = peer.id < config.id;
    mover.extra_m = peer.in_contact ? 0.0
                                    : std::min(separation.silent_growth_mps * silent_s,
                                               separation.silent_max_m);
    if (peer.trajectory && silent_s > doubt_s) {
      mover.other_places_m = stops_m(*peer.trajectory, peer.stated_at);
    }
    if (!peer.is_on_trajectory() || silent_s > doubt_s) {
      movers.push_back(mover);  // where it is, or was last
    }
    if (peer.trajectory) {
      mover.other_places_m.clear();
      mover.trajectory = peer.trajectory;
      movers.push_back(mover);
    }
  }
  return {std::move(movers),
          {separation.plan_distance_m,
           0.5 * (separation.plan_distance_m + separation.safety_distance_m),
           separation.safety_distance_m + kRestMarginM}};
}

}  // namespace understory::team
