// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Team mates that are not heard. What moves in the images (map/intruders.hpp) is one of them, as
// long as there is any: it is followed from image to image, and for a while after the last one, and
// is traffic where it is and where it flies on to. And while one may be near, because it was never
// heard or fell silent near by, a vehicle flies so that two can stop before they meet
// (Pilot::be_wary). Who fell silent far away is out of range, and will be heard before it is seen.
// World frame, SI units. One thread; deterministic; nothing can fail.
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "understory/plan/traffic.hpp"
#include "understory/team/peer.hpp"
#include "understory/team/team_config.hpp"

namespace understory::team {

class Lookout {
 public:
  explicit Lookout(const TeamConfig& config);

  // What is known of team mates now, and where the vehicle itself is.
  void hear(const Peers& peers, const Vector3d& own_position_m);
  // What moves, with every map.
  void see(const std::vector<Vector3d>& intruders_m, Time now);

  // Who is seen and not heard.
  [[nodiscard]] std::vector<Mover> movers(Time now) const;
  // May somebody be near who is not heard?
  [[nodiscard]] bool is_wary(Time now) const;

 private:
  struct Word {
    Time heard_at{};
    double from_m = 0.0;  // how far away it was
  };

  struct Sighting {
    Vector3d position_m = Vector3d::Zero();
    Vector3d velocity_mps = Vector3d::Zero();
    Time seen_at{};

    [[nodiscard]] Vector3d position_at(Time time) const {
      return position_m + to_seconds(time - seen_at) * velocity_mps;
    }
  };

  [[nodiscard]] Sighting followed(const Vector3d& place_m, Time now);

  int mates_;
  bool is_on_;
  bool is_anyone_unheard_ = false;
  bool may_be_near_ = false;
  std::optional<Time> seen_at_;     // anybody
  std::map<int, Word> last_words_;  // by id
  std::vector<Sighting> sightings_;
};

}  // namespace understory::team
