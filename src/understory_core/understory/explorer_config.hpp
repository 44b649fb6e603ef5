// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// All that the onboard core can be set to, in one struct: what config/*.yaml and both hosts load.
// SI units; checked when it is loaded.
#pragma once

#include <string>

#include "understory/frontier/frontier_config.hpp"
#include "understory/map/mapper.hpp"
#include "understory/plan/trajectory_planner.hpp"
#include "understory/sense/camera_model.hpp"
#include "understory/strategy/explorer_collector.hpp"
#include "understory/strategy/fuel.hpp"
#include "understory/team/team_config.hpp"

namespace understory {

struct LimitsConfig {
  std::string speed_cap = "paper";
  double speed_mps = 1.5;
  double acceleration_mps2 = 1.0;
  double collector_factor = 2.0;
  double yaw_rate_radps = 0.9;
  double yaw_acceleration_radps2 = 3.0;

  void visit(FieldVisitor& f) {
    f.field("speed_cap",
            speed_cap,
            {"paper", "strict"},
            "paper: a Collector flies collector_factor times as fast; strict: nobody does");
    f.field("speed_mps", speed_mps, in_range(0.1, 20.0), "Explorer's speed limit");
    f.field("acceleration_mps2",
            acceleration_mps2,
            in_range(0.1, 20.0),
            "Explorer's acceleration limit");
    f.field("collector_factor",
            collector_factor,
            in_range(1.0, 4.0),
            "on speed and acceleration, with speed_cap: paper");
    f.field("yaw_rate_radps", yaw_rate_radps, in_range(0.05, 10.0), "yaw rate limit");
    f.field("yaw_acceleration_radps2",
            yaw_acceleration_radps2,
            in_range(0.1, 50.0),
            "yaw acceleration limit");
  }

  [[nodiscard]] Limits limits_for(FlightMode mode) const;
};

struct ReplanConfig {
  double lead_s = 0.1;
  double min_interval_s = 0.4;
  double max_interval_s = 1.5;
  double continue_before_end_s = 2.5;
  double near_route_m = 12.0;
  int max_attempts = 4;

  void visit(FieldVisitor& f) {
    f.field("lead_s",
            lead_s,
            in_range(0.01, 1.0),
            "a new trajectory begins this much ahead on the flown one");
    f.field("min_interval_s", min_interval_s, in_range(0.05, 5.0), "between two decisions");
    f.field("max_interval_s",
            max_interval_s,
            in_range(0.1, 20.0),
            "on the way to a target, a better one is looked for this often");
    f.field("continue_before_end_s",
            continue_before_end_s,
            in_range(0.2, 20.0),
            "a trajectory that covers only a piece of its route is continued this long before it "
            "ends");
    f.field("near_route_m",
            near_route_m,
            in_range(1.0, 1000.0),
            "targets are looked for within this route length first");
    f.field("max_attempts", max_attempts, in_range(1, 20), "targets tried in one decision");
  }
};

struct RetryConfig {
  double set_aside_s = 15.0;
  int max_tries = 3;
  double patience_s = 10.0;
  double dwell_s = 0.25;

  void visit(FieldVisitor& f) {
    f.field("set_aside_s",
            set_aside_s,
            in_range(0.1, 1000.0),
            "a target that could not be reached or seen is left alone for so long");
    f.field("max_tries", max_tries, in_range(1, 100), "after so many tries it is given up");
    f.field("patience_s",
            patience_s,
            in_range(0.5, 1000.0),
            "beyond twice the flight time, before a target counts as out of reach");
    f.field("dwell_s",
            dwell_s,
            in_range(0.0, 10.0),
            "looked at from a viewpoint for so long without effect, a target is set aside");
  }
};

struct ExplorerConfig {
  CameraConfig camera;
  MapConfig map;
  FrontierConfig frontier;
  PlanConfig plan;
  LimitsConfig limits;
  ReplanConfig replan;
  RetryConfig retry;
  std::string strategy = "explorer_collector";
  ExplorerCollectorConfig explorer_collector;
  FuelConfig fuel;
  team::TeamConfig team;

  void visit(FieldVisitor& f) {
    f.section("camera", camera, "The depth camera.");
    f.section("map", map, "The voxel map.");
    f.section("frontier", frontier, "Frontiers, clusters, viewpoints, trails.");
    f.section("plan", plan, "Routes and trajectories.");
    f.section("limits", limits, "What the vehicle may do.");
    f.section("replan", replan, "When decisions are made.");
    f.section("retry", retry, "Targets that do not work out.");
    f.field("strategy",
            strategy,
            {"explorer_collector", "paper", "fuel"},
            "how targets are chosen: paper is explorer_collector under the name that its settings "
            "as printed go by (config/strategies)");
    f.section("explorer_collector", explorer_collector, "The paper's strategy.");
    f.section("fuel", fuel, "The paper's baseline: the shortest tour over all clusters.");
    f.section("team", team, "Other vehicles that explore the same box.");
  }
};

}  // namespace understory
