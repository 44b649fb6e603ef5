// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What else flies: spheres on trajectories that others have told of, or at the last place they were
// seen. World frame, SI units. A value; one thread; cannot fail. Distances are between centres.
#pragma once

#include <optional>
#include <vector>

#include "understory/plan/barrier.hpp"
#include "understory/plan/trajectory.hpp"

namespace understory {

struct Mover {
  TrajectoryPtr trajectory;  // null: it stays where it is
  Vector3d position_m = Vector3d::Zero();
  std::vector<Vector3d> other_places_m;  // where it may be as well, if it stays
  double extra_m = 0.0;                  // its place is known no better than this
  bool has_way = false;                  // who meets it gives way

  [[nodiscard]] Vector3d position_at(Time time) const {
    return trajectory ? trajectory->sample(time).position_m : position_m;
  }
  // From the nearest place where it may be.
  [[nodiscard]] double distance_m(const Vector3d& from_m, Time time) const;
  [[nodiscard]] bool is_at_rest(Time time) const {
    return trajectory == nullptr || time >= trajectory->end();
  }
};

struct TrafficDistances {
  double plan_m = 1.6;     // kept by what is planned
  double recheck_m = 1.2;  // what is flown gives way below this
  double rest_m = 0.9;     // kept from who stands still: it comes no nearer by itself
};

enum class Obstruction { kNone, kPassing, kStanding };

class Traffic {
 public:
  Traffic() = default;
  Traffic(std::vector<Mover> movers, const TrafficDistances& distances)
      : movers_(std::move(movers)), distances_(distances) {}

  // Whom does this trajectory, flown from its start to its end and rested on, come too near to?
  // Who is too near already may leave, but come no nearer.
  [[nodiscard]] Obstruction obstruction_of(const Trajectory& planned) const;
  // Where routes from here do not lead: around who stands still then. Smaller where it is from
  // there.
  [[nodiscard]] Barriers barriers(const Vector3d& from_m, Time time) const;
  // When who flies this from `now` on must have given way: to who has way, to who stands still,
  // and to everyone when there is no time left to wait for the other.
  [[nodiscard]] std::optional<Time> must_give_way_at(const Trajectory& flown, Time now) const;

 private:
  std::vector<Mover> movers_;
  TrafficDistances distances_;
};

}  // namespace understory
