// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/strategy/open_tour.hpp"

#include <algorithm>
#include <numeric>

#include <gtest/gtest.h>

#include "understory/base/geometry.hpp"

namespace understory {
namespace {

constexpr int kKicks = 100;

struct Places {
  Vector2d start = Vector2d::Zero();
  std::vector<Vector2d> at;

  [[nodiscard]] TourCosts costs() const {
    TourCosts costs(at.size());
    for (std::size_t a = 0; a < at.size(); ++a) {
      costs.set_first(a, (at[a] - start).norm());
      for (std::size_t b = 0; b < a; ++b) {
        costs.set_between(a, b, (at[a] - at[b]).norm());
      }
    }
    return costs;
  }
};

Places random_places(std::size_t count, Rng& rng) {
  Places places;
  for (std::size_t i = 0; i < count; ++i) {
    places.at.emplace_back(rng.uniform(-20.0, 20.0), rng.uniform(-20.0, 20.0));
  }
  return places;
}

Tour in_a_row(std::size_t count) {
  Tour tour(count);
  std::iota(tour.begin(), tour.end(), std::size_t{0});
  return tour;
}

double least_cost_of_all(const TourCosts& costs) {
  Tour tour = in_a_row(costs.places());
  double least = cost_of(costs, tour);
  while (std::next_permutation(tour.begin(), tour.end())) {
    least = std::min(least, cost_of(costs, tour));
  }
  return least;
}

bool visits_all_once(Tour tour, std::size_t count) {
  std::sort(tour.begin(), tour.end());
  return tour == in_a_row(count);
}

TEST(OpenTour, OfNothingIsEmptyAndOfOnePlaceGoesThere) {
  EXPECT_TRUE(short_open_tour(TourCosts(0), {}, kKicks, Rng(1)).empty());
  EXPECT_EQ(short_open_tour(TourCosts(1), {}, kKicks, Rng(1)), Tour{0});
}

TEST(OpenTour, AlongALineGoesToTheNearerEndFirst) {
  Places places;
  places.at = {{8, 0}, {2, 0}, {-1, 0}, {4, 0}, {6, 0}};

  EXPECT_EQ(short_open_tour(places.costs(), {}, kKicks, Rng(1)), (Tour{2, 1, 3, 4, 0}));
}

TEST(OpenTour, IsTheShortestOfAllForAFewPlaces) {
  Rng rng(5);
  for (int i = 0; i < 60; ++i) {
    const Places places = random_places(1 + rng.below(8), rng);
    const TourCosts costs = places.costs();

    const Tour tour = short_open_tour(costs, {}, kKicks, Rng(1));

    ASSERT_TRUE(visits_all_once(tour, places.at.size()));
    ASSERT_NEAR(cost_of(costs, tour), least_cost_of_all(costs), 1e-9) << i;
  }
}

// A trick of the beginning: what is near may be a bad first place all the same.
TEST(OpenTour, HeedsTheCostsOfTheBeginning) {
  Places places;
  places.at = {{-5, 0}, {5, 0}, {9, 6}};
  TourCosts costs = places.costs();
  costs.set_first(0, 100.0);

  EXPECT_EQ(short_open_tour(costs, {}, kKicks, Rng(1)), (Tour{1, 2, 0}));
}

TEST(OpenTour, IsNeverLongerThanTheHintWhateverIsInIt) {
  Rng rng(6);
  for (int i = 0; i < 50; ++i) {
    const Places places = random_places(40, rng);
    const TourCosts costs = places.costs();
    const Tour hint = short_open_tour(costs, {}, 5, Rng(static_cast<std::uint64_t>(i)));
    Tour strange = hint;
    strange.insert(strange.begin(), {hint.front(), 1000});

    EXPECT_LE(cost_of(costs, short_open_tour(costs, hint, 0, Rng(1))), cost_of(costs, hint) + 1e-9);
    EXPECT_TRUE(visits_all_once(short_open_tour(costs, strange, 3, Rng(1)), 40));
  }
}

TEST(OpenTour, MoreKicksDoNotMakeItLonger) {
  Rng rng(7);
  for (int i = 0; i < 20; ++i) {
    const TourCosts costs = random_places(60, rng).costs();
    const double plain = cost_of(costs, short_open_tour(costs, {}, 0, Rng(1)));

    EXPECT_LE(cost_of(costs, short_open_tour(costs, {}, 200, Rng(1))), plain + 1e-9);
  }
}

TEST(OpenTour, TheSameSeedGivesTheSameTour) {
  Rng rng(8);
  const TourCosts costs = random_places(100, rng).costs();

  EXPECT_EQ(short_open_tour(costs, {}, kKicks, Rng(3)), short_open_tour(costs, {}, kKicks, Rng(3)));
}

}  // namespace
}  // namespace understory
