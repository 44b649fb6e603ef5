// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/explorer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "understory/plan/way_out.hpp"

namespace understory {
namespace {

// Routes keep a little more distance than trajectories must, so that smoothing has room.
constexpr double kRouteExtraClearanceM = 0.04;

constexpr double kUnreachable = std::numeric_limits<double>::infinity();

double route_clearance_m(const PlanConfig& plan) {
  return plan.vehicle_radius_m + plan.margin_m + kRouteExtraClearanceM;
}

std::unique_ptr<Strategy> make_strategy(const ExplorerConfig& config,
                                        const GridGeometry& geometry) {
  if (config.strategy == "fuel") {
    const Limits limits = config.limits.limits_for(FlightMode::kExplorer);
    return std::make_unique<Fuel>(
        config.fuel,
        FuelRates{limits.speed_mps, limits.yaw_rate_radps, route_clearance_m(config.plan)},
        geometry);
  }
  const Limits limits = config.limits.limits_for(FlightMode::kCollector);
  const team::TeamConfig& team = config.team;
  const Box3d box_m = geometry.box_m();
  if (team.coordination.inner_radius_m >= team.coordination.outer_radius_m) {
    throw ConfigError("team.coordination.inner_radius_m: must lie below outer_radius_m");
  }
  const TravelRates rates{limits.speed_mps,
                          limits.acceleration_mps2,
                          limits.yaw_rate_radps,
                          team.coordination.own_region ? team::region_of(team, box_m) : box_m,
                          team.coordination};
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
      geometry_(geometry),
      region_m_(config.team.coordination.split_map ? team::region_of(config.team, geometry.box_m())
                                                   : geometry.box_m()),
      routes_(geometry, route_clearance_m(config.plan)),
      tight_routes_(geometry, config.plan.vehicle_radius_m + config.plan.margin_m),
      far_routes_(geometry, route_clearance_m(config.plan)),
      finder_(config.frontier, config.camera, geometry),
      strategy_(make_strategy(config, geometry)),
      set_aside_(duration_from_seconds(config.retry.set_aside_s), config.retry.max_tries) {}

void Explorer::avoid(const Barriers& barriers) {
  routes_.avoid(barriers);
  tight_routes_.avoid(barriers);
}

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
        return !cluster->is_dormant() && is_ours(*cluster);
      });
}

bool Explorer::is_abroad() const {
  return config_.team.coordination.own_region && target_ &&
         !team::region_of(config_.team, geometry_.box_m())
              .contains(target_->candidate.cluster->mean_m);
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
  input.map = &pilot.clearance();
  input.is_complete = reach != Reach::kNear;
  input.vehicle = pilot.next_start_point(now);
  input.mode = mode_;
  input.target = target_ ? target_->candidate.cluster : nullptr;
  input.peers = peers_;
  input.candidates.reserve(std::accumulate(
      finder_.clusters().begin(),
      finder_.clusters().end(),
      std::size_t{0},
      [](std::size_t sum, const ClusterPtr& each) { return sum + each->viewpoints.size(); }));
  for (const ClusterPtr& cluster : finder_.clusters()) {
    if (!is_ours(*cluster) ||
        (reach < Reach::kAllAndSetAside && set_aside_.is_waiting(*cluster, now))) {
      continue;
    }
    for (const Viewpoint& viewpoint : cluster->viewpoints) {
      if (!set_aside_.is_banned(viewpoint)) {
        input.candidates.push_back({cluster, viewpoint, kUnreachable});
      }
    }
  }
  measure(pilot, reach, input);
  const auto is_unreachable = [](const Candidate& c) { return c.route_length_m == kUnreachable; };
  input.candidates.erase(
      std::remove_if(input.candidates.begin(), input.candidates.end(), is_unreachable),
      input.candidates.end());
  return input;
}

// The lengths of the routes to all candidates.
void Explorer::measure(const Pilot& pilot, Reach reach, StrategyInput& input) {
  std::vector<RouteLattice::Node> nodes;
  nodes.reserve(input.candidates.size());
  for (const Candidate& candidate : input.candidates) {
    nodes.push_back(candidate.viewpoint.node);
  }
  const double max_length_m = reach < Reach::kAll ? config_.replan.near_route_m : kUnreachable;
  RouteSearch& routes = reach == Reach::kThroughTightGaps ? tight_routes_ : routes_;
  // The lengths to what is near are still those of the question before.
  const bool was_asked_near = reach == Reach::kFar && !strategy_->needs_all();
  if (!was_asked_near) {
    routes.run(pilot.clearance(), input.vehicle.position_m, nodes, max_length_m);
  }
  for (Candidate& candidate : input.candidates) {
    candidate.route_length_m = routes.length_m(candidate.viewpoint.node).value_or(kUnreachable);
  }
  if (reach == Reach::kFar) {
    estimate(pilot.clearance(), input);
  }
}

// Of those that have none yet.
void Explorer::estimate(const ClearanceMap& map, StrategyInput& input) {
  std::vector<Candidate*> far;
  CoarseRoutes::Entries entries;
  for (Candidate& candidate : input.candidates) {
    if (candidate.route_length_m == kUnreachable) {
      far.push_back(&candidate);
      entries.push_back(far_routes_.entry_of(map, candidate.viewpoint.position_m));
    }
  }
  const std::vector<std::optional<double>> lengths_m =
      far_routes_.lengths_m(map, input.vehicle.position_m, entries, kUnreachable);
  for (std::size_t i = 0; i < far.size(); ++i) {
    if (lengths_m[i]) {
      // Nearer than this the exact search would have found it.
      far[i]->route_length_m = std::max(*lengths_m[i], config_.replan.near_route_m);
    }
  }
}

bool Explorer::has_route(RouteSearch& routes, const StrategyInput& input, const Target& target) {
  const RouteLattice::Node& node = target.candidate.viewpoint.node;
  // What is estimated is found with little work mostly.
  const double likely_m = 1.15 * target.candidate.route_length_m + 1.0;
  for (const double max_length_m : {likely_m, kUnreachable}) {
    if (!routes.length_m(node)) {
      routes.run(*input.map, input.vehicle.position_m, {node}, max_length_m);
    }
  }
  return routes.length_m(node).has_value();
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

// A few voxels of each cluster, those not worth a flight of their own too. The target is seen at
// the end.
std::vector<Sight> Explorer::sights(const Candidate& target) const {
  constexpr std::size_t kPerCluster = 4;
  std::vector<Sight> found;
  const auto add = [&](const ClusterPtr& cluster) {
    const std::size_t count = std::min(cluster->voxels.size(), kPerCluster);
    for (std::size_t i = 0; i < count; ++i) {
      const VoxelIndex& voxel = cluster->voxels[i * cluster->voxels.size() / count];
      found.push_back({geometry_.center_of(voxel),
                       static_cast<double>(cluster->voxels.size()) / static_cast<double>(count)});
    }
  };
  for (const ClusterPtr& cluster : finder_.clusters()) {
    if (cluster != target.cluster && !set_aside_.is_given_up(*cluster)) {
      add(cluster);
    }
  }
  std::for_each(finder_.worthless().begin(), finder_.worthless().end(), add);
  return found;
}

// Null: what is flown goes there already, or none of the targets tried can be flown to.
TrajectoryPtr Explorer::try_targets(
    Pilot& pilot, RouteSearch& routes, Choice choice, Time now, bool in_danger) {
  auto& [input, target] = choice;
  for (int attempt = 0; target && attempt < config_.replan.max_attempts; ++attempt) {
    if (attempt == 0 && !in_danger && is_on_the_way_to(*target, pilot) &&
        !is_sluggish(pilot, now)) {
      return nullptr;
    }
    const bool is_reachable = has_route(routes, input, *target);
    bool is_passing = false;  // what was in the way
    if (is_reachable) {
      const Result<TrajectoryPtr, PlanError> flown =
          pilot.fly({routes.route_m(target->candidate.viewpoint.node),
                     target->candidate.viewpoint.yaw_rad,
                     target->mode,
                     config_.limits.limits_for(target->mode),
                     sights(target->candidate)},
                    now);
      if (flown) {
        adopt(*target, pilot, now);
        return *flown;
      }
      is_passing = flown.error() == PlanError::kTraffic;
    }
    // From motion a plan may fail that works from rest; only then is the target to blame.
    if (is_reachable && !is_passing && pilot.is_at_rest(now)) {
      counters_.given_up += set_aside_.add(*target->candidate.cluster, now) ? 1U : 0U;
      ++counters_.set_aside;
    }
    const Cluster* failed = target->candidate.cluster.get();
    input.candidates.erase(
        std::remove_if(input.candidates.begin(),
                       input.candidates.end(),
                       [failed](const Candidate& c) { return c.cluster.get() == failed; }),
        input.candidates.end());
    target = strategy_->choose(input);
  }
  return nullptr;
}

std::vector<Vector3d> Explorer::way_out(const Pilot& pilot, Time now) {
  return understory::way_out(pilot.clearance(),
                             tight_routes_,
                             config_.plan.vehicle_radius_m + config_.plan.margin_m,
                             pilot.next_start_point(now).position_m);
}

// Null: it is in none, or on its way out.
TrajectoryPtr Explorer::leave_pocket(Pilot& pilot, Time now) {
  if (!pilot.is_at_rest(now) || !has_open_clusters()) {
    return nullptr;
  }
  std::vector<Vector3d> route_m = way_out(pilot, now);
  if (route_m.empty()) {
    return nullptr;
  }
  const Vector3d course_m = route_m.back() - route_m.front();
  const Limits limits = config_.limits.limits_for(FlightMode::kExplorer);
  const Result<TrajectoryPtr, PlanError> flown = pilot.fly(
      {std::move(route_m), std::atan2(course_m.y(), course_m.x()), FlightMode::kTransit, limits},
      now);
  return flown ? *flown : nullptr;
}

ExploreStep Explorer::decide(Pilot& pilot, Time now, bool in_danger) {
  ExploreStep step;
  step.decided = true;
  ++counters_.decisions;
  last_decision_ = now;
  finder_.form(pilot.clearance(), routes_);
  for (const Reach reach :
       {Reach::kNear, Reach::kFar, Reach::kAll, Reach::kAllAndSetAside, Reach::kThroughTightGaps}) {
    if (reach == Reach::kNear && strategy_->needs_all()) {
      continue;
    }
    Choice choice{gather(pilot, now, reach), std::nullopt};
    counters_.full_searches += reach == Reach::kAll ? 1U : 0U;
    choice.target = strategy_->choose(choice.input);
    RouteSearch& routes = reach == Reach::kThroughTightGaps ? tight_routes_ : routes_;
    if (choice.target &&
        (reach != Reach::kFar || has_route(routes, choice.input, *choice.target))) {
      is_leaving_pocket_ = false;
      step.published = try_targets(pilot, routes, std::move(choice), now, in_danger);
      return step;
    }
  }
  step.published = leave_pocket(pilot, now);
  is_leaving_pocket_ = step.published || (is_leaving_pocket_ && !pilot.is_at_rest(now));
  step.status = is_leaving_pocket_ ? ExploreStatus::kFlying : ExploreStatus::kNothingLeft;
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
