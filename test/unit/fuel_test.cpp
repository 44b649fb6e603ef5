// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/strategy/fuel.hpp"

#include <gtest/gtest.h>

#include "support/snapshot_builder.hpp"

namespace understory {
namespace {

using test::SnapshotBuilder;

const Box3d kBox(Vector3d(-12.0, -12.0, 0.0), Vector3d(12.0, 12.0, 2.0));
const Box3d kWall(Vector3d(0.9, -12.0, 0.0), Vector3d(1.1, 10.0, 2.0));
constexpr double kHeightM = 1.0;

struct FuelTest : public ::testing::Test {
  FuelTest() : builder(0.10, kBox) {
    builder.fill(VoxelState::kFree);
    input.map = &map;
    input.is_complete = true;
    input.vehicle.position_m = {0.0, 0.0, kHeightM};
  }

  // A cluster that is looked at from each of the views in turn, best first.
  void add(const std::vector<Vector2d>& views, double yaw_rad = 0.0) {
    Cluster cluster;
    cluster.id = ++clusters;
    cluster.mean_m = {views.front().x(), views.front().y(), kHeightM};
    for (const Vector2d& at : views) {
      const Vector3d position_m(at.x(), at.y(), kHeightM);
      const double coverage = cluster.viewpoints.empty() ? 1.0 : 0.9;
      cluster.viewpoints.push_back({RouteLattice::Node::Zero(), position_m, yaw_rad, coverage});
    }
    const auto shared = std::make_shared<const Cluster>(cluster);
    for (const Viewpoint& viewpoint : shared->viewpoints) {
      const double length_m = (viewpoint.position_m - input.vehicle.position_m).norm();
      input.candidates.push_back({shared, viewpoint, length_m});
    }
  }

  Candidate chosen() {
    map.update(builder.build());
    Fuel fuel(config, FuelRates{}, builder.geometry());
    return fuel.choose(input)->candidate;
  }

  SnapshotBuilder builder;
  ClearanceMap map;
  FuelConfig config;
  StrategyInput input;
  std::uint32_t clusters = 0;
};

TEST_F(FuelTest, WaitsForAllCandidatesAndKnowsWhenNoneAreLeft) {
  Fuel fuel(config, FuelRates{}, builder.geometry());
  EXPECT_FALSE(fuel.choose(input).has_value());
  add({{3, 0}});
  map.update(builder.build());
  input.is_complete = false;
  EXPECT_FALSE(fuel.choose(input).has_value());
  input.is_complete = true;

  EXPECT_EQ(fuel.choose(input)->candidate.cluster->id, 1U);
  EXPECT_EQ(fuel.choose(input)->mode, FlightMode::kExplorer);
}

// Greedy would take the nearest one and come back past it for the other end.
TEST_F(FuelTest, BeginsWithTheNearerEndOfALine) {
  add({{2, 0}});
  add({{-3, 0}});
  add({{4, 0}});
  add({{6, 0}});
  add({{8, 0}});

  EXPECT_EQ(chosen().cluster->id, 2U);
}

TEST_F(FuelTest, GoesOnTheWayItFlies) {
  add({{3, 0}});
  add({{-2.8, 0}});
  EXPECT_EQ(chosen().cluster->id, 2U);

  input.vehicle.velocity_mps = {1.5, 0.0, 0.0};

  EXPECT_EQ(chosen().cluster->id, 1U);
}

TEST_F(FuelTest, TurnsTheCameraNoFurtherThanItMust) {
  add({{1.0, 0}}, 3.1);
  const Cluster* behind = input.candidates.front().cluster.get();
  add({{-1.1, 0}}, 0.0);

  EXPECT_NE(chosen().cluster.get(), behind) << "half a turn takes 3.4 s";
}

// Two clusters are near each other as the crow flies, with a wall between.
TEST_F(FuelTest, MeasuresBetweenClustersAroundWalls) {
  builder.set_box(kWall, VoxelState::kOccupied);
  add({{0, 5}});
  add({{2, 5}});
  map.update(builder.build());
  ClusterLengths lengths(builder.geometry(), 0.3);
  const Cluster& a = *input.candidates[0].cluster;
  const Cluster& b = *input.candidates[1].cluster;

  lengths.update(map, {&a, &b});

  EXPECT_GT(lengths.between(0, 1), 10.0);
  EXPECT_LT(lengths.between(0, 1), 14.5);
  EXPECT_DOUBLE_EQ(lengths.between(0, 1), lengths.between(1, 0));
}

TEST_F(FuelTest, AssumesADetourWhereItKnowsNoWay) {
  builder.set_box({Vector3d(0.9, -12, 0), Vector3d(1.1, 12, 2)}, VoxelState::kOccupied);
  add({{0, 0}});
  add({{4, 0}});
  map.update(builder.build());
  ClusterLengths lengths(builder.geometry(), 0.3);
  const Cluster& a = *input.candidates[0].cluster;
  const Cluster& b = *input.candidates[1].cluster;

  lengths.update(map, {&a, &b});

  EXPECT_DOUBLE_EQ(lengths.between(0, 1), 15.0);
}

TEST_F(FuelTest, RemembersLengthsAsClustersComeAndGo) {
  for (int i = 0; i < 6; ++i) {
    add({{-10.0 + 3.0 * i, 0.5 * i * i}});
  }
  map.update(builder.build());
  std::vector<const Cluster*> all;
  for (const Candidate& candidate : input.candidates) {
    all.push_back(candidate.cluster.get());
  }
  const auto of = [&](const std::vector<std::size_t>& places) {
    std::vector<const Cluster*> chosen;
    for (const std::size_t place : places) {
      chosen.push_back(all[place]);
    }
    return chosen;
  };
  ClusterLengths lengths(builder.geometry(), 0.3);
  for (const std::vector<std::size_t>& places : {std::vector<std::size_t>{0, 1, 2},
                                                 {2, 3},
                                                 {0, 2, 3, 4, 5},
                                                 {1, 4, 5},
                                                 {5, 4, 3, 2, 1, 0}}) {
    ClusterLengths anew(builder.geometry(), 0.3);

    lengths.update(map, of(places));
    anew.update(map, of(places));

    for (std::size_t a = 0; a < places.size(); ++a) {
      for (std::size_t b = 0; b < places.size(); ++b) {
        EXPECT_NEAR(lengths.between(a, b), anew.between(a, b), 0.5)
            << places[a] << " " << places[b];
      }
    }
  }
}

TEST_F(FuelTest, TakesOfTheNextClusterTheViewThatTheRestOfTheTourLikesBest) {
  add({{2.0, 1.5}, {2.0, -1.5}});
  add({{4.0, -3.0}});
  add({{7.0, -5.0}});

  const Candidate target = chosen();

  EXPECT_EQ(target.cluster->id, 1U);
  EXPECT_DOUBLE_EQ(target.viewpoint.position_m.y(), -1.5);
}

TEST_F(FuelTest, LeavesViewsThatSeeMuchLessThanTheBest) {
  config.least_view_share = 0.95;
  add({{2.0, 1.5}, {2.0, -1.5}});
  add({{4.0, -3.0}});

  EXPECT_DOUBLE_EQ(chosen().viewpoint.position_m.y(), 1.5);
}

TEST_F(FuelTest, AnswersTheSameWithAndWithoutAMemoryOfIt) {
  Rng rng(3);
  for (int i = 0; i < 40; ++i) {
    add({{rng.uniform(-11.0, 11.0), rng.uniform(-11.0, 11.0)}});
  }
  map.update(builder.build());
  Fuel fuel(config, FuelRates{}, builder.geometry());
  const std::uint32_t first = fuel.choose(input)->candidate.cluster->id;

  EXPECT_EQ(fuel.choose(input)->candidate.cluster->id, first);
  EXPECT_EQ(chosen().cluster->id, first);
}

}  // namespace
}  // namespace understory
