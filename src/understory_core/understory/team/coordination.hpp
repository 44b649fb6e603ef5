// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// How the work is shared: what team mates add to the cost of a target (paper, III-C, J_F, with the
// settlements of docs/paper_notes.md), whose part of the box is whose, and what of the others is
// traffic. World frame, SI units. Values; deterministic; nothing can fail.
#pragma once

#include "understory/plan/traffic.hpp"
#include "understory/team/peer.hpp"
#include "understory/team/team_config.hpp"

namespace understory::team {

// J_rep of two places: continuous at d_c, zero from d_0 on.
[[nodiscard]] double repulsion(const CoordinationConfig& config, double distance_m);
// J_att of a place and a team mate: nothing until near the edge of the radio's range.
[[nodiscard]] double attraction(const CoordinationConfig& config, double distance_m);
// I(i, k): an Explorer leads and does not care where a Collector is.
[[nodiscard]] bool is_attracted(FlightMode own, FlightMode other);

struct Errand {
  Vector3d position_m = Vector3d::Zero();  // of the view
  double route_length_m = 0.0;
  FlightMode mode = FlightMode::kExplorer;  // of who asks
};

// w_F J_F at the candidate, and the claims of those who are nearer to it. Who is out of contact has
// no say: its work is anyone's.
[[nodiscard]] double team_cost(const CoordinationConfig& config,
                               const Errand& errand,
                               const Peers& peers);

// The part of the box where a vehicle begins: the box is halved along its longer side, and so are
// the halves, as often as there are vehicles.
[[nodiscard]] Box3d region_of(const TeamConfig& config, const Box3d& box_m);

// `seen`: who is known by sight alone.
[[nodiscard]] Traffic traffic_of(const TeamConfig& config,
                                 const Peers& peers,
                                 std::vector<Mover> seen,
                                 Time now);

}  // namespace understory::team
