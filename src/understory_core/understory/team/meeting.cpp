// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/team/meeting.hpp"

#include <algorithm>

namespace understory::team {
namespace {

// Who was heard within this has told nearly all that it knows.
constexpr double kLatelyS = 60.0;
// Of the farthest distance that anybody was heard: from here on silence means out of range.
constexpr double kEdge = 0.7;

}  // namespace

Meeting::Meeting(const CoordinationConfig& config) : wait_s_(config.meeting_wait_s) {}

bool Meeting::is_awaited(const Mate& mate, Time now) const {
  return wait_s_ > 0.0 && !mate.was_awaited && mate.last_distance_m >= kEdge * farthest_m_ &&
         to_seconds(now - mate.last_heard) >= kLatelyS;
}

void Meeting::observe(const Peers& peers, const Vector3d& own_position_m, Time now) {
  is_wanted_ = false;
  for (const Peer& peer : peers) {
    if (peer.in_contact) {
      const double distance_m = (peer.position_m - own_position_m).norm();
      mates_[peer.id] = {distance_m, now, false};
      farthest_m_ = std::max(farthest_m_, distance_m);
    } else if (const auto mate = mates_.find(peer.id); mate != mates_.end()) {
      is_wanted_ = is_wanted_ || is_awaited(mate->second, now);
    }
  }
  if (!is_wanted_) {
    waits_since_.reset();
  }
}

void Meeting::wait(Time now) {
  waits_since_ = waits_since_.value_or(now);
  if (to_seconds(now - *waits_since_) >= wait_s_) {
    give_up();
  }
}

void Meeting::give_up() {
  for (auto& [id, mate] : mates_) {
    mate.was_awaited = true;  // until its next word
  }
  waits_since_.reset();
  is_wanted_ = false;
}

}  // namespace understory::team
