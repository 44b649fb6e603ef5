// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What must hold for every trajectory in any forest, from any state of motion, under the limits of
// either mode: random scenes, looked at voxel by voxel. Seeds are printed on failure.
#include <ostream>
#include <string>

#include <gtest/gtest.h>

#include "support/map_checks.hpp"
#include "support/plan_scene.hpp"
#include "support/trajectory_checks.hpp"
#include "understory/explorer_config.hpp"

namespace understory {
namespace {

using test::brake_requirements;
using test::fault_in;
using test::PlanScene;
using test::requirements_of;

constexpr double kLeastRoute_m = 3.0;

struct Share {
  int tried = 0;
  int succeeded = 0;

  void count(bool success) {
    ++tried;
    succeeded += success ? 1 : 0;
  }
  [[nodiscard]] double value() const { return static_cast<double>(succeeded) / tried; }
};

std::ostream& operator<<(std::ostream& out, const Share& share) {
  return out << share.succeeded << " of " << share.tried;
}

FlightMode mode_of_seed(std::uint64_t seed) {
  return seed % 2 == 0 ? FlightMode::kExplorer : FlightMode::kCollector;
}

std::optional<PlanScene> scene_of_seed(Rng& rng, std::uint64_t seed) {
  std::optional<PlanScene> scene = test::random_scene(rng, kLeastRoute_m);
  if (scene) {
    scene->request.mode = mode_of_seed(seed);
    scene->request.limits = LimitsConfig{}.limits_for(scene->request.mode);
  }
  return scene;
}

// At any microsecond, not only at those instants at which the planner looked.
Time random_instant(const Trajectory& trajectory, Rng& rng) {
  return trajectory.start +
         duration_from_seconds(rng.uniform(0.0, to_seconds(trajectory.duration())));
}

// A route within the horizon is flown to its end.
void expect_goal_reached(const Trajectory& trajectory, const PlanScene& scene) {
  const PlanConfig config;
  double length_m = 0.0;
  for (std::size_t i = 1; i < scene.request.route_m.size(); ++i) {
    length_m += (scene.request.route_m[i] - scene.request.route_m[i - 1]).norm();
  }
  const TrajectoryPoint end = trajectory.sample(trajectory.end());
  if (length_m <= config.horizon_m) {
    EXPECT_LT((end.position_m - scene.request.route_m.back()).norm(), 1e-6);
  }
  EXPECT_NEAR(angle_difference(end.yaw_rad, scene.request.goal_yaw_rad), 0.0, 1e-6);
}

// The same map but for a ball that is no longer free.
MapSnapshotPtr with_ball(const MapSnapshot& before, const Vector3d& center_m, double radius_m) {
  MapSnapshot after = before;
  const Vector3d reach_m = Vector3d::Constant(radius_m);
  const VoxelBox near = after.geometry.voxels_touched_by({center_m - reach_m, center_m + reach_m});
  test::for_each_voxel(near, [&](const VoxelIndex& voxel) {
    if ((after.geometry.center_of(voxel) - center_m).norm() <= radius_m) {
      TilePtr& tile = after.tiles[after.geometry.slot_of(voxel)];
      auto changed = std::make_shared<Tile>(tile ? *tile : Tile());
      changed->set(offset_in_tile(voxel), kUnknownLogOdds);
      tile = std::move(changed);
    }
  });
  ++after.revision;
  return std::make_shared<const MapSnapshot>(std::move(after));
}

struct Shares {
  Share scenes;
  Share from_rest;
  Share in_motion;
  Share brakes;
  Share surprised_brakes;  // something has appeared ahead, most often too late
};

void brake_anywhere(const Trajectory& flown, const PlanScene& scene, Rng& rng, Share& brakes) {
  constexpr int kTimes = 5;
  const PlanConfig config;
  for (int i = 0; i < kTimes; ++i) {
    const Time from = random_instant(flown, rng);
    const Result<Trajectory, PlanError> brake =
        TrajectoryPlanner(config).plan_brake(scene.map, flown, from);
    brakes.count(brake.has_value());
    if (brake) {
      EXPECT_EQ(fault_in(*brake, *scene.snapshot, brake_requirements(flown, from, config)), "");
    }
  }
}

// A ball that was not in the map blocks what is flown up to 2 s ahead, but is not here yet.
void brake_surprised(const Trajectory& flown, const PlanScene& scene, Rng& rng, Share& brakes) {
  const PlanConfig config;
  const Time from = random_instant(flown, rng);
  const Vector3d ahead_m =
      flown.sample(from + duration_from_seconds(rng.uniform(0.3, 2.0))).position_m;
  const MapSnapshotPtr snapshot = with_ball(*scene.snapshot, ahead_m, rng.uniform(0.1, 0.4));
  const test::TrajectoryRequirements required = brake_requirements(flown, from, config);
  if (!(test::brute_force_clearance_m(*snapshot, required.start.position_m, 1.0) >
        required.radius_m)) {
    return;
  }
  ClearanceMap map = scene.map;
  map.update(snapshot);
  const Result<Trajectory, PlanError> brake =
      TrajectoryPlanner(config).plan_brake(map, flown, from);
  brakes.count(brake.has_value());
  if (brake) {
    EXPECT_EQ(fault_in(*brake, *snapshot, required), "");
  }
}

std::optional<Trajectory> checked_plan(const PlanScene& scene) {
  const PlanConfig config;
  Result<Trajectory, PlanError> planned = TrajectoryPlanner(config).plan(scene.map, scene.request);
  if (!planned) {
    return std::nullopt;
  }
  EXPECT_EQ(fault_in(*planned, *scene.snapshot, requirements_of(scene.request, config)), "");
  expect_goal_reached(*planned, scene);
  return std::move(planned).value();
}

void plan_and_brake(const PlanScene& scene, Rng& rng, Share& plans, Shares& shares) {
  const std::optional<Trajectory> planned = checked_plan(scene);
  plans.count(planned.has_value());
  if (planned) {
    brake_anywhere(*planned, scene, rng, shares.brakes);
    brake_surprised(*planned, scene, rng, shares.surprised_brakes);
  }
}

// The shards can run side by side.
class PlanProperty : public testing::TestWithParam<std::uint64_t> {};

TEST_P(PlanProperty, EveryTrajectoryIsSafeWithinLimitsContinuousAndEndsAtRest) {
  constexpr std::uint64_t kSeeds = 150;
  Shares shares;
  for (std::uint64_t seed = GetParam() * kSeeds; seed < (GetParam() + 1) * kSeeds; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Rng rng(seed);
    std::optional<PlanScene> scene = scene_of_seed(rng, seed);
    shares.scenes.count(scene.has_value());
    if (scene) {
      plan_and_brake(*scene, rng, shares.from_rest, shares);
      if (test::set_in_motion(*scene, rng)) {
        plan_and_brake(*scene, rng, shares.in_motion, shares);
      }
    }
  }
  // Seen: all but the surprised brakes, of which 0.53 to 0.64, and 124 to 137 set in motion.
  EXPECT_GE(shares.scenes.value(), 0.95) << shares.scenes;
  EXPECT_GE(shares.from_rest.value(), 0.98) << shares.from_rest;
  EXPECT_GE(shares.in_motion.tried, 110);
  EXPECT_GE(shares.in_motion.value(), 0.96) << shares.in_motion;
  EXPECT_EQ(shares.brakes.succeeded, shares.brakes.tried) << "what is flown can always be stopped";
  EXPECT_GE(shares.surprised_brakes.value(), 0.4) << shares.surprised_brakes;
}

INSTANTIATE_TEST_SUITE_P(Seeds, PlanProperty, testing::Range<std::uint64_t>(0, 8));

// The next trajectory begins on the way, at any place of the last one and in the other mode.
void turn_off(PlanScene& scene, const Trajectory& flown, Rng& rng) {
  PlanRequest& request = scene.request;
  request.route_m.clear();
  const Time from = random_instant(flown, rng);
  request.start = flown.sample(from);
  request.start_time = from;
  request.mode =
      request.mode == FlightMode::kExplorer ? FlightMode::kCollector : FlightMode::kExplorer;
  request.limits = LimitsConfig{}.limits_for(request.mode);
  request.goal_yaw_rad = rng.uniform(-kPi, kPi);
  const std::optional<Vector3d> goal_m = test::random_free_point(scene.map, 0.3, rng);
  if (goal_m) {
    request.route_m = test::lattice_route(scene.map, request.start.position_m, *goal_m, 0.281);
  }
}

class ReplanProperty : public testing::TestWithParam<std::uint64_t> {};

TEST_P(ReplanProperty, ChainedTrajectoriesAreSafeAndJoinSmoothly) {
  constexpr std::uint64_t kSeeds = 50;
  constexpr int kReplans = 4;
  Share replans;
  Share brakes;
  for (std::uint64_t seed = GetParam() * kSeeds; seed < (GetParam() + 1) * kSeeds; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Rng rng(seed ^ 0xC4A1ULL);
    std::optional<PlanScene> scene = scene_of_seed(rng, seed);
    std::optional<Trajectory> flown = scene ? checked_plan(*scene) : std::nullopt;
    for (int i = 0; flown && i < kReplans; ++i) {
      turn_off(*scene, *flown, rng);
      if (!scene->request.route_m.empty()) {
        const std::optional<Trajectory> next = checked_plan(*scene);
        replans.count(next.has_value());
        brake_anywhere(next ? *next : *flown, *scene, rng, brakes);
        flown = next ? next : flown;
      }
    }
  }
  // Seen: 0.83 to 0.86. What fails is fast, accelerating and asked to obey an Explorer's limits.
  EXPECT_GE(replans.tried, 180);
  EXPECT_GE(replans.value(), 0.78) << replans;
  EXPECT_EQ(brakes.succeeded, brakes.tried) << "what is flown can always be stopped";
}

INSTANTIATE_TEST_SUITE_P(Seeds, ReplanProperty, testing::Range<std::uint64_t>(0, 4));

}  // namespace
}  // namespace understory
