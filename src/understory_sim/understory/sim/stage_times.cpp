// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/stage_times.hpp"

#include <algorithm>
#include <cassert>
#include <fstream>
#include <numeric>

namespace understory {
namespace {

double nearest_rank(const std::vector<float>& sorted, std::size_t percent) {
  const std::size_t rank = (sorted.size() * percent + 99) / 100;
  return static_cast<double>(sorted[std::max<std::size_t>(rank, 1) - 1]);
}

}  // namespace

StageTimes::Stage StageTimes::stage(const std::string& name) {
  const auto found = std::find_if(
      stages_.begin(), stages_.end(), [&](const Samples& samples) { return samples.name == name; });
  if (found != stages_.end()) {
    return static_cast<Stage>(found - stages_.begin());
  }
  stages_.push_back({name, {}});
  return stages_.size() - 1;
}

void StageTimes::add(Stage stage, std::chrono::nanoseconds duration) {
  assert(stage < stages_.size());
  stages_[stage].milliseconds.push_back(std::chrono::duration<float, std::milli>(duration).count());
}

std::vector<StageStats> StageTimes::stats() const {
  std::vector<StageStats> all;
  for (const Samples& samples : stages_) {
    StageStats stats;
    stats.name = samples.name;
    stats.count = samples.milliseconds.size();
    if (stats.count > 0) {
      std::vector<float> sorted = samples.milliseconds;
      std::sort(sorted.begin(), sorted.end());
      stats.mean_ms =
          std::accumulate(sorted.begin(), sorted.end(), 0.0) / static_cast<double>(sorted.size());
      stats.p50_ms = nearest_rank(sorted, 50);
      stats.p99_ms = nearest_rank(sorted, 99);
      stats.max_ms = static_cast<double>(sorted.back());
    }
    all.push_back(stats);
  }
  return all;
}

double peak_rss_mb() {
  // getrusage would also count the program that started this one.
  std::ifstream status("/proc/self/status");
  std::string key;
  double kilobytes = 0.0;
  while (status >> key) {
    if (key == "VmHWM:" && status >> kilobytes) {
      return kilobytes / 1024.0;
    }
  }
  return 0.0;
}

}  // namespace understory
