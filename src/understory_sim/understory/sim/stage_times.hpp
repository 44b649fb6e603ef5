// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// How long each stage of a mission takes on this machine: wall time by the steady clock, 4 bytes a
// sample. The only clock in the lockstep simulator; nothing that flies may read it. One thread.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace understory {

struct StageStats {
  std::string name;
  std::uint64_t count = 0;
  double mean_ms = 0.0;
  double p50_ms = 0.0;  // nearest rank: a sample that did occur
  double p99_ms = 0.0;
  double max_ms = 0.0;
};

class StageTimes {
 public:
  using Stage = std::size_t;

  // The stage of this name, added when it is new.
  [[nodiscard]] Stage stage(const std::string& name);
  void add(Stage stage, std::chrono::nanoseconds duration);
  // In the order in which the stages were added; those without samples included.
  [[nodiscard]] std::vector<StageStats> stats() const;

 private:
  struct Samples {
    std::string name;
    std::vector<float> milliseconds;
  };
  std::vector<Samples> stages_;
};

// Adds the time from its construction to its end.
class StageTimer {
 public:
  StageTimer(StageTimes& times, StageTimes::Stage stage)
      : times_(times), stage_(stage), start_(std::chrono::steady_clock::now()) {}
  StageTimer(const StageTimer&) = delete;
  StageTimer& operator=(const StageTimer&) = delete;
  StageTimer(StageTimer&&) = delete;
  StageTimer& operator=(StageTimer&&) = delete;
  ~StageTimer() { times_.add(stage_, std::chrono::steady_clock::now() - start_); }

 private:
  StageTimes& times_;
  StageTimes::Stage stage_;
  std::chrono::steady_clock::time_point start_;
};

// Largest resident size of this process so far; 0 where the kernel does not tell.
[[nodiscard]] double peak_rss_mb();

}  // namespace understory
