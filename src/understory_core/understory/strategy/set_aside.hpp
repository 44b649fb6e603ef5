// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Remembers which targets did not work out, so that no plan is retried without bound: a place is
// left alone for a while, after a number of tries for good; a view that showed nothing new is not
// taken twice. World frame, metres. One thread; cannot fail.
#pragma once

#include <cstddef>
#include <vector>

#include "understory/base/time.hpp"
#include "understory/frontier/cluster.hpp"

namespace understory {

class SetAsideList {
 public:
  SetAsideList(Duration duration, int max_tries) : duration_(duration), max_tries_(max_tries) {}

  // True: that was the last try, the place is given up.
  bool add(const Cluster& cluster, Time now);
  void ban_view(const Viewpoint& viewpoint) { banned_views_.push_back(viewpoint); }

  [[nodiscard]] bool is_waiting(const Cluster& cluster, Time now) const;
  [[nodiscard]] bool is_given_up(const Cluster& cluster) const;
  [[nodiscard]] bool is_banned(const Viewpoint& viewpoint) const;
  [[nodiscard]] std::size_t size() const { return places_.size(); }

 private:
  struct Place {
    Vector3d mean_m;
    Time until;
    int tries;
  };
  [[nodiscard]] const Place* find(const Cluster& cluster) const;

  Duration duration_;
  int max_tries_;
  std::vector<Place> places_;
  std::vector<Viewpoint> banned_views_;
};

}  // namespace understory
