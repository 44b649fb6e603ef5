// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Which trajectory holds when: a new one takes over at its own start time, until then the previous
// one is flown on. World frame, SI units. One thread; sampling cannot fail once something was set.
#pragma once

#include <vector>

#include "understory/plan/trajectory.hpp"

namespace understory {

class TrajectoryFollower {
 public:
  // Whatever was to take over at or after the new one's start is dropped.
  void set(TrajectoryPtr trajectory, Time now);
  // Takes it back; the only one there is stays.
  void remove(const TrajectoryPtr& trajectory);

  [[nodiscard]] bool empty() const { return queue_.empty(); }
  [[nodiscard]] const Trajectory& at(Time time) const;
  [[nodiscard]] TrajectoryPoint sample(Time time) const { return at(time).sample(time); }
  [[nodiscard]] const TrajectoryPtr& newest() const { return queue_.back(); }
  // All that is still to be flown after `now`, in order; each holds until the next one's start.
  [[nodiscard]] const std::vector<TrajectoryPtr>& queue() const { return queue_; }

 private:
  std::vector<TrajectoryPtr> queue_;  // ascending by start
};

}  // namespace understory
