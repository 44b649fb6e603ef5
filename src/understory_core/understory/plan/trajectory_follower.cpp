// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/plan/trajectory_follower.hpp"

#include <algorithm>
#include <cassert>

namespace understory {

void TrajectoryFollower::set(TrajectoryPtr trajectory, Time now) {
  while (!queue_.empty() && queue_.back()->start >= trajectory->start) {
    queue_.pop_back();
  }
  while (queue_.size() > 1 && queue_[1]->start <= now) {
    queue_.erase(queue_.begin());
  }
  queue_.push_back(std::move(trajectory));
}

void TrajectoryFollower::remove(const TrajectoryPtr& trajectory) {
  if (queue_.size() > 1) {
    queue_.erase(std::remove(queue_.begin(), queue_.end(), trajectory), queue_.end());
  }
}

const Trajectory& TrajectoryFollower::at(Time time) const {
  assert(!queue_.empty());
  std::size_t index = queue_.size() - 1;
  while (index > 0 && queue_[index]->start > time) {
    --index;
  }
  return *queue_[index];
}

}  // namespace understory
