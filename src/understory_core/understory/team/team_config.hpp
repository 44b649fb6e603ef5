// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What a vehicle knows of its team beforehand, and how it works with it. SI units. With a size of 1
// there is no team, and nothing of this has any effect.
#pragma once

#include "understory/base/config.hpp"

namespace understory::team {

struct ExchangeConfig {
  double state_rate_hz = 5.0;
  double tile_settle_s = 2.0;
  double tile_max_wait_s = 10.0;
  double tile_rate_bytes_per_s = 8000.0;
  double contact_timeout_s = 2.0;
  double max_clock_offset_s = 0.2;

  void visit(FieldVisitor& f) {
    f.field("state_rate_hz", state_rate_hz, in_range(0.5, 50.0), "pose, target and mode are sent");
    f.field("tile_settle_s",
            tile_settle_s,
            in_range(0.0, 60.0),
            "a block of tiles is sent once it has not changed for so long");
    f.field("tile_max_wait_s",
            tile_max_wait_s,
            in_range(0.1, 600.0),
            "or once it has waited for so long");
    f.field("tile_rate_bytes_per_s",
            tile_rate_bytes_per_s,
            in_range(100.0, 1e9),
            "no more of the map than this is sent");
    f.field("contact_timeout_s",
            contact_timeout_s,
            in_range(0.2, 60.0),
            "a team mate that is silent for so long is out of contact");
    f.field("max_clock_offset_s",
            max_clock_offset_s,
            in_range(0.001, 10.0),
            "a team mate whose clock is further off is not believed");
  }
};

struct CoordinationConfig {
  double weight = 1.0;
  double attraction = 1.0;
  double range_m = 50.0;
  double repulsion = 1.0;
  double inner_radius_m = 2.0;
  double outer_radius_m = 5.0;
  bool own_region = true;
  double foreign_cost_m = 100.0;
  double meeting_wait_s = 60.0;
  bool split_map = false;
  double claim_weight = 0.0;

  void visit(FieldVisitor& f) {
    f.field("weight", weight, in_range(0.0, 1000.0), "w_F");
    f.field("attraction", attraction, in_range(0.0, 1000.0), "k_A");
    f.field("range_m", range_m, in_range(1.0, 1e5), "of the radio; attraction binds near its edge");
    f.field("repulsion", repulsion, in_range(0.0, 1000.0), "k_R");
    f.field("inner_radius_m",
            inner_radius_m,
            in_range(0.1, 100.0),
            "d_c: nearer than this repulsion grows steeply");
    f.field("outer_radius_m",
            outer_radius_m,
            in_range(0.2, 1000.0),
            "d_0: from here on there is none; greater than d_c");
    f.field("own_region",
            own_region,
            "the box is divided among the vehicles, and each begins in its part; not in the paper");
    f.field(
        "foreign_cost_m",
        foreign_cost_m,
        in_range(0.0, 1e4),
        "its own part is finished first, unless what is left of it is so much further away; not "
        "in the paper");
    f.field(
        "meeting_wait_s",
        meeting_wait_s,
        in_range(0.0, 3600.0),
        "who has finished its own part waits at home for so long for team mates that are out of "
        "range; 0: never; not in the paper");
    f.field("split_map", split_map, "and never leaves it, as with a map split beforehand");
    f.field("claim_weight",
            claim_weight,
            in_range(0.0, 1000.0),
            "per metre that a team mate is nearer to a target; not in the paper");
  }
};

struct SeparationConfig {
  double safety_distance_m = 0.8;
  double plan_distance_m = 1.6;
  double silent_growth_mps = 0.1;
  double silent_max_m = 3.0;
  double mask_radius_m = 0.6;
  bool lookout = true;

  void visit(FieldVisitor& f) {
    f.field("safety_distance_m",
            safety_distance_m,
            in_range(0.2, 20.0),
            "between the centres of two vehicles: never less");
    f.field("plan_distance_m",
            plan_distance_m,
            in_range(0.2, 50.0),
            "a trajectory is made so that it stays this far from those of others");
    f.field("silent_growth_mps",
            silent_growth_mps,
            in_range(0.0, 5.0),
            "what is added to that for a silent team mate's last known place, per second");
    f.field("silent_max_m", silent_max_m, in_range(0.2, 100.0), "up to this distance");
    f.field("mask_radius_m",
            mask_radius_m,
            in_range(0.1, 5.0),
            "depth within this distance of a team mate is not mapped");
    f.field("lookout",
            lookout,
            "for team mates that are not heard: by camera, and no faster than two that meet can "
            "stop where one may be near");
  }
};

struct TeamConfig {
  int size = 1;
  int id = 0;
  ExchangeConfig exchange;
  CoordinationConfig coordination;
  SeparationConfig separation;

  void visit(FieldVisitor& f) {
    f.field("size", size, in_range(1, 32), "vehicles of the team; 1: there is no team");
    f.field("id", id, in_range(0, 31), "of this vehicle, 0 .. size - 1");
    f.section("exchange", exchange, "What is told to team mates, and how often.");
    f.section("coordination", coordination, "How targets are shared (paper, III-C).");
    f.section("separation", separation, "How vehicles stay clear of each other.");
  }
};

}  // namespace understory::team
