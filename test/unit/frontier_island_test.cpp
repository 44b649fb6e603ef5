// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <set>

#include <gtest/gtest.h>

#include "support/frontier_bench.hpp"

namespace understory {
namespace {

using test::SnapshotBuilder;
using Bench = test::FrontierBench;
using test::kFrontierBox;

TEST(FrontierFinder, KeepsApartWhatBordersAnIslandTooSmallToVisit) {
  SnapshotBuilder builder(0.10, kFrontierBox);
  builder.fill(VoxelState::kFree);
  builder.set_box({Vector3d(-0.5, -0.5, 0.5), Vector3d(0.5, 0.5, 1.5)}, VoxelState::kUnknown);
  FrontierConfig config;
  config.min_cluster_voxels = 10;
  config.min_island_m3 = 0.5;
  Bench wanted(builder, config);
  config.min_island_m3 = 2.0;
  Bench unwanted(builder, config);

  EXPECT_FALSE(wanted.update(builder).empty());
  EXPECT_TRUE(wanted.finder.worthless().empty());
  EXPECT_TRUE(unwanted.update(builder).empty());
  EXPECT_EQ(unwanted.finder.worthless().size(), wanted.finder.clusters().size());
}

// Cubes of unknown space, their sizes in cubic metres, with free space around.
std::vector<double> islands_worth_a_visit(const FrontierConfig& config) {
  SnapshotBuilder builder(0.10, kFrontierBox);
  builder.fill(VoxelState::kFree);
  double x_m = -4.0;
  for (const double edge_m : {0.8, 0.9, 1.0, 1.1}) {
    const Vector3d low_m(x_m, -0.5, 0.5);
    builder.set_box({low_m, low_m + Vector3d::Constant(edge_m)}, VoxelState::kUnknown);
    x_m += 2.0;
  }
  Bench bench(builder, config);
  std::set<double> sizes_m3;
  for (const ClusterPtr& cluster : bench.update(builder)) {
    sizes_m3.insert(std::round(1000.0 * *cluster->island_m3) / 1000.0);
  }
  return {sizes_m3.begin(), sizes_m3.end()};
}

TEST(FrontierFinder, LeavesTheSmallestIslandsUntilEnoughAreLeft) {
  FrontierConfig config;
  config.min_cluster_voxels = 10;
  config.max_cluster_length_m = 10.0;  // a cluster for each island
  config.min_island_m3 = 0.6;
  config.max_island_m3 = 1.2;
  const double known_m3 = kFrontierBox.volume() - (0.512 + 0.729 + 1.0 + 1.331);

  config.max_left_share = 1.0;
  EXPECT_EQ(islands_worth_a_visit(config), (std::vector<double>{1.331}));
  config.max_left_share = (0.512 + 0.729 + 0.1) / known_m3;
  EXPECT_EQ(islands_worth_a_visit(config), (std::vector<double>{1.0, 1.331}));
  config.max_left_share = (0.512 + 0.729 - 0.1) / known_m3;
  EXPECT_EQ(islands_worth_a_visit(config), (std::vector<double>{0.729, 1.0, 1.331}));
  config.trunk_in_island_m3 = 0.1;
  EXPECT_EQ(islands_worth_a_visit(config), (std::vector<double>{1.0, 1.331}));
  config.max_left_share = 0.0;
  EXPECT_EQ(islands_worth_a_visit(config), (std::vector<double>{0.729, 1.0, 1.331}));
}

TEST(FrontierFinder, LeavesNoIslandThatIsALargePartOfTheBox) {
  FrontierConfig config;
  config.min_cluster_voxels = 10;
  config.min_island_m3 = 2.0;
  config.max_island_share = 0.6 / kFrontierBox.volume();

  EXPECT_EQ(islands_worth_a_visit(config), (std::vector<double>{0.729, 1.0, 1.331}));
}

TEST(FrontierFinder, HasMoreRoomForIslandsTheMoreIsKnown) {
  SnapshotBuilder builder(0.10, kFrontierBox);
  builder.set_box({Vector3d(-3, -3, 0), Vector3d(0, 0, 2)}, VoxelState::kFree);
  builder.set_box({Vector3d(-2, -2, 0.5), Vector3d(-1, -1, 1.5)}, VoxelState::kUnknown);
  FrontierConfig config;
  config.max_island_m3 = 1.5;
  config.max_left_share = 0.01;
  config.trails.max_component_m3 = 2.0;
  Bench bench(builder, config);
  bench.update(builder);
  EXPECT_TRUE(bench.finder.worthless().empty());

  builder.fill(VoxelState::kFree);
  builder.set_box({Vector3d(-2, -2, 0.5), Vector3d(-1, -1, 1.5)}, VoxelState::kUnknown);
  bench.update(builder);

  EXPECT_TRUE(bench.finder.clusters().empty());
  EXPECT_FALSE(bench.finder.worthless().empty());
}

}  // namespace
}  // namespace understory
