// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Planning problems made at random for tests and benchmarks: a forest, a place to start, a place to
// go, a route between them on a lattice, and states of motion from which the vehicle can stop.
#pragma once

#include <optional>
#include <vector>

#include "support/snapshot_builder.hpp"
#include "understory/plan/trajectory_planner.hpp"

namespace understory::test {

// Shortest on a 0.2 m lattice (26 neighbours) with this clearance at its points and halfway between
// them; from the exact start to the exact goal. Empty: none.
[[nodiscard]] std::vector<Vector3d> lattice_route(const ClearanceMap& map,
                                                  const Vector3d& start_m,
                                                  const Vector3d& goal_m,
                                                  double clearance_m);

// A point with this clearance, anywhere in the box.
[[nodiscard]] std::optional<Vector3d> random_free_point(const ClearanceMap& map,
                                                        double clearance_m,
                                                        Rng& rng);

struct PlanScene {
  MapSnapshotPtr snapshot;
  ClearanceMap map;
  PlanRequest request;  // from rest
};

// A dense forest (0.2 trunks per m2) with a route of at least `least_m` metres. None: this seed has
// no such route.
[[nodiscard]] std::optional<PlanScene> random_scene(Rng& rng, double least_m);

// Sets the request's start in motion, such that a straight full brake from there stays clear.
// False: found none.
[[nodiscard]] bool set_in_motion(PlanScene& scene, Rng& rng);

}  // namespace understory::test
