// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// How much room a trajectory must keep. Everywhere the hard clearance, except when the vehicle
// finds itself closer than that already (the map changed, or it was pushed): then the first stretch
// may be as tight as the start, so that there is a way out, and may not become tighter. Metres,
// world frame; pure.
#pragma once

#include <optional>

#include "understory/plan/clearance_map.hpp"
#include "understory/plan/trajectory.hpp"

namespace understory {

struct ClearanceRule {
  static constexpr double kEscapeLength_m = 0.6;

  double hard_m;
  double escape_m;  // within kEscapeLength_m of the start, along the path; at most hard_m

  [[nodiscard]] double required_m(double flown_m) const {
    return flown_m < kEscapeLength_m ? escape_m : hard_m;
  }
  [[nodiscard]] bool start_is_tight() const { return escape_m < hard_m; }
};

// None: the start touches a voxel that is not free, no rule can hold.
[[nodiscard]] std::optional<ClearanceRule> clearance_rule_from(const ClearanceMap& map,
                                                               const Vector3d& start_m,
                                                               double vehicle_radius_m,
                                                               double hard_m);

// As the function of that name in trajectory_planner.hpp, with path length counted from `from`.
[[nodiscard]] std::optional<Time> first_unsafe_time(const ClearanceMap& map,
                                                    const Trajectory& trajectory,
                                                    Time from,
                                                    const ClearanceRule& rule);

// Along the straight leg between two points, `flown_m` after the start.
[[nodiscard]] bool leg_is_clear(const ClearanceMap& map,
                                const Vector3d& from_m,
                                const Vector3d& to_m,
                                const ClearanceRule& rule,
                                double flown_m);

}  // namespace understory
