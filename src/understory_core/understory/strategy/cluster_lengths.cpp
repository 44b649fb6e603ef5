// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/strategy/cluster_lengths.hpp"

#include <algorithm>

namespace understory {
namespace {

// Of what comes next the order matters; the work grows with the square of this.
constexpr double kLongestSearchedM = 15.0;
constexpr double kSurelyFarM = 1.2 * kLongestSearchedM;
constexpr double kDetourFactor = 1.2;  // of ways that were not found, on the straight line

const Vector3d& view_of(const Cluster& cluster) {
  return cluster.viewpoints.front().position_m;
}

}  // namespace

// Of all clusters; returns the places of those that are new.
std::vector<std::size_t> ClusterLengths::take_slots(const std::vector<const Cluster*>& clusters) {
  std::unordered_map<std::uint32_t, Slot> gone = std::move(slot_of_);
  slot_of_ = {};
  std::vector<std::size_t> fresh;
  for (std::size_t place = 0; place < clusters.size(); ++place) {
    const auto known = gone.find(clusters[place]->id);
    if (known == gone.end()) {
      fresh.push_back(place);
    } else {
      slot_of_.insert(gone.extract(known));
    }
  }
  for (const auto& [id, slot] : gone) {
    unused_.push_back(slot);
  }
  // Whatever order they were found in.
  std::sort(unused_.begin(), unused_.end());
  for (const std::size_t place : fresh) {
    if (unused_.empty()) {
      unused_.push_back(rows_m_.size());
      rows_m_.emplace_back();
      for (std::vector<double>& row_m : rows_m_) {
        row_m.resize(rows_m_.size());
      }
    }
    slot_of_.emplace(clusters[place]->id, unused_.back());
    unused_.pop_back();
  }
  slots_.clear();
  for (const Cluster* cluster : clusters) {
    slots_.push_back(slot_of_.at(cluster->id));
  }
  return fresh;
}

void ClusterLengths::update(const ClearanceMap& map, const std::vector<const Cluster*>& clusters) {
  const std::vector<std::size_t> fresh = take_slots(clusters);
  if (fresh.empty()) {
    return;
  }
  // The others are too far from all that is new, wherever near the views the lattice is entered.
  const auto is_near = [&](const Cluster& cluster) {
    return std::any_of(fresh.begin(), fresh.end(), [&](std::size_t place) {
      const Vector3d way_m = view_of(cluster) - view_of(*clusters[place]);
      return way_m.head<2>().squaredNorm() < kSurelyFarM * kSurelyFarM;
    });
  };
  CoarseRoutes::Entries entries;
  entries.reserve(clusters.size());
  for (const Cluster* cluster : clusters) {
    entries.push_back(is_near(*cluster) ? routes_.entry_of(map, view_of(*cluster))
                                        : CoarseRoutes::nowhere());
  }
  for (const std::size_t from : fresh) {
    const Vector3d& from_m = view_of(*clusters[from]);
    const std::vector<std::optional<double>> found_m =
        routes_.lengths_m(map, from_m, entries, kLongestSearchedM);
    for (std::size_t to = 0; to < clusters.size(); ++to) {
      const double straight_m = (view_of(*clusters[to]) - from_m).norm();
      const double length_m = found_m[to] ? std::max(*found_m[to], straight_m)
                                          : std::max(kLongestSearchedM, kDetourFactor * straight_m);
      rows_m_[slots_[from]][slots_[to]] = length_m;
      rows_m_[slots_[to]][slots_[from]] = length_m;
    }
  }
}

}  // namespace understory
