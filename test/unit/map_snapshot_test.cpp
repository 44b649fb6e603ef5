// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "support/map_checks.hpp"
#include "support/synthetic_scene.hpp"
#include "understory/map/mapper.hpp"

namespace understory {
namespace {

Box3d room() {
  return {Vector3d(-2.0, -3.0, 0.0), Vector3d(6.0, 3.0, 2.0)};
}

void shoot(Mapper& mapper, const Eigen::Vector3f& point, Time stamp = Time{}) {
  (void)mapper.integrate_rays(
      {point.data(), 3, 1}, level_pose({0.05, 0.05, 1.05}, 0.0), 4.5, stamp);
}

TEST(MapSnapshot, OldSnapshotNeverChangesWhileTheMapperGoesOn) {
  Mapper mapper(MapConfig{}, room());
  shoot(mapper, {2.0F, 0.0F, 0.0F});
  const MapSnapshotPtr old = mapper.publish();
  std::vector<Tile> tiles_before;
  for (const TilePtr& tile : old->tiles) {
    tiles_before.push_back(tile ? *tile : Tile());
  }

  for (int i = 0; i < 10; ++i) {
    shoot(mapper, {2.0F, 0.1F * static_cast<float>(i), 0.3F});
    mapper.mark_free(room(), Time{});
    (void)mapper.publish();
  }

  for (TileSlot slot = 0; slot < old->tiles.size(); ++slot) {
    const Tile now = old->tiles[slot] ? *old->tiles[slot] : Tile();
    EXPECT_EQ(now.log_odds, tiles_before[slot].log_odds);
    EXPECT_EQ(now.free_rows, tiles_before[slot].free_rows);
    EXPECT_EQ(now.known_rows, tiles_before[slot].known_rows);
  }
}

TEST(MapSnapshot, ChangedTilesAreExactlyThoseTheRayTouched) {
  Mapper mapper(MapConfig{}, room());

  shoot(mapper, {2.0F, 0.0F, 0.0F});
  const MapSnapshotPtr map = mapper.publish();

  const GridGeometry& geometry = map->geometry;
  const std::vector<TileSlot> expected{geometry.slot_of({0, 0, 10}), geometry.slot_of({16, 0, 10})};
  EXPECT_EQ(map->changed_tiles, expected);
  EXPECT_EQ(tiles_changed_between(nullptr, *map), expected);
}

TEST(MapSnapshot, TilesWhoseVoxelsAreAllAtTheClampAreNotTouchedAgain) {
  Mapper mapper(MapConfig{}, room());
  for (int i = 0; i < 10; ++i) {
    shoot(mapper, {2.0F, 0.0F, 0.0F});
  }
  const MapSnapshotPtr saturated = mapper.publish();

  shoot(mapper, {2.0F, 0.0F, 0.0F});
  const MapSnapshotPtr after = mapper.publish();

  EXPECT_TRUE(after->changed_tiles.empty());
  EXPECT_EQ(after->tiles, saturated->tiles);
}

TEST(MapSnapshot, UntouchedTilesAreSharedBetweenSnapshots) {
  Mapper mapper(MapConfig{}, room());
  shoot(mapper, {2.0F, 0.0F, 0.0F});
  const MapSnapshotPtr first = mapper.publish();

  shoot(mapper, {-1.0F, 0.0F, 0.0F});  // clears its own voxel's tile again and the one behind
  const MapSnapshotPtr second = mapper.publish();

  const TileSlot ahead = first->geometry.slot_of({16, 0, 10});
  EXPECT_EQ(second->tiles[ahead], first->tiles[ahead]);
  EXPECT_EQ(second->changed_tiles, tiles_changed_between(first.get(), *second));
  EXPECT_EQ(second->changed_tiles.size(), 2U);
}

TEST(MapSnapshot, RevisionGrowsByOneAndStampIsThatOfTheNewestCloud) {
  Mapper mapper(MapConfig{}, room());
  const Time newest{std::chrono::seconds(7)};

  shoot(mapper, {2.0F, 0.0F, 0.0F}, newest);
  const MapSnapshotPtr first = mapper.publish();
  shoot(mapper, {2.0F, 0.0F, 0.0F}, Time{std::chrono::seconds(3)});
  const MapSnapshotPtr second = mapper.publish();

  EXPECT_EQ(first->revision, 1U);
  EXPECT_EQ(second->revision, 2U);
  EXPECT_EQ(first->stamp, newest);
  EXPECT_EQ(second->stamp, newest);
}

TEST(MapSnapshot, OutsideTheBoxNothingIsFreeOrKnown) {
  Mapper mapper(MapConfig{}, room());
  mapper.mark_free({Vector3d::Constant(-100.0), Vector3d::Constant(100.0)}, Time{});

  const MapSnapshotPtr map = mapper.publish();

  EXPECT_TRUE(map->is_free({-20, -30, 0}));
  EXPECT_FALSE(map->is_free({-21, -30, 0}));
  EXPECT_FALSE(map->is_known({0, 0, 20}));
  EXPECT_EQ(map->state({0, 0, -1}), VoxelState::kUnknown);
  EXPECT_EQ(test::inconsistent_voxels(*map), 0U);
}

TEST(MarkFree, ClearsVoxelsWhoseCentresLieInTheRegionButNoReturns) {
  Mapper mapper(MapConfig{}, room());
  shoot(mapper, {0.5F, 0.0F, 0.0F});

  mapper.mark_free({Vector3d(0.26, 0.0, 1.0), Vector3d(0.84, 0.1, 1.1)}, Time{});
  const MapSnapshotPtr map = mapper.publish();

  const auto log_odds = [&](double x_m) {
    return test::log_odds_at(*map, map->geometry.index_of({x_m, 0.05, 1.05}));
  };
  EXPECT_EQ(log_odds(0.25), map->sensor_model.miss);  // centre just outside
  EXPECT_EQ(log_odds(0.35), map->sensor_model.min);
  EXPECT_EQ(log_odds(0.55), map->sensor_model.hit);  // the return stays
  EXPECT_EQ(log_odds(0.75), map->sensor_model.min);
  EXPECT_FALSE(map->is_known(map->geometry.index_of({0.85, 0.05, 1.05})));
}

TEST(MarkFree, UndefinedRegionChangesNothing) {
  Mapper mapper(MapConfig{}, room());
  const double nan = std::numeric_limits<double>::quiet_NaN();

  mapper.mark_free(Box3d(), Time{});
  mapper.mark_free({Vector3d::Constant(nan), Vector3d::Constant(1.0)}, Time{});
  mapper.mark_free({Vector3d::Constant(1e200), Vector3d::Constant(1e300)}, Time{});

  EXPECT_TRUE(mapper.publish()->changed_tiles.empty());
}

TEST(ResumedMapper, FirstPublicationBringsAllThereIsAndLaterOnesTheChanges) {
  Mapper before(MapConfig{}, room());
  shoot(before, {2.0F, 0.0F, 0.0F});
  const MapSnapshotPtr saved = before.publish();

  Mapper resumed(*saved);
  const MapSnapshotPtr first = resumed.publish();
  shoot(resumed, {-1.0F, 0.0F, 0.0F});
  const MapSnapshotPtr second = resumed.publish();

  EXPECT_TRUE(test::same_content(*first, *saved));
  EXPECT_EQ(first->changed_tiles, tiles_changed_between(nullptr, *saved));
  EXPECT_EQ(second->changed_tiles, tiles_changed_between(first.get(), *second));
  EXPECT_GT(second->revision, saved->revision);
}

TEST(ResumedMapper, TilesThatDoNotFitTheBoxAreAConfigurationError) {
  MapSnapshot broken = test::random_map(room(), 0.1, 1);
  broken.tiles.pop_back();

  EXPECT_THROW(Mapper{broken}, ConfigError);
}

}  // namespace
}  // namespace understory
