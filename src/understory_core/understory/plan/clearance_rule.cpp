// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/plan/clearance_rule.hpp"

#include <algorithm>

namespace understory {
namespace {

constexpr Duration kSamplePeriod{10000};  // 100 Hz
constexpr double kTightening_m = 0.01;    // below the start's clearance
constexpr double kOverRadius_m = 0.01;

// The largest radius of a free ball around the point, at most limit_m, to a tenth of a millimetre
// from below.
double clearance_m(const ClearanceMap& map, const Vector3d& point_m, double limit_m) {
  constexpr double kResolution_m = 1e-4;
  double low = 0.0;
  double high = limit_m;
  while (high - low > kResolution_m) {
    const double middle = 0.5 * (low + high);
    (map.clearance_at_least(point_m, middle) ? low : high) = middle;
  }
  return low;
}

// A ball that is known to have room for the required one anywhere within `distance_m` of here.
class FreeNeighbourhood {
 public:
  [[nodiscard]] bool covers(const Vector3d& point_m, double radius_m) const {
    return (point_m - center_m_).norm() + radius_m < distance_m_;
  }
  void move_to(const Vector3d& center_m, double distance_m) {
    center_m_ = center_m;
    distance_m_ = distance_m;
  }

 private:
  Vector3d center_m_ = Vector3d::Zero();
  double distance_m_ = 0.0;
};

bool has_room(const ClearanceMap& map,
              const Vector3d& point_m,
              double radius_m,
              FreeNeighbourhood& known) {
  if (known.covers(point_m, radius_m)) {
    return true;
  }
  known.move_to(point_m, map.distance_lower_bound_m(point_m));
  return known.covers(point_m, radius_m) || map.clearance_at_least(point_m, radius_m);
}

}  // namespace

std::optional<ClearanceRule> clearance_rule_from(const ClearanceMap& map,
                                                 const Vector3d& start_m,
                                                 double vehicle_radius_m,
                                                 double hard_m) {
  if (map.clearance_at_least(start_m, hard_m)) {
    return ClearanceRule{hard_m, hard_m};
  }
  const double here_m = clearance_m(map, start_m, hard_m);
  if (here_m <= 0.0) {
    return std::nullopt;
  }
  const double comfortable_m = vehicle_radius_m + kOverRadius_m;
  const double escape_m =
      here_m < comfortable_m ? here_m : std::max(comfortable_m, here_m - kTightening_m);
  return ClearanceRule{hard_m, std::min(hard_m, escape_m)};
}

std::optional<Time> first_unsafe_time(const ClearanceMap& map,
                                      const Trajectory& trajectory,
                                      Time from,
                                      const ClearanceRule& rule) {
  const double first_s = std::max(0.0, to_seconds(from - trajectory.start));
  const double last_s = trajectory.position.duration_s();
  FreeNeighbourhood known;
  double flown_m = 0.0;
  Vector3d previous_m = trajectory.position.sample(first_s).value;
  for (Duration elapsed{0};; elapsed += kSamplePeriod) {
    const double time_s = first_s + to_seconds(elapsed);
    const Vector3d point_m = trajectory.position.sample(time_s).value;
    flown_m += (point_m - previous_m).norm();
    previous_m = point_m;
    if (!has_room(map, point_m, rule.required_m(flown_m), known)) {
      return std::max(from, trajectory.start) + elapsed;
    }
    // The sample at or after the end has been looked at: from there on it rests.
    if (time_s >= last_s) {
      return std::nullopt;
    }
  }
}

bool leg_is_clear(const ClearanceMap& map,
                  const Vector3d& from_m,
                  const Vector3d& to_m,
                  const ClearanceRule& rule,
                  double flown_m) {
  constexpr double kStep_m = 0.04;
  const double length_m = (to_m - from_m).norm();
  const int steps = static_cast<int>(length_m / kStep_m) + 1;
  FreeNeighbourhood known;
  for (int i = 0; i <= steps; ++i) {
    const double share = static_cast<double>(i) / steps;
    const Vector3d point_m = from_m + share * (to_m - from_m);
    if (!has_room(map, point_m, rule.required_m(flown_m + share * length_m), known)) {
      return false;
    }
  }
  return true;
}

}  // namespace understory
