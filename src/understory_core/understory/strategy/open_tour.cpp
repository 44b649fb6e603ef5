// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/strategy/open_tour.hpp"

#include <algorithm>
#include <array>

namespace understory {
namespace {

constexpr double kLeastGain = 1e-9;  // so that rounding does not go round in circles
constexpr std::size_t kLongestMoved = 3;
constexpr std::size_t kKickedPlaces = 30;

// A tour that is made shorter step by step. Positions count from 0; before the first one is the
// beginning, after the last one nothing.
class Improver {
 public:
  Improver(const TourCosts& costs, Tour tour) : costs_(costs), tour_(std::move(tour)) {
    legs_.resize(tour_.size() + 1);
    measure_legs(0, tour_.size());
  }

  [[nodiscard]] const Tour& tour() const { return tour_; }

  void insert_cheapest(std::size_t place) {
    std::size_t best = 0;
    double least = detour(0, place);
    for (std::size_t at = 1; at <= tour_.size(); ++at) {
      const double cost = detour(at, place);
      if (cost < least) {
        least = cost;
        best = at;
      }
    }
    tour_.insert(tour_.begin() + static_cast<std::ptrdiff_t>(best), place);
    legs_.insert(legs_.begin() + static_cast<std::ptrdiff_t>(best), 0.0);
    measure_legs(best, best + 1);
  }

  // Until neither reversing a piece nor moving a short one helps, among the first `end` positions.
  void improve(std::size_t end) {
    std::size_t i = 0;
    std::size_t tried_in_vain = 0;
    while (tried_in_vain < end) {
      bool is_better = reverse_from(i, end);
      for (std::size_t length = 1; length <= kLongestMoved && i + length <= end; ++length) {
        is_better = move_from(i, length, end) || is_better;
      }
      tried_in_vain = is_better ? 0 : tried_in_vain + 1;
      i = i + 1 < end ? i + 1 : 0;
    }
  }

  // Swaps two neighbouring pieces at random.
  void kick(std::size_t end, Rng& rng) {
    std::array<std::size_t, 3> cuts{};
    for (std::size_t& cut : cuts) {
      cut = static_cast<std::size_t>(rng.below(end + 1));
    }
    std::sort(cuts.begin(), cuts.end());
    const auto at = [this](std::size_t position) {
      return tour_.begin() + static_cast<std::ptrdiff_t>(position);
    };
    std::rotate(at(cuts[0]), at(cuts[1]), at(cuts[2]));
    measure_legs(cuts[0], cuts[2]);
  }

 private:
  // The edge that leads to position `to` if `place` is there; none beyond the end. Asked for one
  // place and many positions, this stays in one row of the costs.
  [[nodiscard]] double edge(std::size_t to, std::size_t place) const {
    return to == 0 ? costs_.first(place) : costs_.between(place, tour_[to - 1]);
  }
  [[nodiscard]] double edge_from(std::size_t place, std::size_t to) const {
    return to < tour_.size() ? costs_.between(place, tour_[to]) : 0.0;
  }
  [[nodiscard]] double edge_at(std::size_t to) const { return legs_[to]; }
  // Those that lead to these positions, the last one included.
  void measure_legs(std::size_t first, std::size_t last) {
    for (std::size_t to = first; to <= last && to < tour_.size(); ++to) {
      legs_[to] = edge(to, tour_[to]);
    }
  }
  [[nodiscard]] double detour(std::size_t at, std::size_t place) const {
    return edge(at, place) + edge_from(place, at) - edge_at(at);
  }

  bool reverse_from(std::size_t i, std::size_t end) {
    // Costs are alike in both directions.
    const double* from_before = i == 0 ? costs_.first_row() : costs_.row(tour_[i - 1]);
    const double* from_head = costs_.row(tour_[i]);
    bool is_better = false;
    for (std::size_t j = i + 1; j < end; ++j) {
      const double before = edge_at(i) + edge_at(j + 1);
      const double onward = j + 1 < tour_.size() ? from_head[tour_[j + 1]] : 0.0;
      const double after = from_before[tour_[j]] + onward;
      if (after < before - kLeastGain) {
        std::reverse(tour_.begin() + static_cast<std::ptrdiff_t>(i),
                     tour_.begin() + static_cast<std::ptrdiff_t>(j + 1));
        measure_legs(i, j + 1);
        from_head = costs_.row(tour_[i]);
        is_better = true;
      }
    }
    return is_better;
  }

  // Where a piece goes.
  struct Place {
    std::size_t at;
    double cost;
    bool is_turned;
  };

  // The one of these positions where a piece, either way round, costs less than at `best`.
  [[nodiscard]] Place cheapest(
      std::size_t first, std::size_t last, std::size_t head, std::size_t tail, Place best) const {
    const double* from_head = costs_.row(head);
    const double* from_tail = costs_.row(tail);
    double to_head = edge(first, head);
    double to_tail = edge(first, tail);
    for (std::size_t at = first; at <= last; ++at) {
      const bool is_end = at == tour_.size();
      const double head_onward = is_end ? 0.0 : from_head[tour_[at]];
      const double tail_onward = is_end ? 0.0 : from_tail[tour_[at]];
      const double opened = edge_at(at);
      const double straight = to_head + tail_onward - opened;
      const double turned = to_tail + head_onward - opened;
      if (std::min(straight, turned) < best.cost) {
        best = {at, std::min(straight, turned), turned < straight};
      }
      to_head = head_onward;
      to_tail = tail_onward;
    }
    return best;
  }

  // Takes the piece out and puts it, either way round, where it costs least.
  bool move_from(std::size_t i, std::size_t length, std::size_t end) {
    const std::size_t next = i + length;
    const std::size_t head = tour_[i];
    const std::size_t tail = tour_[next - 1];
    const double closed = next < tour_.size() ? edge(i, tour_[next]) : 0.0;
    const double saved = edge_at(i) + edge_at(next) - closed;
    Place best{i, saved - kLeastGain, false};
    if (i > 0) {
      best = cheapest(0, i - 1, head, tail, best);
    }
    if (next < end) {
      best = cheapest(next + 1, end, head, tail, best);
    }
    const std::size_t best_at = best.at;
    const bool is_turned = best.is_turned;
    if (best_at == i) {
      return false;
    }
    const auto position = [this](std::size_t p) {
      return tour_.begin() + static_cast<std::ptrdiff_t>(p);
    };
    if (is_turned) {
      std::reverse(position(i), position(next));
    }
    if (best_at > next) {
      std::rotate(position(i), position(next), position(best_at));
    } else {
      std::rotate(position(best_at), position(i), position(next));
    }
    measure_legs(std::min(i, best_at), std::max(next, best_at));
    return true;
  }

  const TourCosts& costs_;
  Tour tour_;
  std::vector<double> legs_;  // edges that lead to each position; a last one, 0, beyond the end
};

}  // namespace

double cost_of(const TourCosts& costs, const Tour& tour) {
  double cost = tour.empty() ? 0.0 : costs.first(tour.front());
  for (std::size_t i = 1; i < tour.size(); ++i) {
    cost += costs.between(tour[i - 1], tour[i]);
  }
  return cost;
}

Tour short_open_tour(const TourCosts& costs, const Tour& hint, int kicks, Rng rng) {
  std::vector<bool> is_in(costs.places(), false);
  Tour begun;
  for (const std::size_t place : hint) {
    if (place < costs.places() && !is_in[place]) {
      is_in[place] = true;
      begun.push_back(place);
    }
  }
  Improver first(costs, std::move(begun));
  for (std::size_t place = 0; place < costs.places(); ++place) {
    if (!is_in[place]) {
      first.insert_cheapest(place);
    }
  }
  first.improve(costs.places());
  Tour best = first.tour();
  double least = cost_of(costs, best);
  const std::size_t end = std::min(costs.places(), kKickedPlaces);
  for (int i = 0; i < kicks; ++i) {
    Improver kicked(costs, best);
    kicked.kick(end, rng);
    kicked.improve(end);
    const double cost = cost_of(costs, kicked.tour());
    if (cost < least - kLeastGain) {
      least = cost;
      best = kicked.tour();
    }
  }
  return best;
}

}  // namespace understory
