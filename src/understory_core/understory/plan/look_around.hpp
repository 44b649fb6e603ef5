// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Where the camera looks on the way: a yaw spline along a given path that ends as it must and takes
// in as much of what lies to its sides as the yaw limits allow, so that less of it has to be flown
// to later. Dynamic programming over time and directions, then a spline that holds the limits.
// World frame, SI units; pure function; one thread. Not in the paper; costs nothing in safety,
// since a sphere has no front.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "understory/base/config.hpp"
#include "understory/plan/clearance_map.hpp"
#include "understory/plan/trajectory.hpp"

namespace understory {

struct LookConfig {
  bool is_on = true;
  double max_range_m = 4.0;
  double half_field_rad = 0.6;
  double spare_s = 0.3;

  void visit(FieldVisitor& f) {
    f.field("is_on", is_on, "the camera looks to the sides on the way");
    f.field(
        "max_range_m", max_range_m, in_range(0.5, 50.0), "what is further away is not looked at");
    f.field("half_field_rad",
            half_field_rad,
            in_range(0.05, 1.5),
            "of the camera's view to either side, less a margin");
    f.field("spare_s",
            spare_s,
            in_range(0.0, 5.0),
            "so much before the end of the path the camera looks where it must");
  }
};

// Something worth seeing.
struct Sight {
  Vector3d at_m = Vector3d::Zero();
  double weight = 1.0;
};

// A sight that can be seen on the way.
struct SeenSight {
  struct Glimpse {
    std::size_t step = 0;
    double bearing_rad = 0.0;
  };
  double weight = 1.0;
  std::vector<Glimpse> from;  // by step
};

[[nodiscard]] std::vector<SeenSight> seen_on_the_way(const ClearanceMap& map,
                                                     const std::vector<Sight>& sights,
                                                     const Trajectory& flown,
                                                     const LookConfig& config);

// Where it flies to, as well as the yaw limits allow, and then to where its yaw ends: later, if
// need be.
[[nodiscard]] CubicBSpline<double> yaw_ahead(const Trajectory& flown);

// Nothing: there is nothing to see on the way, or no time for it. `config` may spare more time than
// the one by which the sights were seen.
[[nodiscard]] std::optional<CubicBSpline<double>> looking_yaw(const std::vector<SeenSight>& seen,
                                                              const Trajectory& flown,
                                                              const LookConfig& config);

}  // namespace understory
