// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/forest_generator.hpp"

#include <algorithm>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace understory {
namespace {

using testing::HasSubstr;

GeneratorConfig one_region(double half_m, double trees_per_m2) {
  GeneratorConfig config;
  config.regions = {{-half_m, -half_m, half_m, half_m, trees_per_m2}};
  return config;
}

std::string error_of(const GeneratorConfig& config) {
  try {
    (void)generate_forest(config, Rng(1));
  } catch (const ForestError& error) {
    return error.what();
  }
  return "no error";
}

TEST(ForestGenerator, KeepsEveryRuleOverManySeedsAndDensities) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const double density = 0.05 * static_cast<double>(1 + seed % 4);
    const GeneratorConfig config = one_region(25.0, density);

    const Forest forest = generate_forest(config, Rng(seed));

    ASSERT_EQ(forest.trunks.size(), std::llround(2500 * density)) << "seed " << seed;
    for (std::size_t i = 0; i < forest.trunks.size(); ++i) {
      const Trunk& trunk = forest.trunks[i];
      ASSERT_LE(trunk.center_m.cwiseAbs().maxCoeff(), 25.0) << "seed " << seed;
      ASSERT_GE(trunk.radius_m, 0.10) << "seed " << seed;
      ASSERT_LE(trunk.radius_m, 0.30) << "seed " << seed;
      ASSERT_GE(trunk.center_m.norm() - trunk.radius_m, 2.0 - 1e-12) << "seed " << seed;
      for (std::size_t j = 0; j < i; ++j) {
        const Trunk& other = forest.trunks[j];
        ASSERT_GE((trunk.center_m - other.center_m).norm() - trunk.radius_m - other.radius_m,
                  0.10 - 1e-12)
            << "seed " << seed << ", trunks " << i << " and " << j;
      }
    }
  }
}

TEST(ForestGenerator, SpreadsTrunksAndRadiiUniformly) {
  const Forest forest = generate_forest(one_region(100.0, 0.05), Rng(5));

  Vector2d mean = Vector2d::Zero();
  double mean_radius_m = 0.0;
  for (const Trunk& trunk : forest.trunks) {
    mean += trunk.center_m / static_cast<double>(forest.trunks.size());
    mean_radius_m += trunk.radius_m / static_cast<double>(forest.trunks.size());
  }

  EXPECT_NEAR(mean.x(), 0.0, 5.0);  // deviation of the mean: 1.3
  EXPECT_NEAR(mean.y(), 0.0, 5.0);
  EXPECT_NEAR(mean_radius_m, 0.20, 0.005);
}

TEST(ForestGenerator, GivesTheSameForestForTheSameSeedAndAnotherForAnother) {
  const GeneratorConfig config = one_region(10.0, 0.1);
  const Forest a = generate_forest(config, Rng(3));
  const Forest b = generate_forest(config, Rng(3));
  const Forest c = generate_forest(config, Rng(4));

  ASSERT_EQ(a.trunks.size(), b.trunks.size());
  for (std::size_t i = 0; i < a.trunks.size(); ++i) {
    EXPECT_EQ(a.trunks[i].center_m, b.trunks[i].center_m);
    EXPECT_EQ(a.trunks[i].radius_m, b.trunks[i].radius_m);
  }
  EXPECT_NE(a.trunks[0].center_m, c.trunks[0].center_m);
}

TEST(ForestGenerator, GivesEachRegionItsOwnDensityAnywhere) {
  GeneratorConfig config;
  config.starts = {{1010.0, -190.0}, {1050.0, -150.0}};
  config.regions = {{1000, -200, 1100, -150, 0.2}, {1000, -150, 1100, -100, 0.5}};

  const Forest forest = generate_forest(config, Rng(1));

  const auto south = std::count_if(forest.trunks.begin(),
                                   forest.trunks.begin() + 1000,
                                   [](const Trunk& trunk) { return trunk.center_m.y() <= -150.0; });
  ASSERT_EQ(forest.trunks.size(), 1000U + 2500U);
  EXPECT_EQ(south, 1000);
  for (const Trunk& trunk : forest.trunks) {
    for (const ForestStartConfig& start : config.starts) {
      EXPECT_GE((trunk.center_m - Vector2d(start.x_m, start.y_m)).norm() - trunk.radius_m,
                2.0 - 1e-12);
    }
  }
}

TEST(ForestGenerator, MakesTwentyThousandTrunksWithoutComparingAllPairs) {
  const Forest forest = generate_forest(one_region(160.0, 0.2), Rng(1));

  EXPECT_EQ(forest.trunks.size(), 20480U);
}

TEST(ForestGenerator, GivesUpOnAnImpossibleDensity) {
  EXPECT_THAT(error_of(one_region(10.0, 9.0)),
              AllOf(HasSubstr("regions[0].trees_per_m2"), HasSubstr("no room left")));
}

TEST(ForestGenerator, GivesUpWhenTheStartLeavesNoRoom) {
  EXPECT_THAT(error_of(one_region(1.0, 0.5)), HasSubstr("no room left after 0 of 2"));
}

TEST(ForestGenerator, NamesWhatIsWrong) {
  GeneratorConfig radii = one_region(10.0, 0.1);
  radii.min_radius_m = 0.5;
  EXPECT_THAT(error_of(radii), HasSubstr("min_radius_m"));

  GeneratorConfig gap = one_region(10.0, 0.1);
  gap.min_gap_m = -1.0;
  EXPECT_THAT(error_of(gap), HasSubstr("min_gap_m"));

  GeneratorConfig height = one_region(10.0, 0.1);
  height.trunk_height_m = 0.0;
  EXPECT_THAT(error_of(height), HasSubstr("trunk_height_m"));

  GeneratorConfig none = one_region(10.0, 0.1);
  none.regions.clear();
  EXPECT_THAT(error_of(none), HasSubstr("regions"));

  GeneratorConfig inverted = one_region(10.0, 0.1);
  inverted.regions.push_back({5, 0, 4, 1, 0.1});
  EXPECT_THAT(error_of(inverted), HasSubstr("regions[1]"));

  GeneratorConfig negative = one_region(10.0, -0.1);
  EXPECT_THAT(error_of(negative), HasSubstr("trees_per_m2"));

  GeneratorConfig endless = one_region(std::numeric_limits<double>::infinity(), 0.1);
  EXPECT_THAT(error_of(endless), HasSubstr("regions[0]"));

  GeneratorConfig nothing = one_region(10.0, std::numeric_limits<double>::quiet_NaN());
  EXPECT_THAT(error_of(nothing), HasSubstr("trees_per_m2"));

  EXPECT_THAT(error_of(one_region(10000.0, 1.0)), HasSubstr("2 million"));
}

}  // namespace
}  // namespace understory
