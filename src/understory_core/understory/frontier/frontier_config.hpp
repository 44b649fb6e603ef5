// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Settings of frontiers, viewpoints and trail labels. SI units; checked when they are loaded.
#pragma once

#include "understory/base/config.hpp"

namespace understory {

struct ViewpointConfig {
  double min_radius_m = 1.0;
  double max_radius_m = 2.5;
  double radius_step_m = 0.5;
  double angle_step_rad = 0.261799;  // 15 deg
  double unknown_distance_m = 0.2;
  double min_coverage = 0.15;
  int max_kept = 10;

  void visit(FieldVisitor& f) {
    f.field("min_radius_m", min_radius_m, in_range(0.2, 50.0), "innermost ring around a cluster");
    f.field("max_radius_m", max_radius_m, in_range(0.2, 50.0), "outermost ring");
    f.field("radius_step_m", radius_step_m, in_range(0.05, 10.0), "between rings");
    f.field("angle_step_rad", angle_step_rad, in_range(0.05, 1.6), "between viewpoints on a ring");
    f.field("unknown_distance_m",
            unknown_distance_m,
            in_range(0.0, 2.0),
            "a viewpoint keeps this distance to unknown space");
    f.field("min_coverage",
            min_coverage,
            in_range(0.01, 1.0),
            "share of a cluster that a viewpoint has to see");
    f.field("max_kept", max_kept, in_range(1, 100), "viewpoints kept per cluster, best first");
  }
};

struct TrailConfig {
  double ring_m = 0.5;
  double max_unknown_share = 0.05;
  double neighbour_distance_m = 0.5;
  double max_component_m3 = 2.0;
  bool one_neighbour_is_trail = true;

  void visit(FieldVisitor& f) {
    f.field("ring_m", ring_m, in_range(0.05, 5.0), "width of the ring around a cluster's hull");
    f.field("max_unknown_share",
            max_unknown_share,
            in_range(0.0, 1.0),
            "surrounded by free space up to this share of unknown voxels in the ring");
    f.field("neighbour_distance_m",
            neighbour_distance_m,
            in_range(0.05, 5.0),
            "clusters nearer than this are neighbours");
    f.field("max_component_m3",
            max_component_m3,
            in_range(0.01, 1000.0),
            "unknown space that a cluster borders counts as its own small island up to here");
    f.field("one_neighbour_is_trail",
            one_neighbour_is_trail,
            "a cluster with exactly one neighbour is a trail whatever it borders (the paper)");
  }
};

struct FrontierConfig {
  double max_cluster_length_m = 2.0;
  int min_cluster_voxels = 40;
  double min_island_m3 = 0.0;
  double max_island_m3 = 0.0;
  double max_left_share = 0.0;
  double trunk_in_island_m3 = 0.0;
  double max_island_share = 1.0;
  double seen_share = 0.2;
  ViewpointConfig viewpoints;
  TrailConfig trails;

  void visit(FieldVisitor& f) {
    f.field("max_cluster_length_m",
            max_cluster_length_m,
            in_range(0.2, 50.0),
            "longer clusters are split along their principal xy axis");
    f.field("min_cluster_voxels",
            min_cluster_voxels,
            in_range(1, 100000),
            "smaller clusters are no targets");
    f.field("min_island_m3",
            min_island_m3,
            in_range(0.0, 1000.0),
            "nor are clusters that border an island of unknown space smaller than this (a trunk's "
            "inside counts)");
    f.field("max_island_m3",
            max_island_m3,
            in_range(0.0, 1000.0),
            "nor, the smallest first, islands up to this size, until so many are left:");
    f.field("max_left_share",
            max_left_share,
            in_range(0.0, 1.0),
            "the islands that are left are at most this part of the known volume, each counted for "
            "every cluster at it, unless those below min_island_m3 are more");
    f.field("trunk_in_island_m3",
            trunk_in_island_m3,
            in_range(0.0, 100.0),
            "so much of each island does not count there: the inside of a trunk is never seen");
    f.field("max_island_share",
            max_island_share,
            in_range(0.0, 1.0),
            "no island of a larger part of the box than this is left");
    f.field("seen_share",
            seen_share,
            in_range(0.01, 1.0),
            "a cluster counts as seen when this share of its voxels is no longer frontier");
    f.section("viewpoints", viewpoints, "Where clusters are looked at from.");
    f.section("trails", trails, "When a cluster is a trail (paper, III-A).");
  }
};

}  // namespace understory
