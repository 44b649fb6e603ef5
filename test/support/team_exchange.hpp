// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// A team of three over one small map, its samples, and how they are handed on, for tests of the
// exchange.
#pragma once

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <utility>
#include <vector>

#include "support/team_layers.hpp"
#include "understory/team/exchange.hpp"

namespace understory::team::test {

using understory::test::random_layer;
using understory::test::straight_flight;
using understory::test::tile_of;

inline constexpr std::uint64_t kSession =
    1'790'000'000'000'000;  // microseconds since 1970, in 2026

[[nodiscard]] inline Time at(double time_s) {
  return Time(duration_from_seconds(time_s));
}

[[nodiscard]] inline GridGeometry geometry() {
  return {0.1, Box3d(Vector3d(-2.0, -3.0, 0.0), Vector3d(6.0, 3.0, 2.0))};
}

[[nodiscard]] inline SensorModel model() {
  return SensorModel(SensorModelConfig{});
}

[[nodiscard]] inline TeamConfig team_of(int size, int id) {
  TeamConfig config;
  config.size = size;
  config.id = id;
  return config;
}

[[nodiscard]] inline Exchange exchange_of(int id, std::uint64_t session = kSession) {
  return {team_of(3, id), geometry(), model(), session};
}

[[nodiscard]] inline OwnState own_state() {
  OwnState own;
  own.position_m = Vector3d(1.2345, -2.5, 1.0);
  own.velocity_mps = Vector3d(0.5, -1.25, 0.1);
  own.yaw_rad = -2.5;
  own.mode = FlightMode::kCollector;
  own.state = MissionState::kExplore;
  own.target_m = Vector3d(4.0, 2.0, 1.5);
  return own;
}

[[nodiscard]] inline MapSnapshot unknown_map() {
  MapSnapshot map{geometry(), model(), 0, Time{}, {}, {}};
  map.tiles.resize(geometry().slot_count());
  return map;
}

inline void change_tile(MapSnapshot& map, TileSlot slot, Rng& rng) {
  ++map.revision;
  map.tiles[slot] = tile_of(random_layer(geometry(), slot, rng), map.sensor_model);
  map.changed_tiles.assign(1, slot);
}

[[nodiscard]] inline std::vector<Sample> of_kind(SampleKind kind,
                                                 const std::vector<Sample>& samples) {
  std::vector<Sample> found;
  std::copy_if(samples.begin(), samples.end(), std::back_inserter(found), [&](const Sample& s) {
    return s.key.kind == kind;
  });
  return found;
}

inline void deliver(const std::vector<Sample>& samples, Exchange& to, Time now) {
  for (const Sample& sample : samples) {
    to.receive(sample, now);
  }
}

[[nodiscard]] inline StateSample state_sample(std::uint64_t count) {
  StateSample sample;
  sample.header = {kProtocolVersion, hash_of(geometry()), kSession, count};
  sample.stamp = at(1.0);
  sample.position_m = Vector3d(1.0, 2.0, 1.0);
  return sample;
}

template <class Content>
[[nodiscard]] Sample sample_of(std::uint8_t vehicle,
                               SampleKind kind,
                               std::uint32_t item,
                               const Content& content) {
  return {{vehicle, kind, item}, version_of(content.header), encode(content)};
}

[[nodiscard]] inline Sample state_of(std::uint8_t vehicle, const StateSample& state) {
  return sample_of(vehicle, SampleKind::kState, 0, state);
}

[[nodiscard]] inline Sample block_sample(std::uint32_t block, std::vector<LayerTile> layers) {
  const TileBlockSample tiles{
      {kProtocolVersion, hash_of(geometry()), kSession, 1}, block, std::move(layers)};
  return sample_of(1, SampleKind::kTileBlock, block, tiles);
}

[[nodiscard]] inline std::uint64_t rejections(const Counters& counters) {
  std::uint64_t sum = 0;
  for (const std::uint64_t count : counters.rejected) {
    sum += count;
  }
  return sum;
}

}  // namespace understory::team::test
