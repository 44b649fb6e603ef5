// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/plan/traffic.hpp"

#include <algorithm>
#include <cmath>

namespace understory {
namespace {

constexpr Duration kStep = std::chrono::milliseconds(50);
// Two vehicles that meet at full speed need so long to stand.
constexpr Duration kLastMoment = std::chrono::milliseconds(2500);
constexpr double kJitterM = 0.02;
constexpr double kDetourM = 0.2;  // further away: trajectories cut the corners of their routes

// Where who flies this is from `from` on, step by step, until it rests.
struct Path {
  Path(const Trajectory& flown, Time begin) : from(begin) {
    for (Time time = from; time <= flown.end() + kStep; time += kStep) {
      positions_m.push_back(flown.sample(time).position_m);
    }
    if (positions_m.empty()) {
      positions_m.push_back(flown.sample(from).position_m);
    }
  }

  [[nodiscard]] const Vector3d& at(std::size_t step) const {
    return positions_m[std::min(step, positions_m.size() - 1)];
  }
  [[nodiscard]] std::size_t steps_until(Time end) const {
    return end <= from ? 0 : static_cast<std::size_t>((end - from) / kStep) + 1;
  }

  Time from;
  std::vector<Vector3d> positions_m;
};

// The first instant at which who flies along the path is nearer to `mover` than `distance_m`.
std::optional<Time> first_meeting(const Path& path, const Mover& mover, double distance_m) {
  const std::size_t steps =
      std::max(path.positions_m.size(),
               mover.trajectory ? path.steps_until(mover.trajectory->end() + kStep) : 0);
  double least_m = distance_m + mover.extra_m;
  for (std::size_t step = 0; step < steps; ++step) {
    const Time time = path.from + static_cast<int>(step) * kStep;
    const double apart_m = mover.distance_m(path.at(step), time);
    if (step == 0) {
      least_m = std::min(least_m, apart_m - kJitterM);
    } else if (apart_m < least_m) {
      return time;
    }
  }
  return std::nullopt;
}

}  // namespace

double Mover::distance_m(const Vector3d& from_m, Time time) const {
  double squared = (from_m - position_at(time)).squaredNorm();
  for (const Vector3d& place_m : other_places_m) {
    squared = std::min(squared, (from_m - place_m).squaredNorm());
  }
  return std::sqrt(squared);
}

Obstruction Traffic::obstruction_of(const Trajectory& planned) const {
  if (movers_.empty()) {
    return Obstruction::kNone;
  }
  const Path path(planned, planned.start);
  Obstruction found = Obstruction::kNone;
  for (const Mover& mover : movers_) {
    const bool is_standing = mover.is_at_rest(planned.start);
    const double distance_m = is_standing ? distances_.rest_m : distances_.plan_m;
    if (first_meeting(path, mover, distance_m)) {
      if (is_standing) {
        return Obstruction::kStanding;
      }
      found = Obstruction::kPassing;
    }
  }
  return found;
}

Barriers Traffic::barriers(const Vector3d& from_m, Time time) const {
  Barriers found;
  const auto add = [&](const Mover& mover, const Vector3d& place_m) {
    const double wanted_m = distances_.rest_m + mover.extra_m + kDetourM;
    const double radius_m = std::min(wanted_m, (from_m - place_m).norm() - kJitterM);
    if (radius_m > 0.0) {
      found.push_back({place_m, radius_m});
    }
  };
  for (const Mover& mover : movers_) {
    if (mover.is_at_rest(time)) {
      add(mover, mover.position_at(time));
      for (const Vector3d& place_m : mover.other_places_m) {
        add(mover, place_m);
      }
    }
  }
  return found;
}

std::optional<Time> Traffic::must_give_way_at(const Trajectory& flown, Time now) const {
  std::optional<Time> first;
  if (movers_.empty()) {
    return first;
  }
  const Path path(flown, std::max(now, flown.start));
  for (const Mover& mover : movers_) {
    const double distance_m = mover.is_at_rest(now)
                                  ? std::min(distances_.rest_m, distances_.recheck_m) - kJitterM
                                  : distances_.recheck_m;
    const std::optional<Time> meeting = first_meeting(path, mover, distance_m);
    const bool is_ours =
        meeting && (mover.has_way || mover.is_at_rest(*meeting) || *meeting - now < kLastMoment);
    if (is_ours && (!first || *meeting < *first)) {
      first = meeting;
    }
  }
  return first;
}

}  // namespace understory
