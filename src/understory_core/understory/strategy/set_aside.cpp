// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/strategy/set_aside.hpp"

#include <cmath>

namespace understory {
namespace {

constexpr double kSamePlaceM = 0.4;
constexpr double kSameViewRad = 0.3;

}  // namespace

const SetAsideList::Place* SetAsideList::find(const Cluster& cluster) const {
  for (const Place& place : places_) {
    if ((place.mean_m - cluster.mean_m).squaredNorm() < kSamePlaceM * kSamePlaceM) {
      return &place;
    }
  }
  return nullptr;
}

bool SetAsideList::add(const Cluster& cluster, Time now) {
  const Place* known = find(cluster);
  if (known == nullptr) {
    places_.push_back({cluster.mean_m, now + duration_, 1});
    return max_tries_ <= 1;
  }
  Place& place = places_[static_cast<std::size_t>(known - places_.data())];
  place.until = now + duration_;
  return ++place.tries == max_tries_;
}

bool SetAsideList::is_waiting(const Cluster& cluster, Time now) const {
  const Place* place = find(cluster);
  return place != nullptr && now < place->until;
}

bool SetAsideList::is_given_up(const Cluster& cluster) const {
  const Place* place = find(cluster);
  return place != nullptr && place->tries >= max_tries_;
}

bool SetAsideList::is_banned(const Viewpoint& viewpoint) const {
  for (const Viewpoint& banned : banned_views_) {
    if (banned.node == viewpoint.node &&
        std::abs(angle_difference(banned.yaw_rad, viewpoint.yaw_rad)) < kSameViewRad) {
      return true;
    }
  }
  return false;
}

}  // namespace understory
