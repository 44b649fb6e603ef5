// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/plan/traffic.hpp"

#include <algorithm>

namespace understory {
namespace {

constexpr Duration kStep = std::chrono::milliseconds(50);
// Two vehicles that meet at full speed need so long to stand.
constexpr Duration kLastMoment = std::chrono::milliseconds(2500);
constexpr double kJitterM = 0.02;

// The first instant of `flown` from `from` on at which it is nearer to `mover` than `distance_m`.
std::optional<Time> first_meeting(const Trajectory& flown,
                                  Time from,
                                  const Mover& mover,
                                  double distance_m) {
  const Time end = std::max(flown.end(), mover.trajectory ? mover.trajectory->end() : from);
  const auto distance_at = [&](Time time) {
    return (flown.sample(time).position_m - mover.position_at(time)).norm();
  };
  const double least_m = std::min(distance_m + mover.extra_m, distance_at(from) - kJitterM);
  for (Time time = from; time <= end + kStep; time += kStep) {
    if (distance_at(time) < least_m) {
      return time;
    }
  }
  return std::nullopt;
}

}  // namespace

bool Traffic::blocks(const Trajectory& planned) const {
  return std::any_of(movers_.begin(), movers_.end(), [&](const Mover& mover) {
    const double distance_m =
        mover.is_at_rest(planned.start) ? distances_.rest_m : distances_.plan_m;
    return first_meeting(planned, planned.start, mover, distance_m).has_value();
  });
}

std::optional<Time> Traffic::must_give_way_at(const Trajectory& flown, Time now) const {
  std::optional<Time> first;
  for (const Mover& mover : movers_) {
    const double distance_m = mover.is_at_rest(now)
                                  ? std::min(distances_.rest_m, distances_.recheck_m) - kJitterM
                                  : distances_.recheck_m;
    const std::optional<Time> meeting =
        first_meeting(flown, std::max(now, flown.start), mover, distance_m);
    const bool is_ours =
        meeting && (mover.has_way || mover.is_at_rest(*meeting) || *meeting - now < kLastMoment);
    if (is_ours && (!first || *meeting < *first)) {
      first = meeting;
    }
  }
  return first;
}

bool Traffic::is_occupied(const Vector3d& position_m, Time now) const {
  return std::any_of(movers_.begin(), movers_.end(), [&](const Mover& mover) {
    return mover.is_at_rest(now) &&
           (mover.position_at(now) - position_m).norm() < distances_.rest_m + mover.extra_m;
  });
}

}  // namespace understory
