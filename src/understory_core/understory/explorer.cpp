// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/explorer.hpp"

#include <algorithm>
#include <limits>

namespace understory {
namespace {

// Routes keep a little more distance than trajectories must, so that smoothing has room.
constexpr double kRouteExtraClearanceM = 0.04;

std::unique_ptr<Strategy> make_strategy(const ExplorerConfig& config,
                                        const GridGeometry& geometry) {
  const Limits limits = config.limits.limits_for(FlightMode::kCollector);
  const TravelRates rates{
      limits.speed_mps, limits.acceleration_mps2, limits.yaw_rate_radps, geometry.box_m()};
  return std::make_unique<ExplorerCollector>(config.explorer_collector, rates);
}

}  // namespace

Limits LimitsConfig::limits_for(FlightMode mode) const {
  const bool is_fast = mode == FlightMode::kCollector || mode == FlightMode::kTransit;
  const double factor = is_fast && speed_cap == "paper" ? collector_factor : 1.0;
  Limits limits;
  limits.speed_mps = factor * speed_mps;
  limits.acceleration_mps2 = factor * acceleration_mps2;
  limits.yaw_rate_radps = yaw_rate_radps;
  limits.yaw_acceleration_radps2 = yaw_acceleration_radps2;
  return limits;
}

Explorer::Explorer(const ExplorerConfig& config, const GridGeometry& geometry)
    : config_(config),
      routes_(geometry,
              config.plan.vehicle_radius_m + config.plan.margin_m + kRouteExtraClearanceM),
      tight_routes_(geometry, config.plan.vehicle_radius_m + config.plan.margin_m),
      finder_(config.frontier, config.camera, geometry),
      strategy_(make_strategy(config, geometry)),
      set_aside_(duration_from_seconds(config.retry.set_aside_s), config.retry.max_tries) {}

void Explorer::observe(const MapSnapshotPtr& snapshot) {
  finder_.observe(snapshot);
}

// Drops a target that has been seen; sets one aside that takes too long or shows nothing new.
void Explorer::review_target(const Pilot& pilot, Time now) {
  if (!target_) {
    return;
  }
  const Cluster& cluster = *target_->candidate.cluster;
  if (finder_.is_seen(cluster)) {
    target_.reset();
    return;
  }
  const Trajectory& flown = *pilot.follower().newest();
  const bool is_there =
      now >= flown.end() + duration_from_seconds(config_.retry.dwell_s) &&
      (flown.sample(now).position_m - target_->candidate.viewpoint.position_m).norm() <
          pilot.clearance().geometry().resolution_m();
  if (is_there) {
    set_aside_.ban_view(target_->candidate.viewpoint);
  }
  if (is_there || now > target_deadline_) {
    counters_.given_up += set_aside_.add(cluster, now) ? 1U : 0U;
    ++counters_.set_aside;
    target_.reset();
  }
}

// Does what is flown end where the target is looked at from?
bool Explorer::reaches_target(const Pilot& pilot) const {
  return target_ && (pilot.follower().newest()->position.control_points.back() -
                     target_->candidate.viewpoint.position_m)
                            .norm() < pilot.clearance().geometry().resolution_m();
}

bool Explorer::has_open_clusters() const {
  return std::any_of(
      finder_.clusters().begin(), finder_.clusters().end(), [this](const ClusterPtr& cluster) {
        return !cluster->is_dormant() && !set_aside_.is_given_up(*cluster);
      });
}

// Takes what is flown far longer than the rest of the way should? A plan made in fast flight may;
// one made from what is slow by now will not.
bool Explorer::is_sluggish(const Pilot& pilot, Time now) const {
  constexpr double kFactor = 2.0;
  constexpr double kSlack_s = 3.0;
  const Trajectory& flown = *pilot.follower().newest();
  const double left_m =
      (flown.position.control_points.back() - flown.sample(now).position_m).norm();
  return to_seconds(flown.end() - now) > kFactor * left_m / config_.limits.speed_mps + kSlack_s;
}

bool Explorer::is_due(const Pilot& pilot, Time now) const {
  const double waited_s = to_seconds(now - last_decision_);
  if (counters_.decisions == 0) {
    return true;
  }
  if (waited_s < config_.replan.min_interval_s) {
    return false;
  }
  if (!target_ || is_sluggish(pilot, now)) {
    return true;
  }
  if (!reaches_target(pilot)) {
    // The piece of the route that is flown has to be continued before it slows down.
    const double left_s = to_seconds(pilot.follower().newest()->end() - now);
    return left_s < config_.replan.continue_before_end_s;
  }
  return !pilot.is_at_rest(now) && waited_s >= config_.replan.max_interval_s;
}

StrategyInput Explorer::gather(const Pilot& pilot, Time now, Reach reach) {
  StrategyInput input;
  input.is_complete = reach != Reach::kNear;
  input.vehicle = pilot.next_start_point(now);
  input.mode = mode_;
  input.target = target_ ? target_->candidate.cluster : nullptr;
  std::vector<RouteLattice::Node> nodes;
  for (const ClusterPtr& cluster : finder_.clusters()) {
    if (set_aside_.is_given_up(*cluster) ||
        (reach < Reach::kAllAndSetAside && set_aside_.is_waiting(*cluster, now))) {
      continue;
    }
    for (const Viewpoint& viewpoint : cluster->viewpoints) {
      if (!set_aside_.is_banned(viewpoint)) {
        input.candidates.push_back({cluster, viewpoint, 0.0});
        nodes.push_back(viewpoint.node);
      }
    }
  }
  const double max_length_m =
      reach == Reach::kNear ? config_.replan.near_route_m : std::numeric_limits<double>::infinity();
  RouteSearch& routes = reach == Reach::kThroughTightGaps ? tight_routes_ : routes_;
  routes.run(pilot.clearance(), input.vehicle.position_m, nodes, max_length_m);
  const auto unreachable = [&routes](Candidate& candidate) {
    const std::optional<double> length_m = routes.length_m(candidate.viewpoint.node);
    candidate.route_length_m = length_m.value_or(0.0);
    return !length_m.has_value();
  };
  input.candidates.erase(
      std::remove_if(input.candidates.begin(), input.candidates.end(), unreachable),
      input.candidates.end());
  return input;
}

void Explorer::adopt(const Target& target, const Pilot& pilot, Time now) {
  const bool is_same =
      target_ && is_same_place(*target_->candidate.cluster, *target.candidate.cluster);
  if (!is_same) {
    const double flight_s = target.candidate.route_length_m / config_.limits.speed_mps +
                            to_seconds(pilot.follower().newest()->duration());
    target_deadline_ = now + duration_from_seconds(flight_s * 2.0 + config_.retry.patience_s);
  }
  target_ = target;
  mode_ = target.mode;
}

bool Explorer::is_on_the_way_to(const Target& target, const Pilot& pilot) const {
  return reaches_target(pilot) && target.mode == mode_ &&
         is_same_place(*target_->candidate.cluster, *target.candidate.cluster);
}

// Null: what is flown goes there already, or none of the targets tried can be flown to.
TrajectoryPtr Explorer::try_targets(
    Pilot& pilot, const RouteSearch& routes, StrategyInput input, Time now, bool in_danger) {
  for (int attempt = 0; attempt < config_.replan.max_attempts; ++attempt) {
    const std::optional<Target> target = strategy_->choose(input);
    if (!target) {
      return nullptr;
    }
    if (attempt == 0 && !in_danger && is_on_the_way_to(*target, pilot) &&
        !is_sluggish(pilot, now)) {
      return nullptr;
    }
    const Result<TrajectoryPtr, PlanError> flown =
        pilot.fly({routes.route_m(target->candidate.viewpoint.node),
                   target->candidate.viewpoint.yaw_rad,
                   target->mode,
                   config_.limits.limits_for(target->mode)},
                  now);
    if (flown) {
      adopt(*target, pilot, now);
      return *flown;
    }
    // From motion a plan may fail that works from rest; only then is the target to blame.
    if (pilot.is_at_rest(now)) {
      counters_.given_up += set_aside_.add(*target->candidate.cluster, now) ? 1U : 0U;
      ++counters_.set_aside;
    }
    const Cluster* failed = target->candidate.cluster.get();
    input.candidates.erase(
        std::remove_if(input.candidates.begin(),
                       input.candidates.end(),
                       [failed](const Candidate& c) { return c.cluster.get() == failed; }),
        input.candidates.end());
  }
  return nullptr;
}

ExploreStep Explorer::decide(Pilot& pilot, Time now, bool in_danger) {
  ExploreStep step;
  step.decided = true;
  ++counters_.decisions;
  last_decision_ = now;
  finder_.form(pilot.clearance(), routes_);
  for (const Reach reach :
       {Reach::kNear, Reach::kAll, Reach::kAllAndSetAside, Reach::kThroughTightGaps}) {
    const StrategyInput input = gather(pilot, now, reach);
    counters_.full_searches += reach == Reach::kAll ? 1U : 0U;
    if (!strategy_->choose(input)) {
      continue;
    }
    step.published = try_targets(
        pilot, reach == Reach::kThroughTightGaps ? tight_routes_ : routes_, input, now, in_danger);
    return step;
  }
  step.status = ExploreStatus::kNothingLeft;
  return step;
}

ExploreStep Explorer::step(Pilot& pilot, Time now) {
  review_target(pilot, now);
  // At rest there is nothing to brake; a way out is looked for at the usual pace.
  const bool in_danger = !pilot.is_at_rest(now) && pilot.unsafe_from(now).has_value();
  ExploreStep step;
  if (in_danger || is_due(pilot, now)) {
    step = decide(pilot, now, in_danger);
  }
  if (in_danger && !step.published) {
    const Result<TrajectoryPtr, PlanError> braked = pilot.brake(now);
    step.published = braked ? *braked : nullptr;
    step.status = ExploreStatus::kFlying;
  }
  return step;
}

}  // namespace understory
