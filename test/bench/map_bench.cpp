// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Map update beside OctoMap's on the same clouds: a flight through a seeded forest of 0.20 trunks
// per square metre, 50 x 50 x 2 m at 0.10 m. Each frame is one measurement; the percentiles are
// over frames, of wall time and, since a busy machine takes the core away at times, of the thread's
// CPU time. A lap starts from an empty map.
#include <algorithm>
#include <chrono>
#include <ctime>
#include <memory>
#include <vector>

#include <benchmark/benchmark.h>
#include <octomap/octomap.h>

#include "support/synthetic_scene.hpp"
#include "understory/map/mapper.hpp"

namespace understory {
namespace {

constexpr double kEdgeM = 50.0;
constexpr double kTrunksPerM2 = 0.20;
constexpr double kFlightHeightM = 1.0;
constexpr std::uint64_t kSeed = 20;

struct Flight {
  CameraModel camera;
  std::vector<Pose> poses;
  std::vector<DepthImage> images;
};

Flight recorded_flight(int width_px, int height_px, std::size_t frames) {
  const test::SyntheticScene forest = test::seeded_forest(kEdgeM, kTrunksPerM2, kSeed);
  Flight flight{CameraModel(test::camera_config(width_px, height_px)), {}, {}};
  flight.poses = test::flight_through(forest, kEdgeM, kFlightHeightM, frames);
  for (const Pose& pose : flight.poses) {
    flight.images.push_back(test::render(forest, flight.camera, pose));
  }
  return flight;
}

class FrameTimes {
 public:
  // Runs one frame and charges it to the benchmark.
  template <class Work>
  void measure(benchmark::State& state, Work work) {
    const auto start = std::chrono::steady_clock::now();
    const double cpu_start_s = thread_cpu_s();
    work();
    cpu_s_.push_back(thread_cpu_s() - cpu_start_s);
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
    state.SetIterationTime(elapsed.count());
    wall_s_.push_back(elapsed.count());
  }
  void report(benchmark::State& state) {
    std::sort(wall_s_.begin(), wall_s_.end());
    std::sort(cpu_s_.begin(), cpu_s_.end());
    state.counters["p50_ms"] = 1e3 * percentile(wall_s_, 0.50);
    state.counters["p99_ms"] = 1e3 * percentile(wall_s_, 0.99);
    state.counters["max_ms"] = 1e3 * wall_s_.back();
    state.counters["cpu_p50_ms"] = 1e3 * percentile(cpu_s_, 0.50);
    state.counters["cpu_p99_ms"] = 1e3 * percentile(cpu_s_, 0.99);
    state.counters["cpu_max_ms"] = 1e3 * cpu_s_.back();
  }

 private:
  [[nodiscard]] static double thread_cpu_s() {
    timespec now{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
  }
  [[nodiscard]] static double percentile(const std::vector<double>& sorted, double fraction) {
    return sorted[static_cast<std::size_t>(fraction * static_cast<double>(sorted.size() - 1))];
  }
  std::vector<double> wall_s_;
  std::vector<double> cpu_s_;
};

Box3d box_m() {
  return {Vector3d::Zero(), Vector3d(kEdgeM, kEdgeM, 2.0)};
}

void integrate(benchmark::State& state, int width_px, int height_px, std::size_t frames) {
  const Flight flight = recorded_flight(width_px, height_px, frames);
  FrameTimes times;
  std::unique_ptr<Mapper> mapper;
  MapSnapshotPtr latest;  // as every reader does, keep the newest while the next is made
  std::size_t frame = 0;
  for (auto _ : state) {
    if (frame == 0) {
      mapper = std::make_unique<Mapper>(MapConfig{}, box_m());
    }
    times.measure(state, [&] {
      const auto counts = mapper->integrate(
          flight.camera, flight.images[frame].view(), flight.poses[frame], Time{});
      benchmark::DoNotOptimize(counts);
      latest = mapper->publish();
    });
    frame = (frame + 1) % flight.poses.size();
  }
  times.report(state);
}

octomap::Pointcloud world_cloud(const Flight& flight, std::size_t frame) {
  octomap::Pointcloud cloud;
  const std::vector<float> points = test::to_points(flight.images[frame], flight.camera, 2.0);
  const Eigen::Isometry3f pose = flight.poses[frame].cast<float>();
  for (std::size_t i = 0; i < points.size(); i += 3) {
    const Eigen::Vector3f p = pose * Eigen::Vector3f(points[i], points[i + 1], points[i + 2]);
    cloud.push_back(p.x(), p.y(), p.z());
  }
  return cloud;
}

void insert_point_cloud(
    benchmark::State& state, int width_px, int height_px, std::size_t frames, bool discretize) {
  const Flight flight = recorded_flight(width_px, height_px, frames);
  FrameTimes times;
  std::unique_ptr<octomap::OcTree> tree;
  std::size_t frame = 0;
  for (auto _ : state) {
    if (frame == 0) {
      tree = std::make_unique<octomap::OcTree>(MapConfig{}.resolution_m);
    }
    const octomap::Pointcloud cloud = world_cloud(flight, frame);
    const octomap::point3d eye(static_cast<float>(flight.poses[frame].translation().x()),
                               static_cast<float>(flight.poses[frame].translation().y()),
                               static_cast<float>(flight.poses[frame].translation().z()));
    times.measure(state, [&] {
      tree->insertPointCloud(cloud, eye, flight.camera.max_range_m, false, discretize);
    });
    frame = (frame + 1) % flight.poses.size();
  }
  times.report(state);
}

BENCHMARK_CAPTURE(integrate, 160x120, 160, 120, 300)
    ->Name("Mapper_Integrate/160x120")
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(integrate, 640x480, 640, 480, 60)
    ->Name("Mapper_Integrate/640x480")
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(insert_point_cloud, 160x120, 160, 120, 300, false)
    ->Name("OctoMap_InsertPointCloud/160x120")
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(insert_point_cloud, 640x480, 640, 480, 60, false)
    ->Name("OctoMap_InsertPointCloud/640x480")
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(insert_point_cloud, 160x120_Discretize, 160, 120, 300, true)
    ->Name("OctoMap_InsertPointCloud_Discretize/160x120")
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(insert_point_cloud, 640x480_Discretize, 640, 480, 60, true)
    ->Name("OctoMap_InsertPointCloud_Discretize/640x480")
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace understory
