// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <set>

#include <gtest/gtest.h>

#include "support/frontier_bench.hpp"
#include "support/snapshot_builder.hpp"
#include "understory/frontier/clustering.hpp"
#include "understory/frontier/trail_label.hpp"

namespace understory {
namespace {

using test::SnapshotBuilder;
using Bench = test::FrontierBench;
using test::kFrontierBox;

bool is_frontier_by_definition(const MapSnapshot& map, const VoxelIndex& voxel) {
  if (!map.is_free(voxel)) {
    return false;
  }
  for (int axis = 0; axis < 3; ++axis) {
    for (const int side : {-1, 1}) {
      VoxelIndex neighbour = voxel;
      neighbour[axis] += side;
      if (map.geometry.contains(neighbour) && !map.is_known(neighbour)) {
        return true;
      }
    }
  }
  return false;
}

TEST(FrontierField, AgreesWithTheDefinitionAfterRandomChanges) {
  Rng rng(11);
  const Box3d box(Vector3d(-2.3, -1.7, 0.0), Vector3d(2.1, 2.9, 2.0));
  SnapshotBuilder builder(0.10, box);
  FrontierField field(builder.geometry());
  std::set<std::array<int, 3>> tracked;

  for (int round = 0; round < 12; ++round) {
    const Vector3d center(rng.uniform(-2, 2), rng.uniform(-2, 2), rng.uniform(0, 2));
    builder.set_ball(center,
                     rng.uniform(0.2, 1.0),
                     rng.uniform() < 0.7 ? VoxelState::kFree : VoxelState::kOccupied);
    const MapSnapshotPtr map = builder.build();
    const FrontierField::Change change = field.update(map);
    for (const VoxelIndex& voxel : change.removed) {
      ASSERT_EQ(tracked.erase({voxel.x(), voxel.y(), voxel.z()}), 1U);
    }
    for (const VoxelIndex& voxel : change.added) {
      ASSERT_TRUE(tracked.insert({voxel.x(), voxel.y(), voxel.z()}).second);
    }

    const VoxelBox& all = map->geometry.voxels();
    for (int z = all.min.z(); z < all.end.z(); ++z) {
      for (int y = all.min.y(); y < all.end.y(); ++y) {
        for (int x = all.min.x(); x < all.end.x(); ++x) {
          const bool expected = is_frontier_by_definition(*map, {x, y, z});
          ASSERT_EQ(field.contains({x, y, z}), expected) << x << " " << y << " " << z;
          ASSERT_EQ(tracked.count({x, y, z}) == 1, expected);
        }
      }
    }
  }
}

TEST(FrontierFinder, EveryFrontierVoxelOfAnIslandBelongsToOneCluster) {
  SnapshotBuilder builder(0.10, kFrontierBox);
  builder.fill(VoxelState::kFree)
      .set_box({Vector3d(1, 1, 0), Vector3d(2, 2, 2)}, VoxelState::kUnknown);
  Bench bench(builder);

  const std::vector<ClusterPtr>& clusters = bench.update(builder);

  std::set<std::array<int, 3>> seen;
  std::size_t total = 0;
  for (const ClusterPtr& cluster : clusters) {
    for (const VoxelIndex& voxel : cluster->voxels) {
      EXPECT_TRUE(is_frontier_by_definition(*bench.snapshot, voxel));
      seen.insert({voxel.x(), voxel.y(), voxel.z()});
      ++total;
    }
  }
  EXPECT_EQ(seen.size(), total);
  EXPECT_EQ(total, 4U * 10U * 20U);  // four faces of 10 x 20 voxels, corners have no face neighbour
}

TEST(FrontierFinder, ClustersAreAtMostAsLongAsConfigured) {
  SnapshotBuilder builder(0.10, kFrontierBox);
  builder.fill(VoxelState::kUnknown)
      .set_box({Vector3d(-6, -6, 0), Vector3d(6, 0, 2)}, VoxelState::kFree);
  Bench bench(builder);

  const std::vector<ClusterPtr>& clusters = bench.update(builder);

  ASSERT_GE(clusters.size(), 6U);
  for (const ClusterPtr& cluster : clusters) {
    EXPECT_LE(cluster->bounds_m.sizes().head<2>().norm(), 2.0 + 1e-9);
  }
}

TEST(FrontierFinder, IncrementalUpdateFindsTheSameFrontierAsAFreshOne) {
  Rng rng(5);
  SnapshotBuilder builder(0.10, kFrontierBox);
  Bench incremental(builder);
  for (int round = 0; round < 10; ++round) {
    builder.set_ball(
        {rng.uniform(-5, 5), rng.uniform(-5, 5), 1.0}, rng.uniform(0.8, 2.0), VoxelState::kFree);
    incremental.update(builder);
  }
  FrontierConfig all_sizes;
  all_sizes.min_cluster_voxels = 1;
  Bench fresh(builder, all_sizes);

  const auto count = [](const std::vector<ClusterPtr>& clusters) {
    std::size_t voxels = 0;
    for (const ClusterPtr& cluster : clusters) {
      voxels += cluster->voxels.size();
    }
    return voxels;
  };
  const std::size_t in_fresh = count(fresh.update(builder));
  const std::size_t in_incremental = count(incremental.update(builder));

  EXPECT_LE(in_incremental, in_fresh);
  EXPECT_GE(static_cast<double>(in_incremental), 0.95 * static_cast<double>(in_fresh));
}

TEST(FrontierFinder, ViewpointsAreClearAndSeeTheirCluster) {
  SnapshotBuilder builder(0.10, kFrontierBox);
  builder.fill(VoxelState::kFree)
      .set_box({Vector3d(1, 1, 0), Vector3d(2, 2, 2)}, VoxelState::kUnknown)
      .set_cylinder({0.0, 1.5}, 0.2, VoxelState::kOccupied);
  Bench bench(builder);

  const std::vector<ClusterPtr>& clusters = bench.update(builder);

  ASSERT_FALSE(clusters.empty());
  for (const ClusterPtr& cluster : clusters) {
    ASSERT_FALSE(cluster->is_dormant());
    for (const Viewpoint& viewpoint : cluster->viewpoints) {
      EXPECT_TRUE(bench.clearance.clearance_at_least(viewpoint.position_m, 0.28));
      const Vector3d ray = cluster->mean_m - viewpoint.position_m;
      EXPECT_LE(ray.head<2>().norm(), 2.5 + 0.3);
      EXPECT_LE(std::abs(angle_difference(std::atan2(ray.y(), ray.x()), viewpoint.yaw_rad)), 0.9);
      EXPECT_GE(viewpoint.coverage, 0.15);
    }
    EXPECT_TRUE(std::is_sorted(
        cluster->viewpoints.begin(),
        cluster->viewpoints.end(),
        [](const Viewpoint& a, const Viewpoint& b) { return a.coverage > b.coverage; }));
  }
}

TEST(FrontierFinder, FewViewpointsKeptAreTheBestOfMany) {
  Rng rng(3);
  test::RandomForest forest;
  SnapshotBuilder builder = random_forest(forest, rng);
  builder.set_box({Vector3d(-1.0, -1.0, 0.0), Vector3d(1.5, 1.0, 2.0)}, VoxelState::kUnknown);
  FrontierConfig many;
  many.viewpoints.max_kept = 100;
  FrontierConfig few = many;
  few.viewpoints.max_kept = 4;

  Bench all(builder, many);
  Bench best(builder, few);
  const std::vector<ClusterPtr>& from_all = all.update(builder);
  const std::vector<ClusterPtr>& from_best = best.update(builder);

  ASSERT_EQ(from_best.size(), from_all.size());
  std::size_t compared = 0;
  for (std::size_t i = 0; i < from_all.size(); ++i) {
    const std::vector<Viewpoint>& expected = from_all[i]->viewpoints;
    const std::vector<Viewpoint>& kept = from_best[i]->viewpoints;
    ASSERT_EQ(kept.size(), std::min<std::size_t>(expected.size(), 4));
    for (std::size_t rank = 0; rank < kept.size(); ++rank) {
      EXPECT_EQ(kept[rank].node, expected[rank].node);
      EXPECT_EQ(kept[rank].coverage, expected[rank].coverage);
      ++compared;
    }
  }
  EXPECT_GT(compared, 8U);
}

TEST(FrontierFinder, ClusterWithoutViewpointIsDormantAndWakesWhenTheMapNearItChanges) {
  SnapshotBuilder builder(0.10, kFrontierBox);
  builder.fill(VoxelState::kOccupied)
      .set_box({Vector3d(-3, -0.5, 0), Vector3d(0, 0.5, 2)}, VoxelState::kFree)
      .set_box({Vector3d(-3, -0.1, 0), Vector3d(0, 0.1, 2)}, VoxelState::kFree)
      .set_box({Vector3d(-3, -0.5, 0), Vector3d(0, -0.1, 2)}, VoxelState::kOccupied)
      .set_box({Vector3d(-3, 0.1, 0), Vector3d(0, 0.5, 2)}, VoxelState::kOccupied)
      .set_box({Vector3d(0, -0.5, 0), Vector3d(0.5, 0.5, 2)}, VoxelState::kUnknown);
  FrontierConfig config;
  config.min_cluster_voxels = 10;
  Bench bench(builder, config);

  ASSERT_EQ(bench.update(builder).size(), 1U);
  EXPECT_TRUE(bench.finder.clusters()[0]->is_dormant());
  builder.set_box({Vector3d(-3, -1.5, 0), Vector3d(0, 1.5, 2)}, VoxelState::kFree);
  bench.update(builder);

  ASSERT_FALSE(bench.finder.clusters().empty());
  EXPECT_FALSE(bench.finder.clusters()[0]->is_dormant());
}

TEST(FrontierFinder, ClusterCountsAsSeenAfterAFifthOfItIsGone) {
  SnapshotBuilder builder(0.10, kFrontierBox);
  builder.fill(VoxelState::kFree)
      .set_box({Vector3d(1, 1, 0), Vector3d(2, 2, 2)}, VoxelState::kUnknown);
  Bench bench(builder);
  const ClusterPtr cluster = bench.update(builder)[0];
  EXPECT_FALSE(bench.finder.is_seen(*cluster));

  builder.set_box({Vector3d(1, 1, 0), Vector3d(2, 2, 1)}, VoxelState::kFree);
  bench.update(builder);

  EXPECT_TRUE(bench.finder.is_seen(*cluster));
}

MapSnapshotPtr room_with_pillar(SnapshotBuilder& builder, double angle_rad) {
  builder.fill(VoxelState::kFree);
  const Vector2d along(std::cos(angle_rad), std::sin(angle_rad));
  for (int step = -12; step <= 12; ++step) {
    builder.set_cylinder(0.05 * step * along, 0.15, VoxelState::kUnknown);
  }
  return builder.build();
}

TEST(TrailLabel, ClusterSurroundedByFreeSpaceIsATrail) {
  SnapshotBuilder builder(0.10, kFrontierBox);
  builder.fill(VoxelState::kFree)
      .set_box({Vector3d(1, 1, 0), Vector3d(1.6, 1.6, 2)}, VoxelState::kUnknown);
  Bench bench(builder);

  for (const ClusterPtr& cluster : bench.update(builder)) {
    EXPECT_EQ(cluster->label, ClusterLabel::kTrail);
  }
}

TEST(TrailLabel, BorderOfALargeUnknownRegionIsAFrontier) {
  SnapshotBuilder builder(0.10, kFrontierBox);
  builder.fill(VoxelState::kUnknown)
      .set_box({Vector3d(-6, -6, 0), Vector3d(6, 0, 2)}, VoxelState::kFree);
  Bench bench(builder);

  std::size_t frontiers = 0;
  for (const ClusterPtr& cluster : bench.update(builder)) {
    EXPECT_FALSE(surroundings_of(*bench.snapshot, *cluster, TrailConfig{}).is_free_all_around);
    frontiers += cluster->is_trail() ? 0U : 1U;
  }
  // The two at the ends have one neighbour each, so they are trails (paper, III-A).
  EXPECT_EQ(frontiers, bench.finder.clusters().size() - 2);
}

TEST(TrailLabel, DoesNotDependOnTheMapsAxes) {
  for (const double angle_rad : {0.0, 0.3, 0.785, 1.2, 1.571, 2.4}) {
    SnapshotBuilder builder(0.10, kFrontierBox);
    const MapSnapshotPtr map = room_with_pillar(builder, angle_rad);
    std::vector<VoxelIndex> voxels;
    const VoxelBox& all = map->geometry.voxels();
    for (int y = all.min.y(); y < all.end.y(); ++y) {
      for (int x = all.min.x(); x < all.end.x(); ++x) {
        for (int z = all.min.z(); z < all.end.z(); ++z) {
          if (is_frontier_by_definition(*map, {x, y, z})) {
            voxels.emplace_back(x, y, z);
          }
        }
      }
    }
    const Cluster cluster = make_cluster(std::move(voxels), map->geometry);

    EXPECT_TRUE(surroundings_of(*map, cluster, TrailConfig{}).is_free_all_around) << angle_rad;
  }
}

TEST(TrailLabel, IslandBesideForeignUnknownSpaceIsNotSurrounded) {
  SnapshotBuilder builder(0.10, kFrontierBox);
  builder.fill(VoxelState::kFree)
      .set_box({Vector3d(0, 0, 0), Vector3d(0.5, 0.5, 2)}, VoxelState::kUnknown)
      .set_box({Vector3d(-6, -6, 0), Vector3d(-0.3, 6, 2)}, VoxelState::kUnknown);
  const MapSnapshotPtr map = builder.build();
  std::vector<VoxelIndex> voxels;
  for (int z = 0; z < 20; ++z) {
    for (int y = 0; y < 5; ++y) {
      voxels.emplace_back(-1, y, z);
    }
  }

  EXPECT_FALSE(
      surroundings_of(*map, make_cluster(voxels, map->geometry), TrailConfig{}).is_free_all_around);
}

TEST(ConvexHull, DistanceIsZeroInsideAndEuclideanOutside) {
  const std::vector<Vector2d> hull =
      convex_hull({{0, 0}, {4, 0}, {4, 2}, {0, 2}, {1, 1}, {2, 0}, {2, 2}, {4, 1}});

  EXPECT_EQ(hull.size(), 4U);
  EXPECT_DOUBLE_EQ(distance_to_convex_polygon(hull, {1, 1}), 0.0);
  EXPECT_DOUBLE_EQ(distance_to_convex_polygon(hull, {7, 6}), 5.0);
  EXPECT_DOUBLE_EQ(distance_to_convex_polygon({{1, 1}}, {1, 3}), 2.0);
}

}  // namespace
}  // namespace understory
