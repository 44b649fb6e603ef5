// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// One decision cycle of the exploring vehicle, as in the paper's pipeline figure: map -> frontiers,
// viewpoints, trails -> mode and target -> trajectory. World frame, SI units. Called with every map
// update, on one thread; deterministic; nothing throws in flight. Targets that cannot be reached or
// seen are set aside for a while, tried again a bounded number of times, then given up.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "understory/explorer_config.hpp"
#include "understory/frontier/frontier_finder.hpp"
#include "understory/plan/pilot.hpp"
#include "understory/plan/route_search.hpp"
#include "understory/strategy/set_aside.hpp"
#include "understory/strategy/strategy.hpp"

namespace understory {

enum class ExploreStatus : std::uint8_t {
  kFlying,       // on the way to a target
  kNothingLeft,  // no cluster is left that can be reached and seen
};

struct ExploreStep {
  ExploreStatus status = ExploreStatus::kFlying;
  bool decided = false;     // a decision was made in this cycle
  TrajectoryPtr published;  // null: what is flown stands
};

struct ExplorerCounters {
  std::uint64_t decisions = 0;
  std::uint64_t full_searches = 0;
  std::uint64_t set_aside = 0;
  std::uint64_t given_up = 0;
};

class Explorer {
 public:
  Explorer(const ExplorerConfig& config, const GridGeometry& geometry);

  // With every map update: what is frontier now. Clusters are formed when a decision is due.
  void observe(const MapSnapshotPtr& snapshot);
  // What is known of team mates now.
  void set_peers(team::Peers peers) { peers_ = std::move(peers); }
  [[nodiscard]] const team::Peers& peers() const { return peers_; }
  // Where routes do not lead now (Pilot::barriers).
  void avoid(const Barriers& barriers);
  // Call after observe(), with the pilot on the same map.
  ExploreStep step(Pilot& pilot, Time now);

  // Is something left that could be seen from somewhere and was not given up?
  [[nodiscard]] bool has_open_clusters() const;
  [[nodiscard]] const std::vector<ClusterPtr>& clusters() const { return finder_.clusters(); }
  [[nodiscard]] const std::optional<Target>& target() const { return target_; }
  // Has it turned to another vehicle's part of the box?
  [[nodiscard]] bool is_abroad() const;
  // What it was flying to is no longer its aim; the next step() finds another.
  void forget_target() { target_.reset(); }
  [[nodiscard]] FlightMode mode() const { return mode_; }
  [[nodiscard]] const ExplorerCounters& counters() const { return counters_; }
  [[nodiscard]] const SetAsideList& set_aside() const { return set_aside_; }
  [[nodiscard]] RouteSearch& routes() { return routes_; }
  // For who is boxed in: routes with no more room than a trajectory must have, and the way out
  // where there are none (way_out.hpp).
  [[nodiscard]] RouteSearch& tight_routes() { return tight_routes_; }
  [[nodiscard]] std::vector<Vector3d> way_out(const Pilot& pilot, Time now);

 private:
  // How far targets are looked for; the lengths to those far away are estimates with kFar.
  enum class Reach : std::uint8_t { kNear, kFar, kAll, kAllAndSetAside, kThroughTightGaps };

  struct Choice {
    StrategyInput input;
    std::optional<Target> target;
  };

  [[nodiscard]] bool is_ours(const Cluster& cluster) const {
    return region_m_.contains(cluster.mean_m) && !set_aside_.is_given_up(cluster);
  }
  [[nodiscard]] bool is_sluggish(const Pilot& pilot, Time now) const;
  [[nodiscard]] bool is_due(const Pilot& pilot, Time now) const;
  [[nodiscard]] bool reaches_target(const Pilot& pilot) const;
  [[nodiscard]] bool is_on_the_way_to(const Target& target, const Pilot& pilot) const;
  void review_target(const Pilot& pilot, Time now);
  [[nodiscard]] StrategyInput gather(const Pilot& pilot, Time now, Reach reach);
  void measure(const Pilot& pilot, Reach reach, StrategyInput& input);
  void estimate(const ClearanceMap& map, StrategyInput& input);
  [[nodiscard]] static bool has_route(RouteSearch& routes,
                                      const StrategyInput& input,
                                      const Target& target);
  ExploreStep decide(Pilot& pilot, Time now, bool in_danger);
  [[nodiscard]] TrajectoryPtr try_targets(
      Pilot& pilot, RouteSearch& routes, Choice choice, Time now, bool in_danger);
  [[nodiscard]] std::vector<Sight> sights(const Candidate& target) const;
  [[nodiscard]] TrajectoryPtr leave_pocket(Pilot& pilot, Time now);
  void adopt(const Target& target, const Pilot& pilot, Time now);

  ExplorerConfig config_;
  GridGeometry geometry_;
  Box3d region_m_;  // clusters outside of it are not flown to
  team::Peers peers_;
  RouteSearch routes_;
  RouteSearch tight_routes_;
  CoarseRoutes far_routes_;
  FrontierFinder finder_;
  std::unique_ptr<Strategy> strategy_;
  SetAsideList set_aside_;
  FlightMode mode_ = FlightMode::kExplorer;
  std::optional<Target> target_;
  Time target_deadline_{};
  Time last_decision_{};
  bool is_leaving_pocket_ = false;
  ExplorerCounters counters_;
};

}  // namespace understory
