// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What every trajectory has to keep, looked at independently of the planner: each voxel near each
// sample (100 Hz), each limit, the beginning and the end. World frame, SI units; pure.
#pragma once

#include <string>
#include <vector>

#include "understory/map/map_snapshot.hpp"
#include "understory/plan/trajectory_planner.hpp"

namespace understory::test {

struct TrajectoryRequirements {
  TrajectoryPoint start;
  Time start_time{};
  Limits limits;
  double radius_m = 0.28;  // of the ball that may touch nothing that is not known free
};

[[nodiscard]] TrajectoryRequirements requirements_of(const PlanRequest& request,
                                                     const PlanConfig& config);
// Of a brake that begins at `from` on the flown trajectory.
[[nodiscard]] TrajectoryRequirements brake_requirements(const Trajectory& flown,
                                                        Time from,
                                                        const PlanConfig& config);

// What is wrong with it, in words; empty: nothing. A start that is faster than the limits raises
// them for the whole trajectory, nothing else does.
[[nodiscard]] std::string fault_in(const Trajectory& trajectory,
                                   const MapSnapshot& map,
                                   const TrajectoryRequirements& required);

// A constant velocity from here for so long, yaw 0, and no end at rest. For tests of the
// checks themselves and of what reacts to them.
[[nodiscard]] Trajectory straight_trajectory(const Vector3d& from_m,
                                             const Vector3d& velocity_mps,
                                             double duration_s);

}  // namespace understory::test
