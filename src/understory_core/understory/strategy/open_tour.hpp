// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// In which order to visit places that are all to be visited once, beginning where one is and ending
// anywhere: an open travelling-salesman tour. Costs are of any unit, finite and not negative, alike
// in both directions between two places; only those from the beginning stand for themselves. Solved
// by cheapest insertion, then 2-opt (Croes 1958) and Or-opt (Or 1976) to a local optimum, then
// double bridges (Martin, Otto and Felten 1991) in the part that is flown next, of which the good
// ones are kept. Not proven to be the shortest; deterministic; one thread; nothing fails.
#pragma once

#include <cstddef>
#include <vector>

#include "understory/base/rng.hpp"

namespace understory {

class TourCosts {
 public:
  explicit TourCosts(std::size_t places) : places_(places), costs_(places * (places + 1), 0.0) {}

  [[nodiscard]] std::size_t places() const { return places_; }
  // From the beginning.
  [[nodiscard]] double first(std::size_t place) const { return costs_[place]; }
  [[nodiscard]] double between(std::size_t a, std::size_t b) const {
    return costs_[(a + 1) * places_ + b];
  }
  // All of those, by place.
  [[nodiscard]] const double* first_row() const { return costs_.data(); }
  [[nodiscard]] const double* row(std::size_t a) const { return &costs_[(a + 1) * places_]; }
  void set_first(std::size_t place, double cost) { costs_[place] = cost; }
  void set_between(std::size_t a, std::size_t b, double cost) {
    costs_[(a + 1) * places_ + b] = cost;
    costs_[(b + 1) * places_ + a] = cost;
  }

 private:
  std::size_t places_;
  std::vector<double> costs_;  // a row for the beginning, then one per place
};

// Places in the order of their visit.
using Tour = std::vector<std::size_t>;

[[nodiscard]] double cost_of(const TourCosts& costs, const Tour& tour);

// `hint`: some of the places in an order that was good before. The more kicks, the better.
[[nodiscard]] Tour short_open_tour(const TourCosts& costs, const Tour& hint, int kicks, Rng rng);

}  // namespace understory
