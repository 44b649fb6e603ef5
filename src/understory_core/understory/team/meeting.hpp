// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// When to meet at home. Vehicles that begin in parts of their own may have been out of each other's
// range for most of a mission; without a meeting each would then explore the other's part anew, and
// learn at the end that all of it was known. So who has finished its own part goes home first,
// where all began, and waits there for a while for whoever is likely to be out of range: who was
// leaving when last heard. Who fell silent near by is taken for lost, and who was never heard has
// not started; neither is waited for. World frame, SI units. One thread; deterministic; nothing can
// fail.
#pragma once

#include <map>
#include <optional>

#include "understory/base/time.hpp"
#include "understory/team/peer.hpp"
#include "understory/team/team_config.hpp"

namespace understory::team {

class Meeting {
 public:
  explicit Meeting(const CoordinationConfig& config);

  // What is known of team mates now, and where the vehicle itself is.
  void observe(const Peers& peers, const Vector3d& own_position_m, Time now);
  // Is anybody worth waiting for?
  [[nodiscard]] bool is_wanted() const { return is_wanted_; }
  // At the place; to be called as long as the vehicle is there and somebody is wanted. Who does not
  // come in time is not waited for again until it has been heard.
  void wait(Time now);
  // Nobody is waited for; as after a wait.
  void give_up();

 private:
  struct Mate {
    double last_distance_m = 0.0;  // when it was last heard
    Time last_heard{};
    bool was_awaited = false;  // in vain, since then
  };

  [[nodiscard]] bool is_awaited(const Mate& mate, Time now) const;

  double wait_s_;
  std::map<int, Mate> mates_;  // that have been heard, by id
  double farthest_m_ = 0.0;    // that anybody was heard
  std::optional<Time> waits_since_;
  bool is_wanted_ = false;
};

}  // namespace understory::team
