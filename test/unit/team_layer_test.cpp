// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "support/map_checks.hpp"
#include "support/team_layers.hpp"
#include "understory/team/fused_map.hpp"
#include "understory/team/layer_tile.hpp"

namespace understory::team {
namespace {

Box3d room() {
  return {Vector3d(-2.0, -3.0, 0.0), Vector3d(6.0, 3.0, 2.0)};
}

GridGeometry geometry() {
  return {0.1, room()};
}

SensorModel model() {
  return SensorModel(SensorModelConfig{});
}

TeamConfig team_of(int size, int id) {
  TeamConfig config;
  config.size = size;
  config.id = id;
  return config;
}

// The fused map of vehicle 0 knows only this voxel, and team mates each told one state of it.
class FusedVoxel : public testing::Test {
 protected:
  [[nodiscard]] VoxelState state_after(VoxelState own, const std::vector<VoxelState>& told) {
    const VoxelIndex voxel(5, 6, 7);
    const TileSlot slot = geometry().slot_of(voxel);
    MapSnapshot map{geometry(), model(), 1, Time{}, {}, {slot}};
    map.tiles.resize(geometry().slot_count());
    map.tiles[slot] = test::tile_of(layer_with(voxel, own), model());
    FusedMap fused(team_of(8, 0), geometry(), model());
    for (std::size_t i = 0; i < told.size(); ++i) {
      EXPECT_TRUE(
          fused.accept(static_cast<std::uint8_t>(i + 1), slot, 1, layer_with(voxel, told[i])));
    }
    return fused.update_own(map)->state(voxel);
  }

 private:
  static LayerTile layer_with(const VoxelIndex& voxel, VoxelState state) {
    LayerTile layer;
    layer.set(offset_in_tile(voxel), state);
    return layer;
  }
};

constexpr VoxelState kUnknown = VoxelState::kUnknown;
constexpr VoxelState kFree = VoxelState::kFree;
constexpr VoxelState kUncertain = VoxelState::kUncertain;
constexpr VoxelState kOccupied = VoxelState::kOccupied;

TEST(TeamLayer, SaysOfEveryVoxelWhatTheMapSays) {
  const MapSnapshotPtr map = std::make_shared<MapSnapshot>(test::random_map(room(), 0.1, 3));

  std::size_t wrong = 0;
  for (const TilePtr& tile : map->tiles) {
    if (tile) {
      const LayerTile layer = layer_of(*tile, map->sensor_model);
      for (std::size_t offset = 0; offset < kVoxelsPerTile; ++offset) {
        wrong += layer.at(offset) == map->sensor_model.state_of(tile->log_odds[offset]) ? 0U : 1U;
      }
    }
  }

  EXPECT_EQ(wrong, 0U);
}

TEST(TeamLayer, IsTheSameAfterCoding) {
  Rng rng(7);
  std::vector<LayerTile> layers(2);
  layers[1].maybe_free_rows.fill(0xFFFF);
  for (TileSlot slot = 0; slot < geometry().slot_count(); ++slot) {
    layers.push_back(test::random_layer(geometry(), slot, rng));
  }

  for (std::size_t count = 1; count <= kMostLayers; ++count) {
    for (std::size_t first = 0; first + count <= layers.size(); ++first) {
      const auto begin = layers.begin() + static_cast<std::ptrdiff_t>(first);
      const std::vector<LayerTile> some(begin, begin + static_cast<std::ptrdiff_t>(count));
      const std::vector<std::uint8_t> encoded = encode_layers(some);
      const auto decoded = decode_layers(encoded.data(), encoded.size());

      ASSERT_LE(encoded.size(), kMaxLayersBytes);
      ASSERT_TRUE(decoded.has_value());
      EXPECT_TRUE(*decoded == some);
    }
  }
}

TEST(TeamLayer, OfOneStateTakesFewBytes) {
  LayerTile layer;
  layer.maybe_free_rows.fill(0xFFFF);

  EXPECT_LT(encode_layers({layer}).size(), 40U);
  EXPECT_LT(encode_layers(std::vector<LayerTile>(kMostLayers, layer)).size(), 45U);
}

TEST(TeamLayer, DamagedBytesAreNeverAnotherLayer) {
  Rng rng(8);
  LayerTile layer;
  for (std::size_t i = 0; i < 600; ++i) {
    layer.set(i, static_cast<VoxelState>(rng.below(4)));
  }
  const std::vector<std::uint8_t> encoded = encode_layers({layer});

  std::size_t believed = 0;
  for (std::size_t byte = 0; byte < encoded.size(); ++byte) {
    for (unsigned bit = 0; bit < 8; ++bit) {
      std::vector<std::uint8_t> damaged = encoded;
      damaged[byte] = static_cast<std::uint8_t>(damaged[byte] ^ (1U << bit));
      const auto decoded = decode_layers(damaged.data(), damaged.size());
      believed += decoded && !(*decoded == std::vector<LayerTile>{layer}) ? 1U : 0U;
    }
  }

  EXPECT_EQ(believed, 0U);
}

TEST(TeamLayer, BytesThatWereCutOffOrAddedAreNoLayer) {
  std::vector<std::uint8_t> encoded = encode_layers({LayerTile{}});

  for (std::size_t size = 0; size < encoded.size(); ++size) {
    EXPECT_FALSE(decode_layers(encoded.data(), size).has_value()) << size;
  }
  std::vector<std::uint8_t> twice = encoded;
  twice.insert(twice.end(), encoded.begin(), encoded.end());
  EXPECT_FALSE(decode_layers(twice.data(), twice.size()).has_value());
  encoded.push_back(0);
  EXPECT_FALSE(decode_layers(encoded.data(), encoded.size()).has_value());
}

// Frames of RFC 8878, written by hand: magic number, descriptor, content size, one block of zeros.
TEST(TeamLayer, ContentOfAnotherSizeIsNoLayer) {
  const auto frame_of_zeros = [](unsigned claimed, unsigned actual) {
    // Two-byte content size (less 256), single segment; last block, run-length coded.
    const unsigned size_field = claimed - 256;
    const unsigned block = (actual << 3U) | (1U << 1U) | 1U;
    std::vector<std::uint8_t> frame{0x28, 0xB5, 0x2F, 0xFD, 0x60};
    for (const unsigned byte :
         {size_field, size_field >> 8U, block, block >> 8U, block >> 16U, 0U}) {
      frame.push_back(static_cast<std::uint8_t>(byte & 0xFFU));
    }
    return frame;
  };
  const auto is_layer = [](const std::vector<std::uint8_t>& frame) {
    return decode_layers(frame.data(), frame.size()).has_value();
  };

  EXPECT_TRUE(is_layer(frame_of_zeros(1024, 1024)));
  EXPECT_FALSE(is_layer(frame_of_zeros(1023, 1023)));
  EXPECT_FALSE(is_layer(frame_of_zeros(1025, 1025)));
  EXPECT_FALSE(is_layer(frame_of_zeros(1024, 1023)));
  EXPECT_FALSE(is_layer(frame_of_zeros(1024, 60000)));
  EXPECT_TRUE(is_layer(frame_of_zeros(8192, 8192)));
  EXPECT_FALSE(is_layer(frame_of_zeros(9216, 9216)));
  EXPECT_FALSE(is_layer(frame_of_zeros(65000, 65000)));
}

TEST(TeamLayer, LiesWithinTheBoxUnlessAVoxelBesideItIsKnown) {
  const GridGeometry grid = geometry();
  const TileSlot slot = grid.slot_of(grid.voxels().end - VoxelIndex::Ones());
  const VoxelIndex origin = grid.tile_of_slot(slot) * kTileVoxels;

  for (std::size_t offset = 0; offset < kVoxelsPerTile; ++offset) {
    const auto at = static_cast<int>(offset);
    LayerTile layer;
    layer.set(offset, VoxelState::kOccupied);
    const VoxelIndex voxel = origin + VoxelIndex(at % 16, at / 16 % 16, at / 256);

    ASSERT_EQ(lies_within(layer, origin, grid.voxels()), grid.contains(voxel)) << offset;
  }
}

TEST_F(FusedVoxel, KeepsTheOwnStateAsLongAsNobodyElseKnows) {
  for (const VoxelState own : {kUnknown, kFree, kUncertain, kOccupied}) {
    EXPECT_EQ(state_after(own, {}), own);
    EXPECT_EQ(state_after(own, {kUnknown, kUnknown}), own);
  }
}

TEST_F(FusedVoxel, IsWhatATeamMateSaysWhereTheOwnMapIsUnknown) {
  for (const VoxelState told : {kUnknown, kFree, kUncertain, kOccupied}) {
    EXPECT_EQ(state_after(kUnknown, {told}), told);
  }
}

TEST_F(FusedVoxel, IsNeverFreeByAsManyVotesAsAreAgainst) {
  EXPECT_EQ(state_after(kFree, {kOccupied}), kUncertain);
  EXPECT_EQ(state_after(kOccupied, {kFree}), kUncertain);
  EXPECT_EQ(state_after(kOccupied, {kFree, kOccupied, kFree}), kUncertain);
}

TEST_F(FusedVoxel, FollowsTheMajority) {
  EXPECT_EQ(state_after(kOccupied, {kFree, kFree}), kFree);
  EXPECT_EQ(state_after(kFree, {kOccupied, kOccupied}), kOccupied);
  EXPECT_EQ(state_after(kOccupied, {kOccupied, kOccupied, kOccupied, kFree, kFree}), kOccupied);
}

TEST_F(FusedVoxel, DoubtYieldsToKnowledge) {
  EXPECT_EQ(state_after(kUncertain, {kFree}), kFree);
  EXPECT_EQ(state_after(kUncertain, {kOccupied}), kOccupied);
}

// A sensor model with the most extreme values that the configuration bears.
TEST(FusedMap, KeepsTheOwnStateWithAnySensorModel) {
  for (const double min : {0.02, 0.2, 0.49}) {
    for (const double max : {0.6, 0.98}) {
      SensorModelConfig config;
      config.min_probability = min;
      config.max_probability = max;
      config.occupied_probability = 0.55;
      const SensorModel sensor_model(config);
      Rng rng(5);
      const TileSlot slot = 3;
      const LayerTile layer = test::random_layer(geometry(), slot, rng);
      MapSnapshot own{geometry(), sensor_model, 1, Time{}, {}, {slot}};
      own.tiles.resize(geometry().slot_count());
      own.tiles[slot] = test::tile_of(layer, sensor_model);
      FusedMap fused(team_of(2, 0), geometry(), sensor_model);

      const MapSnapshotPtr map = fused.update_own(own);

      EXPECT_TRUE(layer_of(*map->tiles[slot], sensor_model) == layer) << min << " " << max;
      EXPECT_EQ(test::inconsistent_voxels(*map), 0U);
    }
  }
}

class FusedMapTest : public testing::Test {
 protected:
  FusedMapTest() { own_.tiles.resize(grid_.slot_count()); }

  MapSnapshotPtr update(const std::vector<std::pair<TileSlot, LayerTile>>& changes) {
    ++own_.revision;
    own_.changed_tiles.clear();
    for (const auto& [slot, layer] : changes) {
      own_.tiles[slot] = test::tile_of(layer, own_.sensor_model);
      own_.changed_tiles.push_back(slot);
    }
    return fused_.update_own(own_);
  }
  LayerTile random_layer(TileSlot slot) { return test::random_layer(grid_, slot, rng_); }
  // The own map goes on, and nobody is told.
  void change_unseen(TileSlot slot, const LayerTile& layer) {
    own_.tiles[slot] = test::tile_of(layer, own_.sensor_model);
    ++own_.revision;
  }
  [[nodiscard]] FusedMap& fused() { return fused_; }

 private:
  Rng rng_{11};
  GridGeometry grid_ = geometry();
  MapSnapshot own_{grid_, model(), 0, Time{}, {}, {}};
  FusedMap fused_{team_of(3, 1), grid_, model()};
};

TEST_F(FusedMapTest, ChangedTilesAreThoseThatDifferAscending) {
  const MapSnapshotPtr first = update({{20, random_layer(20)}});
  EXPECT_TRUE(fused().accept(0, 30, 1, random_layer(30)));
  EXPECT_TRUE(fused().accept(2, 4, 1, random_layer(4)));

  const MapSnapshotPtr second = update({{9, random_layer(9)}, {20, random_layer(20)}});

  EXPECT_EQ(first->changed_tiles, (std::vector<TileSlot>{20}));
  EXPECT_EQ(second->changed_tiles, (std::vector<TileSlot>{4, 9, 20, 30}));
  EXPECT_EQ(tiles_changed_between(first.get(), *second), second->changed_tiles);
  EXPECT_EQ(second->revision, first->revision + 1);
  EXPECT_EQ(fused().own_changes(), (std::vector<TileSlot>{9, 20}));
}

TEST_F(FusedMapTest, TilesOfTheSameStatesAreNotTouchedAgain) {
  const LayerTile layer = random_layer(20);
  const MapSnapshotPtr first = update({{20, layer}});
  EXPECT_TRUE(fused().accept(0, 20, 1, LayerTile{}));

  const MapSnapshotPtr second = update({{20, layer}});

  EXPECT_EQ(second->tiles[20], first->tiles[20]);
  EXPECT_TRUE(second->changed_tiles.empty());
  EXPECT_TRUE(fused().own_changes().empty());
}

TEST_F(FusedMapTest, WhatIsUnknownToAllStaysNull) {
  EXPECT_TRUE(fused().accept(0, 7, 1, LayerTile{}));

  const MapSnapshotPtr map = update({{8, LayerTile{}}});

  EXPECT_EQ(map->tiles[7], nullptr);
  EXPECT_EQ(map->tiles[8], nullptr);
  EXPECT_EQ(fused().own_layer(8), nullptr);
}

TEST_F(FusedMapTest, MissesNothingWhenRevisionsOfTheOwnMapWereLeftOut) {
  (void)update({{3, random_layer(3)}});
  const LayerTile layer = random_layer(12);
  change_unseen(12, layer);

  const MapSnapshotPtr map = update({{5, random_layer(5)}});

  EXPECT_EQ(map->changed_tiles, (std::vector<TileSlot>{5, 12}));
  EXPECT_TRUE(layer_of(*map->tiles[12], model()) == layer);
}

TEST_F(FusedMapTest, RefusesWhatIsSupersededOrOfNoOther) {
  EXPECT_TRUE(fused().accept(0, 7, 5, random_layer(7)));

  EXPECT_FALSE(fused().accept(0, 7, 5, random_layer(7)));
  EXPECT_FALSE(fused().accept(0, 7, 4, random_layer(7)));
  EXPECT_FALSE(fused().accept(1, 7, 9, random_layer(7)));
  EXPECT_FALSE(fused().accept(3, 7, 9, random_layer(7)));
  EXPECT_FALSE(fused().accept(0, geometry().slot_count(), 9, random_layer(7)));
}

TEST(FusedMap, AnIdOutsideOfTheTeamIsAConfigurationError) {
  EXPECT_THROW(FusedMap(team_of(2, 2), geometry(), model()), ConfigError);
}

}  // namespace
}  // namespace understory::team
