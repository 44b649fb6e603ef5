// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// The simulated world on the very dense forest (0.20 trees/m2, 50 m x 50 m).
#include <vector>

#include <benchmark/benchmark.h>

#include "understory/base/rng.hpp"
#include "understory/sim/coverage_truth.hpp"
#include "understory/sim/depth_noise.hpp"
#include "understory/sim/depth_renderer.hpp"
#include "understory/sim/forest_generator.hpp"
#include "understory/sim/forest_truth.hpp"

namespace understory {
namespace {

Forest very_dense_forest() {
  GeneratorConfig config;
  config.regions = {{-25, -25, 25, 25, 0.20}};
  return generate_forest(config, Rng(1));
}

std::vector<Vector3d> places_in(const ForestTruth& truth, std::size_t count) {
  Rng rng(2);
  std::vector<Vector3d> places;
  while (places.size() < count) {
    const double x_m = rng.uniform(-24, 24);
    const double y_m = rng.uniform(-24, 24);
    const Vector3d place(x_m, y_m, rng.uniform(0.5, 1.5));
    if (truth.distance_to_nearest_surface_m(place, 1.0) > 0.25) {
      places.push_back(place);
    }
  }
  return places;
}

std::vector<Pose> views_in(const ForestTruth& truth) {
  Rng rng(3);
  std::vector<Pose> views;
  for (const Vector3d& place : places_in(truth, 64)) {
    views.push_back(level_pose(place, rng.uniform(-kPi, kPi)) * body_from_optical(CameraConfig{}));
  }
  return views;
}

void render(benchmark::State& state, int width_px, int height_px) {
  CameraConfig config;
  config.width_px = width_px;
  config.height_px = height_px;
  const CameraModel camera(config);
  const Forest forest = very_dense_forest();
  const std::vector<Pose> views = views_in(ForestTruth(forest));
  const DepthRenderer renderer(forest);
  DepthImage image;
  std::size_t i = 0;
  for (auto _ : state) {
    image = renderer.render(camera, views[i++ % views.size()], std::move(image));
    benchmark::DoNotOptimize(image.z_m.data());
  }
}
BENCHMARK_CAPTURE(render, small, 160, 120)
    ->Name("DepthRenderer_Render/160x120")
    ->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(render, large, 640, 480)
    ->Name("DepthRenderer_Render/640x480")
    ->Unit(benchmark::kMicrosecond);

void build_renderer(benchmark::State& state) {
  const Forest forest = very_dense_forest();
  for (auto _ : state) {
    const DepthRenderer renderer(forest);
    benchmark::DoNotOptimize(&renderer);
  }
}
BENCHMARK(build_renderer)->Name("DepthRenderer_Build/500_trunks")->Unit(benchmark::kMillisecond);

void noise(benchmark::State& state) {
  const Forest forest = very_dense_forest();
  const DepthRenderer renderer(forest);
  const DepthImage clean =
      renderer.render(CameraModel(CameraConfig{}), views_in(ForestTruth(forest))[0]);
  Rng rng(4);
  for (auto _ : state) {
    benchmark::DoNotOptimize(add_noise(clean, {0.002, 0.01}, rng).z_m.data());
  }
}
BENCHMARK(noise)->Name("DepthNoise_Add/160x120")->Unit(benchmark::kMicrosecond);

void distance(benchmark::State& state) {
  const ForestTruth truth(very_dense_forest());
  const std::vector<Vector3d> places = places_in(truth, 1024);
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(truth.distance_to_nearest_surface_m(places[i++ % 1024], 0.5));
  }
}
BENCHMARK(distance)->Name("ForestTruth_Distance/500_trunks");

void generate(benchmark::State& state) {
  GeneratorConfig config;
  config.regions = {{-160, -160, 160, 160, 0.20}};
  for (auto _ : state) {
    benchmark::DoNotOptimize(generate_forest(config, Rng(1)).trunks.data());
  }
}
void coverage_truth(benchmark::State& state) {
  const ForestTruth truth(very_dense_forest());
  const GridGeometry geometry(0.10, Box3d(Vector3d(-25, -25, 0), Vector3d(25, 25, 2)));
  for (auto _ : state) {
    const CoverageTruth coverage(truth, geometry, {Vector3d(0, 0, 1)}, CameraConfig{}, 0.20);
    state.counters["voxels"] = static_cast<double>(coverage.voxel_count());
  }
}
BENCHMARK(coverage_truth)->Name("CoverageTruth_Build/50x50x2")->Unit(benchmark::kMillisecond);

BENCHMARK(generate)->Name("ForestGenerator_Generate/20480_trunks")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace understory
