// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// The seam between exploration strategies and everything else: what a strategy is given, and what
// it answers. World frame, SI units. One thread; deterministic; "nothing left" is an answer.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "understory/frontier/cluster.hpp"
#include "understory/plan/clearance_map.hpp"
#include "understory/plan/trajectory.hpp"
#include "understory/team/peer.hpp"

namespace understory {

// A viewpoint that can be reached now, and how far it is to fly.
struct Candidate {
  ClusterPtr cluster;
  Viewpoint viewpoint;
  double route_length_m = 0.0;
};

struct StrategyInput {
  const ClearanceMap* map = nullptr;  // as long as the question is answered
  std::vector<Candidate> candidates;  // by cluster id, then best coverage first
  bool is_complete = false;  // false: only what is near was searched, more may be reachable
  TrajectoryPoint vehicle;   // where the next trajectory starts
  FlightMode mode = FlightMode::kExplorer;  // so far
  ClusterPtr target;                        // so far; null: none
  team::Peers peers;                        // none: it is alone
};

struct Target {
  Candidate candidate;
  FlightMode mode = FlightMode::kExplorer;
};

class Strategy {
 public:
  Strategy() = default;
  Strategy(const Strategy&) = delete;
  Strategy& operator=(const Strategy&) = delete;
  virtual ~Strategy() = default;

  // Nothing: of these candidates none is worth flying to. If the input was not complete, the same
  // question is asked again with all there is. What a strategy remembers may make the next answer
  // quicker, or depend on the last one.
  [[nodiscard]] virtual std::optional<Target> choose(const StrategyInput& input) = 0;
  // What is near only is never worth asking about.
  [[nodiscard]] virtual bool needs_all() const { return false; }
};

}  // namespace understory
