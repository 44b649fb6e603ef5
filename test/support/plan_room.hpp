// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// A room of 12 m x 12 m x 2 m to plan in by hand, and what tests of planning look at in it. World
// frame, SI units.
#pragma once

#include <vector>

#include <gtest/gtest.h>

#include "support/snapshot_builder.hpp"
#include "support/trajectory_checks.hpp"

namespace understory::test {

inline SnapshotBuilder open_room() {
  SnapshotBuilder builder(0.1, Box3d(Vector3d(-6.0, -6.0, 0.0), Vector3d(6.0, 6.0, 2.0)));
  builder.fill(VoxelState::kFree);
  return builder;
}

// A wall from floor to ceiling across the room, from this x on.
inline SnapshotBuilder room_with_wall(double x_m) {
  SnapshotBuilder builder = open_room();
  builder.set_box({Vector3d(x_m, -6.0, 0.0), Vector3d(6.0, 6.0, 2.0)}, VoxelState::kOccupied);
  return builder;
}

// A wall across the room, 0.6 m thick, with a gap of this width around y = 0.
inline SnapshotBuilder room_with_gap(double gap_m) {
  SnapshotBuilder builder = open_room();
  builder.set_box({Vector3d(-0.3, 0.5 * gap_m, 0.0), Vector3d(0.3, 6.0, 2.0)},
                  VoxelState::kOccupied);
  builder.set_box({Vector3d(-0.3, -6.0, 0.0), Vector3d(0.3, -0.5 * gap_m, 2.0)},
                  VoxelState::kOccupied);
  return builder;
}

struct PlanRoom {
  explicit PlanRoom(SnapshotBuilder builder) : snapshot(builder.build()) { map.update(snapshot); }

  [[nodiscard]] Result<Trajectory, PlanError> plan(const PlanRequest& request) const {
    return TrajectoryPlanner(config).plan(map, request);
  }
  [[nodiscard]] Result<Trajectory, PlanError> brake(const Trajectory& flown, Time from) const {
    return TrajectoryPlanner(config).plan_brake(map, flown, from);
  }

  PlanConfig config;
  MapSnapshotPtr snapshot;
  ClearanceMap map;
};

inline PlanRequest request_along(const std::vector<Vector3d>& route_m) {
  PlanRequest request;
  request.start.position_m = route_m.front();
  request.start_time = Time(Duration(12345678));
  request.route_m = route_m;
  return request;
}

inline void expect_flyable(const PlanRoom& scene,
                           const PlanRequest& request,
                           const Result<Trajectory, PlanError>& planned) {
  ASSERT_TRUE(planned.has_value()) << to_string(planned.error());
  EXPECT_EQ(fault_in(*planned, *scene.snapshot, requirements_of(request, scene.config)), "");
}

inline Vector3d end_of(const Trajectory& trajectory) {
  return trajectory.sample(trajectory.end()).position_m;
}

}  // namespace understory::test
