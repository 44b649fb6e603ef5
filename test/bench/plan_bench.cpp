// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// From the map to a trajectory in the dense forest (0.2 trunks per m2): routes, trajectories,
// brakes, and the whole decision.
#include <cmath>
#include <limits>
#include <vector>

#include <benchmark/benchmark.h>

#include "support/plan_scene.hpp"
#include "understory/explorer.hpp"

namespace understory {
namespace {

constexpr double kRouteClearance_m = 0.32;
constexpr std::size_t kTargets = 200;

// Routes to viewpoints all over the forest, in one search.
void routes_to_all_targets(benchmark::State& state) {
  Rng rng(1);
  test::RandomForest forest;
  const double half_m = static_cast<double>(state.range(0)) / 2.0;
  forest.box_m = {Vector3d(-half_m, -half_m, 0.0), Vector3d(half_m, half_m, 2.0)};
  const MapSnapshotPtr map = test::random_forest(forest, rng).build();
  ClearanceMap clearance;
  clearance.update(map);
  RouteSearch routes(map->geometry, kRouteClearance_m);
  std::vector<RouteLattice::Node> targets;
  while (targets.size() < kTargets) {
    const std::optional<Vector3d> point = test::random_free_point(clearance, 0.5, rng);
    if (point) {
      targets.push_back(routes.lattice().nearest(*point));
    }
  }
  const Vector3d start_m = routes.lattice().point_of(targets.back());
  for (auto _ : state) {
    routes.run(clearance, start_m, targets, std::numeric_limits<double>::infinity());
    benchmark::DoNotOptimize(routes.length_m(targets.front()));
  }
}
BENCHMARK(routes_to_all_targets)
    ->Name("RouteSearch_Run/200_targets_edge_m")
    ->Arg(16)
    ->Arg(50)
    ->Unit(benchmark::kMillisecond);

std::vector<test::PlanScene> scenes(bool in_motion) {
  constexpr std::size_t kScenes = 24;
  std::vector<test::PlanScene> found;
  for (std::uint64_t seed = 0; found.size() < kScenes; ++seed) {
    Rng rng(seed);
    std::optional<test::PlanScene> scene = test::random_scene(rng, 4.0);
    if (!scene) {
      continue;
    }
    const FlightMode mode = seed % 2 == 0 ? FlightMode::kExplorer : FlightMode::kCollector;
    scene->request.mode = mode;
    scene->request.limits = LimitsConfig{}.limits_for(mode);
    if (!in_motion || test::set_in_motion(*scene, rng)) {
      found.push_back(std::move(*scene));
    }
  }
  return found;
}

// The share of plans that failed is reported beside the time.
void plan(benchmark::State& state, bool in_motion) {
  const std::vector<test::PlanScene> all = scenes(in_motion);
  const TrajectoryPlanner planner{PlanConfig{}};
  std::size_t next = 0;
  std::int64_t failed = 0;
  for (auto _ : state) {
    const test::PlanScene& scene = all[next];
    next = (next + 1) % all.size();
    const Result<Trajectory, PlanError> planned = planner.plan(scene.map, scene.request);
    failed += planned ? 0 : 1;
    benchmark::DoNotOptimize(planned);
  }
  state.counters["failed"] =
      benchmark::Counter(static_cast<double>(failed), benchmark::Counter::kAvgIterations);
}
BENCHMARK_CAPTURE(plan, from_rest, false)
    ->Name("TrajectoryPlanner_Plan/from_rest")
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(plan, in_motion, true)
    ->Name("TrajectoryPlanner_Plan/in_motion")
    ->Unit(benchmark::kMillisecond);

void plan_brake(benchmark::State& state) {
  const TrajectoryPlanner planner{PlanConfig{}};
  std::vector<test::PlanScene> all = scenes(false);
  std::vector<Trajectory> flown;
  for (const test::PlanScene& scene : all) {
    const Result<Trajectory, PlanError> planned = planner.plan(scene.map, scene.request);
    if (!planned) {
      state.SkipWithError("a scene cannot be planned in");
      return;
    }
    flown.push_back(*planned);
  }
  std::size_t next = 0;
  for (auto _ : state) {
    const Trajectory& trajectory = flown[next];
    benchmark::DoNotOptimize(planner.plan_brake(
        all[next].map, trajectory, trajectory.start + trajectory.duration() / 2));
    next = (next + 1) % all.size();
  }
}
BENCHMARK(plan_brake)->Name("TrajectoryPlanner_PlanBrake/half_way")->Unit(benchmark::kMicrosecond);

// A ring of unknown places around the middle, where the vehicle stands.
MapSnapshotPtr half_known_forest() {
  Rng rng(1);
  test::RandomForest forest;
  forest.box_m = {Vector3d(-25.0, -25.0, 0.0), Vector3d(25.0, 25.0, 2.0)};
  test::SnapshotBuilder builder = test::random_forest(forest, rng);
  for (int i = 0; i < 24; ++i) {
    const double angle_rad = i * kPi / 12.0;
    builder.set_cylinder(
        20.0 * Vector2d(std::cos(angle_rad), std::sin(angle_rad)), 4.0, VoxelState::kUnknown);
  }
  builder.set_cylinder({0.0, 0.0}, 1.0, VoxelState::kFree);
  return builder.build();
}

// Everything between a map and a trajectory, from nothing: clearance, clusters with viewpoints and
// labels, routes, choice, plan.
void first_decision(benchmark::State& state) {
  const MapSnapshotPtr map = half_known_forest();
  const ExplorerConfig config;
  for (auto _ : state) {
    Pilot pilot(config.plan, duration_from_seconds(config.replan.lead_s));
    Explorer explorer(config, map->geometry);
    pilot.take_position({0.0, 0.0, 1.0}, 0.0, Time{});
    pilot.update_map(map);
    explorer.observe(map);
    const ExploreStep step = explorer.step(pilot, Time(std::chrono::seconds(1)));
    if (!step.published) {
      state.SkipWithError("nothing was decided");
      break;
    }
  }
}
BENCHMARK(first_decision)->Name("Explorer_Step/first_decision_50_m")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace understory
