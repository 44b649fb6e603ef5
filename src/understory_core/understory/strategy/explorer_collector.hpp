// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// The paper's strategy: cautious Explorer along the border of the unknown, fast Collector of the
// trails it leaves (Bartolomei, Teixeira, Chli, III-A and III-B, eq. 1 to 7, with the settlements
// of docs/paper_notes.md). World frame, SI units. Stateless: the mode so far comes with the input.
#pragma once

#include "understory/base/config.hpp"
#include "understory/strategy/strategy.hpp"
#include "understory/team/coordination.hpp"

namespace understory {

struct ModeConfig {
  double near_radius_m = 8.0;
  int min_near_trails = 1;
  double leave_factor = 1.25;
  double max_detour_s = 4.0;
  bool only_sets_pace = false;

  void visit(FieldVisitor& f) {
    f.field("near_radius_m",
            near_radius_m,
            in_range(0.5, 100.0),
            "trails within this route length make a Collector");
    f.field("min_near_trails",
            min_near_trails,
            in_range(1, 1000),
            "as many near trails make a Collector");
    f.field("leave_factor",
            leave_factor,
            in_range(1.0, 10.0),
            "a Collector stays one while trails are within this many radii and detours");
    f.field("max_detour_s",
            max_detour_s,
            in_range(0.1, 1000.0),
            "a trail that costs a Collector more than this is no longer worth the detour");
    f.field("only_sets_pace",
            only_sets_pace,
            "a Collector chooses its targets as an Explorer does, it is only faster; not in the "
            "paper");
  }
};

struct ExplorerCostConfig {
  double distance_weight = 1.0;
  double direction_weight = 2.0;
  double label_weight = 1.0;
  double trail_penalty = 1.0;
  double ring_weight = 0.0;
  double yaw_weight = 0.0;
  double wait_weight = 0.0;
  double wait_ample_clusters = 50.0;
  double ahead_distance_m = 6.0;
  double ahead_angle_rad = 0.6;
  double greedy_distance_m = 10.0;
  double min_heading_speed_mps = 0.7;

  void visit(FieldVisitor& f) {
    f.field("distance_weight", distance_weight, in_range(0.0, 1000.0), "w_D, per metre of route");
    f.field("direction_weight",
            direction_weight,
            in_range(0.0, 1000.0),
            "w_V, per radian between velocity and target");
    f.field("label_weight", label_weight, in_range(0.0, 1000.0), "w_L");
    f.field("trail_penalty", trail_penalty, in_range(-1000.0, 1000.0), "p_trail");
    f.field("ring_weight",
            ring_weight,
            in_range(0.0, 1000.0),
            "per metre that the cluster's square ring lies further out in the box: from the inside "
            "outwards nothing is left behind; not in the paper");
    f.field("yaw_weight",
            yaw_weight,
            in_range(0.0, 1000.0),
            "per second of turning the camera, as a Collector pays it; not in the paper");
    f.field("wait_weight",
            wait_weight,
            in_range(0.0, 1000.0),
            "per second that the camera still has to turn once the vehicle could be there; not in "
            "the paper");
    f.field("wait_ample_clusters",
            wait_ample_clusters,
            in_range(1.0, 10000.0),
            "with fewer clusters than this in reach, that counts in proportion less");
    f.field("ahead_distance_m",
            ahead_distance_m,
            in_range(0.5, 1000.0),
            "clusters ahead are nearer than this");
    f.field("ahead_angle_rad",
            ahead_angle_rad,
            in_range(0.05, 3.15),
            "and within this angle of the direction of flight");
    f.field("greedy_distance_m",
            greedy_distance_m,
            in_range(0.5, 1000.0),
            "d_max of the greedy fallback");
    f.field("min_heading_speed_mps",
            min_heading_speed_mps,
            in_range(0.0, 10.0),
            "below this speed the heading stands in for the velocity");
  }
};

struct CollectorCostConfig {
  double path_weight = 1.0;
  double yaw_weight = 1.0;
  double momentum_weight = 1.0;

  void visit(FieldVisitor& f) {
    f.field("path_weight", path_weight, in_range(0.0, 1000.0), "w_P, per second of flight");
    f.field("yaw_weight", yaw_weight, in_range(0.0, 1000.0), "w_A, per second of turning");
    f.field("momentum_weight",
            momentum_weight,
            in_range(0.0, 1000.0),
            "per second that it takes to turn the velocity towards the target; not in the paper");
  }
};

struct ExplorerCollectorConfig {
  ModeConfig mode;
  ExplorerCostConfig explorer;
  CollectorCostConfig collector;
  double keep_target_bonus = 0.3;
  double overshoot_m = 2.0;

  void visit(FieldVisitor& f) {
    f.section("mode", mode, "When to be a Collector (paper, III-A).");
    f.section("explorer", explorer, "Cost of an Explorer's targets (paper, eq. 1 to 4).");
    f.section("collector", collector, "Cost of a Collector's targets (paper, eq. 5 to 7).");
    f.field("overshoot_m",
            overshoot_m,
            in_range(0.0, 20.0),
            "a cluster is flown to by a view at most so much further than its cheapest one");
    f.field("keep_target_bonus",
            keep_target_bonus,
            in_range(0.0, 100.0),
            "taken off the cost of the target so far, so that two equal ones do not alternate");
  }
};

// What the costs need to know of vehicle, team and box.
struct TravelRates {
  double collector_speed_mps = 1.5;
  double collector_acceleration_mps2 = 1.0;
  double yaw_rate_radps = 0.9;
  Box3d box_m{Vector3d::Constant(-10.0), Vector3d::Constant(10.0)};  // the vehicle's part of it
  team::CoordinationConfig team{};
};

class ExplorerCollector final : public Strategy {
 public:
  ExplorerCollector(const ExplorerCollectorConfig& config, const TravelRates& rates)
      : config_(config), rates_(rates) {}

  [[nodiscard]] std::optional<Target> choose(const StrategyInput& input) override;

  [[nodiscard]] FlightMode select_mode(const StrategyInput& input) const;
  [[nodiscard]] double explorer_cost(const StrategyInput& input, const Candidate& candidate) const;
  [[nodiscard]] double greedy_cost(const StrategyInput& input, const Candidate& candidate) const;
  [[nodiscard]] double collector_cost(const StrategyInput& input, const Candidate& candidate) const;

 private:
  [[nodiscard]] bool is_near_trail(const StrategyInput& input, const Candidate& candidate) const;
  [[nodiscard]] bool is_foreign(const Candidate& candidate) const;
  [[nodiscard]] double shared_cost(const StrategyInput& input,
                                   const Candidate& candidate,
                                   FlightMode mode) const;
  [[nodiscard]] double yaw_time_s(const StrategyInput& input, const Candidate& candidate) const;
  [[nodiscard]] double wait_time_s(const StrategyInput& input, const Candidate& candidate) const;
  [[nodiscard]] double wait_weight_for(const StrategyInput& input) const;
  [[nodiscard]] double path_time_s(const Candidate& candidate) const;
  [[nodiscard]] double ring_m(const Vector3d& position_m) const;
  [[nodiscard]] double momentum_time_s(const StrategyInput& input,
                                       const Vector3d& position_m) const;
  [[nodiscard]] double turn_angle(const StrategyInput& input, const Vector3d& position_m) const;
  [[nodiscard]] Candidate far_view_of(const StrategyInput& input, const Candidate& cheapest) const;
  [[nodiscard]] std::optional<Candidate> choose_among(const StrategyInput& input,
                                                      FlightMode mode) const;
  [[nodiscard]] std::optional<Candidate> choose_as_explorer(const StrategyInput& input) const;
  [[nodiscard]] std::optional<Candidate> choose_as_collector(const StrategyInput& input) const;

  ExplorerCollectorConfig config_;
  TravelRates rates_;
};

}  // namespace understory
