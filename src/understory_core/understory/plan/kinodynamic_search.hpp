// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// How a vehicle in motion gets onto its route: best-first search over short pieces of constant
// acceleration in known free space (Zhou et al. 2019, section III, with the route instead of an
// obstacle-blind heuristic), from there on along the route at its speeds. What comes back is a
// first guess for the optimiser: free of collisions as far as the search went, within the limits
// there. SI units, world frame; deterministic, bounded; pure.
#pragma once

#include <vector>

#include "understory/plan/route_guide.hpp"

namespace understory {

struct SearchStart {
  Vector3d position_m;
  Vector3d velocity_mps;
};

// A motion as positions at equal intervals from the start's instant on; ends at the guide's end.
struct SampledMotion {
  double interval_s;
  std::vector<Vector3d> positions_m;

  [[nodiscard]] double duration_s() const {
    return interval_s * static_cast<double>(positions_m.size() - 1);
  }
  [[nodiscard]] Vector3d at(double time_s) const;
};

[[nodiscard]] SampledMotion motion_along(const ClearanceMap& map,
                                         const RouteGuide& guide,
                                         const SearchStart& start,
                                         const Limits& limits,
                                         const ClearanceRule& rule);

}  // namespace understory
