// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/team/lookout.hpp"

#include <algorithm>
#include <iterator>

namespace understory::team {
namespace {

constexpr double kKeptS = 3.0;        // after it was last seen
constexpr double kWaryAfterS = 20.0;  // likewise
constexpr double kSameM = 1.0;        // from one image to the next
constexpr double kTrust = 0.5;        // in the speed from the last two images
constexpr double kFastestMps = 4.0;   // more is a wrong match
// Where it will be in so many steps of time is not flown to.
constexpr int kStepsAhead = 6;
constexpr double kAheadStepS = 0.25;
// Its middle lies behind the side that is seen, and where it goes is a guess.
constexpr double kDoubtM = 0.7;
constexpr double kDoubtGrowthMps = 0.2;
// Further than two vehicles come in the time that it takes to find out that one is silent.
constexpr double kFarM = 12.0;

}  // namespace

Lookout::Lookout(const TeamConfig& config)
    : mates_(config.size - 1), is_on_(config.separation.lookout) {}

void Lookout::hear(const Peers& peers, const Vector3d& own_position_m) {
  int heard = 0;
  int far = 0;
  for (const Peer& peer : peers) {
    const double distance_m = (peer.position_m - own_position_m).norm();
    Word& last = last_words_.try_emplace(peer.id, Word{peer.heard_at, distance_m}).first->second;
    if (peer.heard_at > last.heard_at) {
      last = {peer.heard_at, distance_m};
    }
    heard += peer.in_contact ? 1 : 0;
    far += !peer.in_contact && last.from_m > kFarM ? 1 : 0;
  }
  is_anyone_unheard_ = is_on_ && heard < mates_;
  may_be_near_ = is_on_ && heard + far < mates_;
}

// Who is seen and not heard has a radio that does not work, or one's own does not.
bool Lookout::is_wary(Time now) const {
  return may_be_near_ ||
         (is_anyone_unheard_ && seen_at_ && to_seconds(now - *seen_at_) < kWaryAfterS);
}

// As what was seen before and could be there now, or new.
Lookout::Sighting Lookout::followed(const Vector3d& place_m, Time now) {
  Sighting sighting{place_m, Vector3d::Zero(), now};
  const auto distance_m = [&](const Sighting& before) {
    return (before.position_at(now) - place_m).norm();
  };
  const auto nearest = std::min_element(
      sightings_.begin(), sightings_.end(), [&](const Sighting& a, const Sighting& b) {
        return distance_m(a) < distance_m(b);
      });
  if (nearest == sightings_.end() || nearest->seen_at >= now || distance_m(*nearest) > kSameM) {
    return sighting;
  }
  const Vector3d velocity_mps =
      (place_m - nearest->position_m) / to_seconds(now - nearest->seen_at);
  sighting.velocity_mps = nearest->velocity_mps + kTrust * (velocity_mps - nearest->velocity_mps);
  sighting.velocity_mps *=
      std::min(1.0, kFastestMps / std::max(1e-9, sighting.velocity_mps.norm()));
  sightings_.erase(nearest);
  return sighting;
}

void Lookout::see(const std::vector<Vector3d>& intruders_m, Time now) {
  std::vector<Sighting> seen;
  if (is_anyone_unheard_) {
    for (const Vector3d& place_m : intruders_m) {
      seen.push_back(followed(place_m, now));
      seen_at_ = now;
    }
  }
  std::copy_if(
      sightings_.begin(), sightings_.end(), std::back_inserter(seen), [&](const Sighting& before) {
        return to_seconds(now - before.seen_at) < kKeptS;
      });
  sightings_ = std::move(seen);
}

std::vector<Mover> Lookout::movers(Time now) const {
  std::vector<Mover> movers;
  for (const Sighting& sighting : sightings_) {
    Mover mover;
    mover.position_m = sighting.position_at(now);
    mover.extra_m = kDoubtM + kDoubtGrowthMps * to_seconds(now - sighting.seen_at);
    for (int step = 1; step <= kStepsAhead; ++step) {
      mover.other_places_m.emplace_back(mover.position_m +
                                        step * kAheadStepS * sighting.velocity_mps);
    }
    movers.push_back(std::move(mover));
  }
  return movers;
}

}  // namespace understory::team
