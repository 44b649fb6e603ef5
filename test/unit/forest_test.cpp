// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/forest.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "understory/base/rng.hpp"
#include "understory/sim/trunk_index.hpp"

namespace understory {
namespace {

Box2d box(double x0, double y0, double x1, double y1) {
  return {Vector2d(x0, y0), Vector2d(x1, y1)};
}

// Overlapping trunks of very different sizes, as real stands have them.
Forest wild_forest(Rng& rng, int trunks, double half_m) {
  Forest forest;
  for (int i = 0; i < trunks; ++i) {
    const double x_m = rng.uniform(-half_m, half_m);
    const double y_m = rng.uniform(-half_m, half_m);
    forest.trunks.push_back({Vector2d(x_m, y_m), rng.uniform(0.02, 1.1)});
  }
  return forest;
}

double brute_distance_m(const Forest& forest, const Vector2d& point, double max_m) {
  double best_m = max_m;
  for (const Trunk& trunk : forest.trunks) {
    best_m = std::min(best_m, (trunk.center_m - point).norm() - trunk.radius_m);
  }
  return best_m;
}

TEST(Crop, KeepsExactlyTheTrunksWhoseDiscTouchesTheRectangle) {
  Forest forest;
  forest.trunk_height_m = 7.0;
  forest.trunks = {{Vector2d(5, 5), 0.2},           // inside
                   {Vector2d(-0.1, 5), 0.2},        // over the side
                   {Vector2d(-0.3, 5), 0.2},        // outside
                   {Vector2d(-0.1, -0.1), 0.15},    // over the corner
                   {Vector2d(-0.15, -0.15), 0.2}};  // bounding box over the corner, disc not

  const Forest kept = crop(forest, box(0, 0, 10, 10));

  ASSERT_EQ(kept.trunks.size(), 3U);
  EXPECT_EQ(kept.trunks[0].center_m, Vector2d(5, 5));
  EXPECT_EQ(kept.trunks[1].center_m, Vector2d(-0.1, 5));
  EXPECT_EQ(kept.trunks[2].center_m, Vector2d(-0.1, -0.1));
  EXPECT_EQ(kept.trunk_height_m, 7.0);
}

TEST(Crop, KeepsTheTrianglesThatTouchTheRectangle) {
  Forest forest;
  forest.meshes = {{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {20, 20, 0}, {21, 20, 0}, {20, 21, 0}},
                    {{0, 1, 2}, {3, 4, 5}}},
                   {{{20, 20, 0}, {21, 20, 0}, {20, 21, 0}}, {{0, 1, 2}}}};

  const Forest kept = crop(forest, box(0, 0, 10, 10));

  ASSERT_EQ(kept.meshes.size(), 1U);
  ASSERT_EQ(kept.meshes[0].triangles.size(), 1U);
  EXPECT_EQ(kept.meshes[0].triangles[0], (std::array<std::uint32_t, 3>{0, 1, 2}));
}

TEST(CenteredCrop, PutsTheRectanglesCentreAtTheOrigin) {
  Forest forest;
  forest.trunks = {{Vector2d(30, 40), 0.2}};
  forest.meshes = {{{{30, 40, 1}, {31, 40, 1}, {30, 41, 1}}, {{0, 1, 2}}}};

  const Forest scene = centered_crop(forest, box(20, 30, 60, 70));

  ASSERT_EQ(scene.trunks.size(), 1U);
  EXPECT_EQ(scene.trunks[0].center_m, Vector2d(-10, -10));
  EXPECT_EQ(scene.meshes.at(0).vertices_m[0], Eigen::Vector3f(-10, -10, 1));
}

TEST(TrunkIndex, AgreesWithBruteForceInsideAndOutsideTheForest) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    Rng rng(seed);
    const Forest forest = wild_forest(rng, 1 + static_cast<int>(rng.below(80)), 15.0);
    const TrunkIndex index(forest.trunks);

    for (int i = 0; i < 200; ++i) {
      const double x_m = rng.uniform(-30, 30);
      const Vector2d point(x_m, rng.uniform(-30, 30));
      const double max_m = rng.uniform(0.1, 20.0);

      ASSERT_NEAR(index.distance_m(point, max_m), brute_distance_m(forest, point, max_m), 1e-12)
          << "seed " << seed << ", point " << point.transpose() << ", max " << max_m;
    }
  }
}

TEST(TrunkIndex, StaysSmallAndRightWhenTwoTrunksAreFarApart) {
  const std::vector<Trunk> trunks = {{Vector2d(-1e5, -1e5), 0.1}, {Vector2d(1e5, 1e5), 5.0}};
  const TrunkIndex index(trunks);

  EXPECT_NEAR(index.distance_m({1e5, 1e5 - 6}, 100.0), 1.0, 1e-9);
  EXPECT_EQ(index.distance_m({0, 0}, 100.0), 100.0);
}

TEST(TrunkIndex, FindsTrunksInALineAsBruteForceDoes) {
  int touched = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    Rng rng(seed);
    const Forest forest = wild_forest(rng, 60, 15.0);
    const TrunkIndex index(forest.trunks);
    for (int i = 0; i < 500; ++i) {
      const Vector2d from(rng.uniform(-20, 20), rng.uniform(-20, 20));
      Vector2d to = from + Vector2d(rng.uniform(-12, 12), rng.uniform(-12, 12));
      if (i % 5 == 0) {
        to[i % 2] = from[i % 2];  // along the grid
      }

      const bool found = index.touches_line(from, to);

      const bool expected =
          std::any_of(forest.trunks.begin(), forest.trunks.end(), [&](const Trunk& trunk) {
            const Vector2d along = to - from;
            const double t =
                std::clamp((trunk.center_m - from).dot(along) / along.squaredNorm(), 0.0, 1.0);
            return (from + t * along - trunk.center_m).norm() <= trunk.radius_m;
          });
      ASSERT_EQ(found, expected) << "seed " << seed << ", line " << i;
      touched += found ? 1 : 0;
    }
  }
  EXPECT_GT(touched, 500);
  EXPECT_LT(touched, 4000);
}

TEST(TrunkIndex, ListsEveryTrunkThatTouchesARectangle) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    Rng rng(seed);
    const Forest forest = wild_forest(rng, 60, 10.0);
    const double x_m = rng.uniform(-12, 12);
    const double y_m = rng.uniform(-12, 12);
    const Box2d rectangle = box(x_m, y_m, x_m + rng.uniform(0.1, 8), y_m + rng.uniform(0.1, 8));

    std::vector<std::size_t> expected;
    for (std::size_t i = 0; i < forest.trunks.size(); ++i) {
      if (rectangle.exteriorDistance(forest.trunks[i].center_m) <= forest.trunks[i].radius_m) {
        expected.push_back(i);
      }
    }

    EXPECT_EQ(TrunkIndex(forest.trunks).touching(rectangle), expected) << "seed " << seed;
  }
}

TEST(NearestClearPoint, IsTheWishedPointItselfWhereThatIsClear) {
  Forest forest;
  forest.trunks = {{Vector2d(5, 0), 0.3}};

  EXPECT_EQ(nearest_clear_point(forest, box(-10, -10, 10, 10), {1, 2}, 1.0), Vector2d(1, 2));
}

TEST(NearestClearPoint, SlidesOffATrunkByTheShortestWay) {
  Forest forest;
  forest.trunks = {{Vector2d(0.5, 0), 0.3}};

  const std::optional<Vector2d> found =
      nearest_clear_point(forest, box(-10, -10, 10, 10), {0, 0}, 1.0);

  ASSERT_TRUE(found.has_value());
  EXPECT_NEAR(found->x(), -0.8, 1e-5);
  EXPECT_NEAR(found->y(), 0.0, 1e-5);
}

TEST(NearestClearPoint, KeepsTheClearanceToTheSidesOfTheBox) {
  const std::optional<Vector2d> found =
      nearest_clear_point(Forest{}, box(-10, -10, 10, 10), {50, 3}, 1.0);

  ASSERT_TRUE(found.has_value());
  EXPECT_EQ(*found, Vector2d(9, 3));
}

TEST(NearestClearPoint, IsMissingWhereNothingIsClear) {
  Forest forest;
  forest.trunks = {{Vector2d(0, 0), 2.0}};

  EXPECT_FALSE(nearest_clear_point(forest, box(-2, -2, 2, 2), {0, 0}, 1.0).has_value());
  EXPECT_FALSE(nearest_clear_point(Forest{}, box(-2, -2, 2, 2), {0, 0}, 2.5).has_value());
}

TEST(NearestClearPoint, IsClearAndNoFartherThanAnyPointOfAFineGrid) {
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    Rng rng(seed);
    const Forest forest = wild_forest(rng, 25, 8.0);
    const Box2d area = box(-8, -8, 8, 8);
    const double near_x_m = rng.uniform(-9, 9);
    const Vector2d near_m(near_x_m, rng.uniform(-9, 9));

    double best_m = 1e9;
    for (int column = -140; column <= 140; ++column) {
      for (int row = -140; row <= 140; ++row) {
        const Vector2d place_m = Vector2d(column, row) * 0.05;
        if (brute_distance_m(forest, place_m, 9.0) >= 1.0) {
          best_m = std::min(best_m, (place_m - near_m).norm());
        }
      }
    }
    const std::optional<Vector2d> found = nearest_clear_point(forest, area, near_m, 1.0);

    if (found.has_value()) {
      EXPECT_GE(brute_distance_m(forest, *found, 9.0), 1.0) << "seed " << seed;
      EXPECT_LE(found->cwiseAbs().maxCoeff(), 7.0) << "seed " << seed;
      EXPECT_LE((*found - near_m).norm(), best_m + 1e-5) << "seed " << seed;
    } else {
      EXPECT_EQ(best_m, 1e9) << "seed " << seed;
    }
  }
}

}  // namespace
}  // namespace understory
