// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Out of a pocket. The route search looks only at nodes that lie two voxels apart; a vehicle may
// have passed between two of them, by a trajectory, into a place that no route leads out of. Over
// all voxels nearby there may be one. World frame, metres. Deterministic, one thread; takes some
// milliseconds, for those rare cases.
#pragma once

#include <vector>

#include "understory/plan/clearance_map.hpp"
#include "understory/plan/route_search.hpp"

namespace understory {

// From `start_m` to the nearest node of the routes' lattice that lies 4 m away, with this clearance
// all the way, around what the routes avoid. Empty: there is no such way, or `routes`, which this
// runs, have one of their own.
[[nodiscard]] std::vector<Vector3d> way_out(const ClearanceMap& map,
                                            RouteSearch& routes,
                                            double clearance_m,
                                            const Vector3d& start_m);

}  // namespace understory
