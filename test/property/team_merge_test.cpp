// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Vehicles that tell each other of random maps over a carrier that reorders, repeats, loses and
// brings again: in the end all fly by the same map. Each seed printed on failure.
#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include <gtest/gtest.h>

#include "support/map_checks.hpp"
#include "support/team_layers.hpp"
#include "understory/team/exchange.hpp"

namespace understory::team {
namespace {

constexpr int kVehicles = 3;
constexpr int kSeeds = 60;

GridGeometry geometry() {
  return {0.1, Box3d(Vector3d(-2.0, -1.0, 0.0), Vector3d(3.0, 2.0, 2.0))};
}

SensorModel model() {
  return SensorModel(SensorModelConfig{});
}

TeamConfig team_of(int id) {
  TeamConfig config;
  config.size = kVehicles;
  config.id = id;
  config.exchange.tile_rate_bytes_per_s = 1e9;
  return config;
}

struct Told {
  std::uint8_t vehicle;
  TileSlot slot;
  std::uint64_t version;
  LayerTile layer;
};

std::vector<Told> random_history(Rng& rng) {
  std::vector<Told> history;
  for (std::uint64_t i = 0; i < 60; ++i) {
    Told told{static_cast<std::uint8_t>(1 + rng.below(kVehicles - 1)),
              rng.below(geometry().slot_count()),
              i + 1,
              {}};
    told.layer = test::random_layer(geometry(), told.slot, rng);
    history.push_back(told);
  }
  return history;
}

template <class T>
void shuffle(std::vector<T>& values, Rng& rng) {
  for (std::size_t i = values.size(); i > 1; --i) {
    std::swap(values[i - 1], values[rng.below(i)]);
  }
}

MapSnapshot own_map(Rng& rng) {
  MapSnapshot own{geometry(), model(), 1, Time{}, {}, {}};
  for (TileSlot slot = 0; slot < geometry().slot_count(); ++slot) {
    const bool is_known = rng.below(2) == 0;
    own.tiles.push_back(is_known ? test::tile_of(test::random_layer(geometry(), slot, rng), model())
                                 : nullptr);
    own.changed_tiles.push_back(slot);
  }
  return own;
}

// Anyhow: in another order, every third lost at first, some of them twice, the own map handed over
// in between.
std::uint64_t digest_of_any_delivery(const MapSnapshot& own, std::vector<Told> history, Rng rng) {
  FusedMap fused(team_of(0), geometry(), model());
  shuffle(history, rng);
  std::vector<Told> later;
  for (const Told& told : history) {
    if (rng.below(3) == 0) {
      later.push_back(told);
    } else {
      (void)fused.accept(told.vehicle, told.slot, told.version, told.layer);
    }
    if (rng.below(4) == 0) {
      later.push_back(told);
    }
    if (rng.below(20) == 0) {
      (void)fused.update_own(own);
    }
  }
  shuffle(later, rng);
  for (const Told& told : later) {
    (void)fused.accept(told.vehicle, told.slot, told.version, told.layer);
  }
  return digest_of(*fused.update_own(own));
}

TEST(TeamMerge, TheMapIsTheSameInWhateverOrderLayersCameLostRepeatedAndStale) {
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    Rng rng(seed);
    const MapSnapshot own = own_map(rng);
    const std::vector<Told> history = random_history(rng);
    FusedMap in_order(team_of(0), geometry(), model());
    for (const Told& told : history) {
      (void)in_order.accept(told.vehicle, told.slot, told.version, told.layer);
    }
    const std::uint64_t expected = digest_of(*in_order.update_own(own));

    for (int delivery = 0; delivery < 5; ++delivery) {
      ASSERT_EQ(digest_of_any_delivery(own, history, Rng(rng.next())), expected) << "seed " << seed;
    }
  }
}

// Counted plainly: votes by state.
VoxelState outcome_of(const std::array<int, 4>& votes) {
  if (votes[0] == kVehicles) {
    return VoxelState::kUnknown;
  }
  const int lead = votes[3] - votes[1];
  if (lead == 0) {
    return VoxelState::kUncertain;
  }
  return lead < 0 ? VoxelState::kFree : VoxelState::kOccupied;
}

TEST(TeamMerge, EveryVoxelFollowsTheVotesOfTheNewestLayers) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    Rng rng(seed);
    FusedMap fused(team_of(0), geometry(), model());
    const MapSnapshot own = own_map(rng);
    std::map<std::pair<TileSlot, int>, LayerTile> newest;
    for (TileSlot slot = 0; slot < own.tiles.size(); ++slot) {
      newest[{slot, 0}] = own.tiles[slot] ? layer_of(*own.tiles[slot], model()) : LayerTile{};
    }
    for (const Told& told : random_history(rng)) {
      (void)fused.accept(told.vehicle, told.slot, told.version, told.layer);
      newest[{told.slot, told.vehicle}] = told.layer;
    }

    const MapSnapshotPtr map = fused.update_own(own);

    std::size_t wrong = test::inconsistent_voxels(*map);
    test::for_each_voxel(geometry().voxels(), [&](const VoxelIndex& voxel) {
      std::array<int, 4> votes{};
      for (int vehicle = 0; vehicle < kVehicles; ++vehicle) {
        const LayerTile& layer = newest[{geometry().slot_of(voxel), vehicle}];
        ++votes.at(static_cast<std::size_t>(layer.at(offset_in_tile(voxel))));
      }
      wrong += map->state(voxel) == outcome_of(votes) ? 0U : 1U;
    });
    ASSERT_EQ(wrong, 0U) << "seed " << seed;
  }
}

// Vehicles with maps that go on changing, and the carrier between them as the Link describes it.
class Swarm {
 public:
  explicit Swarm(std::uint64_t seed) : rng_(seed) {
    for (int id = 0; id < kVehicles; ++id) {
      exchanges_.emplace_back(team_of(id), geometry(), model(), 1000);
      maps_.push_back(MapSnapshot{geometry(), model(), 0, Time{}, {}, {}});
      maps_.back().tiles.resize(geometry().slot_count());
    }
  }

  void look_around() {
    for (MapSnapshot& map : maps_) {
      const TileSlot slot = rng_.below(geometry().slot_count());
      map.changed_tiles.assign(1, slot);
      map.tiles[slot] = test::tile_of(test::random_layer(geometry(), slot, rng_), model());
    }
  }
  void exchange(bool is_quiet) {
    now_ += Duration(100'000);
    for (std::size_t i = 0; i < exchanges_.size(); ++i) {
      ++maps_[i].revision;
      (void)exchanges_[i].on_map(maps_[i], now_);
      maps_[i].changed_tiles.clear();
      for (const Sample& sample : exchanges_[i].due(OwnState{}, now_)) {
        newest_[sample.key] = sample;
        underway_.push_back(sample);
      }
    }
    shuffle(underway_, rng_);
    std::vector<Sample> held;
    for (const Sample& sample : underway_) {
      const std::uint64_t fate = is_quiet ? 0 : rng_.below(4);
      if (fate == 1) {
        held.push_back(sample);
      }
      for (Exchange& exchange : exchanges_) {
        if (fate != 2) {
          exchange.receive(sample, now_);
        }
      }
    }
    underway_ = held;
  }
  // Back in contact: the newest of every key arrives, in any order.
  void settle() {
    for (int i = 0; i < 50; ++i) {
      exchange(true);
    }
    std::vector<Sample> all;
    for (const auto& [key, sample] : newest_) {
      all.push_back(sample);
    }
    shuffle(all, rng_);
    for (std::size_t i = 0; i < exchanges_.size(); ++i) {
      for (const Sample& sample : all) {
        exchanges_[i].receive(sample, now_);
      }
      ++maps_[i].revision;
      (void)exchanges_[i].on_map(maps_[i], now_);
    }
  }
  [[nodiscard]] std::uint64_t digest(std::size_t vehicle) const {
    return exchanges_[vehicle].map_digest();
  }

 private:
  Rng rng_;
  Time now_{};
  std::vector<Exchange> exchanges_;
  std::vector<MapSnapshot> maps_;
  std::map<SampleKey, Sample> newest_;
  std::vector<Sample> underway_;
};

TEST(TeamMerge, AllVehiclesEndWithTheSameMapToTheBit) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Swarm swarm(seed);
    for (int i = 0; i < 100; ++i) {
      swarm.look_around();
      swarm.exchange(false);
    }

    swarm.settle();

    ASSERT_EQ(swarm.digest(0), swarm.digest(1)) << "seed " << seed;
    ASSERT_EQ(swarm.digest(0), swarm.digest(2)) << "seed " << seed;
    ASSERT_NE(swarm.digest(0), Swarm(seed).digest(0)) << "seed " << seed;
  }
}

}  // namespace
}  // namespace understory::team
