// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/plan/look_around.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include "understory/plan/control_point_chain.hpp"
#include "understory/plan/line_of_sight.hpp"

namespace understory {
namespace {

constexpr int kDirections = 24;
constexpr double kDirectionRad = 2.0 * kPi / kDirections;
constexpr double kRateShare = 0.9;  // the rest is for gaining and losing it
// Of what a step shows on average at best, so that the camera does not turn for nothing.
constexpr double kTurnCost = 0.01;
constexpr std::size_t kLeastSteps = 3;
constexpr double kNever = -std::numeric_limits<double>::infinity();

// One number for each direction.
using ByDirection = std::array<double, kDirections>;

std::size_t index_of(int direction) {
  return static_cast<std::size_t>((direction % kDirections + kDirections) % kDirections);
}

std::size_t direction_of(double yaw_rad) {
  return index_of(static_cast<int>(std::lround(wrap_angle(yaw_rad) / kDirectionRad)));
}

double yaw_of_direction(std::size_t direction) {
  return static_cast<double>(direction) * kDirectionRad;
}

double step_s_of(const Trajectory& flown) {
  return kDirectionRad / (kRateShare * flown.limits.yaw_rate_radps);
}

std::size_t steps_of(const Trajectory& flown, const LookConfig& config) {
  const double time_s = std::max(0.0, flown.position.duration_s() - config.spare_s);
  return static_cast<std::size_t>(time_s / step_s_of(flown)) + 1;
}

// In the first so many steps.
void add_sight(const SeenSight& seen, const LookConfig& config, std::vector<ByDirection>& shown) {
  const auto end = std::find_if(seen.from.begin(), seen.from.end(), [&](const auto& glimpse) {
    return glimpse.step >= shown.size();
  });
  const auto often = static_cast<double>(end - seen.from.begin());
  for (auto glimpse = seen.from.begin(); glimpse != end; ++glimpse) {
    for (std::size_t direction = 0; direction < kDirections; ++direction) {
      const double aside_rad = angle_difference(yaw_of_direction(direction), glimpse->bearing_rad);
      if (std::abs(aside_rad) <= config.half_field_rad) {
        // Once is enough, whenever that is.
        shown[glimpse->step][direction] += seen.weight / often;
      }
    }
  }
}

double most_shown(const std::vector<ByDirection>& shown) {
  double most = 0.0;
  for (const ByDirection& at : shown) {
    most += *std::max_element(at.begin(), at.end());
  }
  return most;
}

// The directions of all steps, from the first to the last one given, that show most; empty if
// nothing is shown, or the last direction cannot be reached in time.
std::vector<std::size_t> best_directions(const std::vector<ByDirection>& shown,
                                         std::size_t first,
                                         std::size_t last) {
  const double most = most_shown(shown);
  const double turn_cost = kTurnCost * most / static_cast<double>(shown.size());
  std::vector<std::array<std::int8_t, kDirections>> turned(shown.size());
  ByDirection gain{};
  gain.fill(kNever);
  gain[first] = 0.0;
  for (std::size_t step = 1; step < shown.size(); ++step) {
    ByDirection next{};
    for (std::size_t direction = 0; direction < kDirections; ++direction) {
      double best = kNever;
      for (const int turn : {0, -1, 1}) {
        const double so_far =
            gain[index_of(static_cast<int>(direction) - turn)] - (turn == 0 ? 0.0 : turn_cost);
        if (so_far > best) {
          best = so_far;
          turned[step][direction] = static_cast<std::int8_t>(turn);
        }
      }
      next[direction] = best + shown[step][direction];
    }
    gain = next;
  }
  if (most <= 0.0 || gain[last] == kNever) {
    return {};
  }
  std::vector<std::size_t> directions(shown.size(), last);
  for (std::size_t step = shown.size() - 1; step > 0; --step) {
    const std::size_t at = directions[step];
    directions[step - 1] = index_of(static_cast<int>(at) - turned[step][at]);
  }
  return directions;
}

}  // namespace

std::vector<SeenSight> seen_on_the_way(const ClearanceMap& map,
                                       const std::vector<Sight>& sights,
                                       const Trajectory& flown,
                                       const LookConfig& config) {
  const std::size_t steps = steps_of(flown, config);
  if (sights.empty() || steps < kLeastSteps) {
    return {};
  }
  std::vector<Vector3d> path_m;
  path_m.reserve(steps);
  for (std::size_t step = 0; step < steps; ++step) {
    const double time_s = static_cast<double>(step) * step_s_of(flown);
    path_m.push_back(flown.position.sample(time_s).value);
  }
  std::vector<SeenSight> all;
  for (const Sight& sight : sights) {
    SeenSight seen{sight.weight, {}};
    for (std::size_t step = 0; step < steps; ++step) {
      const Vector3d line_m = sight.at_m - path_m[step];
      if (line_m.norm() <= config.max_range_m && line_is_free(map, path_m[step], sight.at_m)) {
        seen.from.push_back({step, std::atan2(line_m.y(), line_m.x())});
      }
    }
    if (!seen.from.empty()) {
      all.push_back(std::move(seen));
    }
  }
  return all;
}

CubicBSpline<double> yaw_ahead(const Trajectory& flown) {
  constexpr double kStanding_mps = 0.1;
  constexpr double kLast_m = 0.8;  // has been looked at by then
  const CubicBSpline<double>::Sample begin = flown.yaw.sample(0.0);
  const Vector3d& end_m = flown.position.control_points.back();
  YawCourse course{{begin.value}};
  const auto steps = static_cast<int>(flown.position.duration_s() / course.step_s);
  for (int step = 1; step <= steps; ++step) {
    const CubicBSpline<Vector3d>::Sample there = flown.position.sample(step * course.step_s);
    if ((there.value - end_m).norm() < kLast_m) {
      break;
    }
    const double before_rad = course.yaw_rad.back();
    const double heading_rad = there.first.head<2>().norm() > kStanding_mps
                                   ? std::atan2(there.first.y(), there.first.x())
                                   : before_rad;
    course.yaw_rad.push_back(before_rad + angle_difference(heading_rad, before_rad));
  }
  return yaw_spline_along(begin, course, flown.yaw.control_points.back(), flown.limits);
}

std::optional<CubicBSpline<double>> looking_yaw(const std::vector<SeenSight>& seen,
                                                const Trajectory& flown,
                                                const LookConfig& config) {
  const std::size_t steps = steps_of(flown, config);
  if (seen.empty() || steps < kLeastSteps) {
    return std::nullopt;
  }
  std::vector<ByDirection> shown(steps, ByDirection{});
  for (const SeenSight& sight : seen) {
    add_sight(sight, config, shown);
  }
  const CubicBSpline<double>::Sample begin = flown.yaw.sample(0.0);
  const double end_rad = flown.yaw.control_points.back();
  const std::vector<std::size_t> directions =
      best_directions(shown, direction_of(begin.value), direction_of(end_rad));
  if (directions.empty()) {
    return std::nullopt;
  }
  YawCourse course{{begin.value}, step_s_of(flown)};
  for (std::size_t step = 1; step < steps; ++step) {
    const double before_rad = course.yaw_rad.back();
    course.yaw_rad.push_back(before_rad +
                             angle_difference(yaw_of_direction(directions[step]), before_rad));
  }
  return yaw_spline_along(begin, course, end_rad, flown.limits);
}

}  // namespace understory
