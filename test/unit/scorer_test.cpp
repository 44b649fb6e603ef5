// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/scorer.hpp"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "understory/base/rng.hpp"
#include "understory/sim/top_view.hpp"
#include "understory/sim/voxel_mask.hpp"

namespace understory {
namespace {

constexpr double kVehicleRadius_m = 0.20;
constexpr Time kStart = Time(Duration(5'000'000));

Time at(double time_s) {
  return kStart + duration_from_seconds(time_s);
}

VehicleState hover(const Vector3d& position_m) {
  VehicleState state;
  state.position_m = position_m;
  return state;
}

class ScorerTest : public testing::Test {
 public:
  ScorerTest() {
    Forest forest;
    forest.trunks = {{Vector2d(1.5, 0), 0.25}, {Vector2d(-1, 1), 0.15}};
    forest_ = std::make_shared<ForestTruth>(forest);
    truth_ = std::make_shared<CoverageTruth>(
        *forest_, geometry_, std::vector<Vector3d>{{0, 0, 1}}, CameraConfig{}, kVehicleRadius_m);
    map_.tiles.resize(geometry_.slot_count());
  }

  [[nodiscard]] Scorer scorer() const { return {forest_, truth_, kVehicleRadius_m, kStart}; }

  // Writes as a mapper does: the tile that others may hold stays what it was.
  void write(const VoxelIndex& voxel, bool free) {
    const TileSlot slot = geometry_.slot_of(voxel);
    auto tile = map_.tiles[slot] == nullptr ? std::make_shared<Tile>()
                                            : std::make_shared<Tile>(*map_.tiles[slot]);
    const auto bit = static_cast<std::uint16_t>(1U << (static_cast<unsigned>(voxel.x()) % 16U));
    const std::size_t row = row_in_tile(voxel.y(), voxel.z());
    tile->known_rows[row] = static_cast<std::uint16_t>(tile->known_rows[row] | bit);
    tile->free_rows[row] =
        static_cast<std::uint16_t>(free ? tile->free_rows[row] | bit : tile->free_rows[row] & ~bit);
    tile->log_odds[offset_in_tile(voxel)] = free ? -20 : 60;
    map_.tiles[slot] = tile;
    changed_.insert(changed_.end(), slot);
  }

  const MapSnapshot& publish(double time_s) {
    std::sort(changed_.begin(), changed_.end());
    changed_.erase(std::unique(changed_.begin(), changed_.end()), changed_.end());
    map_.changed_tiles = std::move(changed_);
    changed_.clear();
    ++map_.revision;
    map_.stamp = at(time_s);
    return map_;
  }

  [[nodiscard]] double brute_coverage() const {
    std::size_t covered = 0;
    for_each_voxel(geometry_.voxels(), [&](const VoxelIndex& voxel) {
      covered += truth_->contains(voxel) && map_.is_free(voxel) ? 1U : 0U;
    });
    return static_cast<double>(covered) / static_cast<double>(truth_->voxel_count());
  }

  [[nodiscard]] double brute_volume_m3() const {
    std::size_t known = 0;
    for_each_voxel(geometry_.voxels(),
                   [&](const VoxelIndex& voxel) { known += map_.is_known(voxel) ? 1U : 0U; });
    return static_cast<double>(known) * 0.001;
  }

  // Every truly visible voxel up to this share of them, in the order of for_each_voxel.
  void map_share(double share) {
    auto left =
        static_cast<std::size_t>(std::ceil(share * static_cast<double>(truth_->voxel_count())));
    for_each_voxel(geometry_.voxels(), [&](const VoxelIndex& voxel) {
      if (left > 0 && truth_->contains(voxel)) {
        write(voxel, true);
        --left;
      }
    });
  }

  GridGeometry geometry_{0.1, Box3d(Vector3d(-2.05, -2, 0), Vector3d(2, 2, 1))};
  std::shared_ptr<const ForestTruth> forest_;
  std::shared_ptr<const CoverageTruth> truth_;
  MapSnapshot map_{geometry_, SensorModel(SensorModelConfig{}), 0, Time{}, {}, {}};
  std::vector<TileSlot> changed_;
};

TEST_F(ScorerTest, CountsIncrementallyWhatBruteForceCounts) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    Rng rng(seed);
    Scorer judge = scorer();
    const VoxelBox& voxels = geometry_.voxels();
    for (int map = 0; map < 40; ++map) {
      for (int i = 0; i < 30; ++i) {
        VoxelIndex voxel;
        for (int axis = 0; axis < 3; ++axis) {
          voxel[axis] =
              voxels.min[axis] +
              static_cast<int>(rng.below(static_cast<std::uint64_t>(voxels.size()[axis])));
        }
        write(voxel, rng.uniform() < 0.7);  // may turn a free voxel occupied again
      }
      const MapSnapshot& snapshot = publish(map);
      if (rng.uniform() < 0.8) {  // a scorer that missed a map has to look everywhere
        judge.on_map(snapshot);
        ASSERT_DOUBLE_EQ(judge.coverage(), brute_coverage()) << "seed " << seed << ", map " << map;
        ASSERT_NEAR(judge.explored_volume_m3(), brute_volume_m3(), 1e-9)
            << "seed " << seed << ", map " << map;
      }
    }
  }
}

TEST_F(ScorerTest, IgnoresWhatATileHoldsOutsideTheBox) {
  Scorer judge = scorer();
  auto tile = std::make_shared<Tile>();
  tile->free_rows.fill(0xFFFF);
  tile->known_rows.fill(0xFFFF);
  for (TileSlot slot = 0; slot < map_.tiles.size(); ++slot) {
    map_.tiles[slot] = tile;
  }

  judge.on_map(publish(1.0));

  EXPECT_EQ(judge.coverage(), 1.0);
  EXPECT_NEAR(judge.explored_volume_m3(), 41 * 40 * 10 * 0.001, 1e-9);
}

TEST_F(ScorerTest, DoesNotCountFreeVoxelsThatCannotBeSeen) {
  Scorer judge = scorer();
  write(geometry_.index_of({1.5, 0, 0.5}), true);  // inside a trunk

  judge.on_map(publish(1.0));

  EXPECT_EQ(judge.coverage(), 0.0);
  EXPECT_NEAR(judge.explored_volume_m3(), 0.001, 1e-12);
}

TEST_F(ScorerTest, ReportsWhenSharesWereReachedFirst) {
  Scorer judge = scorer();
  map_share(0.4);
  judge.on_map(publish(10.0));
  map_share(0.5);
  judge.on_map(publish(20.0));
  map_share(0.92);
  judge.on_map(publish(30.0));
  map_share(0.96);
  judge.on_map(publish(40.0));

  const Score score = judge.score();

  EXPECT_EQ(score.t50_s, 20.0);
  EXPECT_EQ(score.t90_s, 30.0);
  EXPECT_EQ(score.t95_s, 40.0);
  EXPECT_FALSE(score.t99_s.has_value());
  EXPECT_NEAR(score.coverage.value(), 0.96, 0.001);
}

TEST_F(ScorerTest, KeepsTheVolumeAsOfEveryFullMinute) {
  Scorer judge = scorer();
  write({0, 0, 0}, true);
  judge.on_map(publish(10.0));
  write({1, 0, 0}, true);
  judge.on_map(publish(60.0));
  write({2, 0, 0}, true);
  judge.on_map(publish(60.1));
  write({3, 0, 0}, true);
  judge.on_map(publish(200.0));
  judge.on_vehicle(at(240.0), hover({0, 0, 1}));

  const Score score = judge.score();

  ASSERT_EQ(score.volume_over_time.size(), 4U);
  const std::vector<double> expected_m3 = {0.002, 0.003, 0.003, 0.004};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(score.volume_over_time[i].time_s, 60.0 * static_cast<double>(i + 1));
    EXPECT_NEAR(score.volume_over_time[i].volume_m3, expected_m3[i], 1e-12) << i;
  }
}

TEST_F(ScorerTest, MeasuresDistanceAndSpeedOverTime) {
  Scorer judge = scorer();
  VehicleState state = hover({0, 0, 1});
  judge.on_vehicle(at(0.0), state);
  for (int i = 1; i <= 1000; ++i) {  // 1 s at rest, then 1 s at 1 m/s
    const double time_s = 0.002 * i;
    state.velocity_mps = Vector3d(0, time_s > 1.0 ? -1.0 : 0.0, 0);
    state.position_m += 0.002 * state.velocity_mps;
    judge.on_vehicle(at(time_s), state);
  }

  const Score score = judge.score();

  EXPECT_NEAR(score.distance_m, 1.0, 1e-9);
  EXPECT_NEAR(score.speed_mean_mps, 0.5, 1e-9);
  EXPECT_NEAR(score.speed_std_mps, 0.5, 1e-9);
  EXPECT_EQ(score.speed_max_mps, 1.0);
  EXPECT_EQ(score.collisions, 0);
}

TEST_F(ScorerTest, MeasuresHowFastTheHeadingTurnsAlsoWhenTilted) {
  for (const double pitch_rad : {0.0, 0.4}) {
    Scorer judge = scorer();
    VehicleState state = hover({0, 0, 1});
    state.world_from_body =
        Eigen::AngleAxisd(1.0, Vector3d::UnitZ()) * Eigen::AngleAxisd(pitch_rad, Vector3d::UnitY());
    const Vector3d turning_world(0, 0, -0.7);
    state.body_rates_radps = state.world_from_body.conjugate() * turning_world;
    judge.on_vehicle(at(0.0), state);
    state.body_rates_radps = Vector3d(5.0, 0, 0);  // rolling turns no heading
    judge.on_vehicle(at(0.1), state);

    EXPECT_NEAR(judge.score().yaw_rate_max_radps, 0.7, 1e-9) << pitch_rad;
  }
}

TEST_F(ScorerTest, CountsContactsAndNotTheStepsThatTheyLast) {
  Scorer judge = scorer();
  double time_s = 0.0;
  const auto fly_to = [&](double clearance_m) {
    judge.on_vehicle(at(time_s += 0.002), hover({1.5 - 0.25 - clearance_m, 0, 1}));
  };
  for (const double clearance_m : {0.5, 0.3, 0.2, 0.19, 0.15, 0.199, 0.2005, 0.199}) {
    fly_to(clearance_m);
  }
  EXPECT_EQ(judge.score().collisions, 1);  // jitter at the border is the same contact
  for (const double clearance_m : {0.3, 0.25, 0.12, 0.4}) {
    fly_to(clearance_m);
  }

  EXPECT_EQ(judge.score().collisions, 2);
  ASSERT_TRUE(judge.score().min_clearance_m.has_value());
  EXPECT_NEAR(*judge.score().min_clearance_m, 0.12, 1e-9);
}

TEST_F(ScorerTest, SeesACollisionThatBeginsInsideATrunk) {
  Scorer judge = scorer();
  judge.on_vehicle(at(0.0), hover({1.5, 0.1, 1}));

  EXPECT_EQ(judge.score().collisions, 1);
  EXPECT_NEAR(*judge.score().min_clearance_m, -0.15, 1e-9);
}

TEST_F(ScorerTest, HasNothingToSayBeforeAnythingHappened) {
  const Score score = scorer().score();

  EXPECT_EQ(score.coverage, 0.0);
  EXPECT_FALSE(score.t50_s.has_value());
  EXPECT_FALSE(score.min_clearance_m.has_value());
  EXPECT_EQ(score.speed_mean_mps, 0.0);
  EXPECT_TRUE(score.volume_over_time.empty());
}

TEST_F(ScorerTest, TopViewsShowUnknownOccupiedAndMissedSharesPerColumn) {
  for (int z = 0; z < 10; ++z) {
    if (z < 6) {
      write({3, 4, z}, true);
    }
    write({-20, -20, z}, false);
  }
  const MapSnapshot& map = publish(1.0);

  const TopView unknown = unknown_share(map);
  const TopView occupied = occupied_share(map);
  const TopView missed = missed_share(*truth_, map);

  EXPECT_EQ(unknown.width, 41);
  EXPECT_EQ(unknown.height, 40);
  EXPECT_NEAR(unknown.corner_m.x(), -2.1, 1e-9);
  EXPECT_FLOAT_EQ(unknown.at(3 + 21, 4 + 20), 0.4F);
  EXPECT_FLOAT_EQ(unknown.at(-20 + 21, 0), 0.0F);
  EXPECT_FLOAT_EQ(unknown.at(30, 30), 1.0F);
  EXPECT_FLOAT_EQ(occupied.at(3 + 21, 4 + 20), 0.0F);
  EXPECT_FLOAT_EQ(occupied.at(-20 + 21, 0), 1.0F);
  EXPECT_FLOAT_EQ(missed.at(3 + 21, 4 + 20), 0.4F);
  EXPECT_FLOAT_EQ(missed.at(15 + 21, 20), 0.0F);  // inside a trunk: nobody could know
}

}  // namespace
}  // namespace understory
