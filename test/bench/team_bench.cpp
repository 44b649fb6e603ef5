// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What a team costs: fusing the map with every camera frame, and bytes per tile on the radio. A
// flight through a seeded forest of 0.20 trunks per square metre, 50 x 50 x 2 m at 0.10 m; what the
// team mate tells is the same forest seen on another flight.
#include <cstdint>
#include <vector>

#include <benchmark/benchmark.h>

#include "support/synthetic_scene.hpp"
#include "understory/map/mapper.hpp"
#include "understory/team/exchange.hpp"

namespace understory {
namespace {

constexpr double kEdgeM = 50.0;
constexpr double kFlightHeightM = 1.0;
constexpr std::size_t kFrames = 600;
constexpr std::uint64_t kSession = 1'790'000'000'000'000;  // microseconds since 1970, in 2026

Box3d box() {
  return {Vector3d(0.0, 0.0, 0.0), Vector3d(kEdgeM, kEdgeM, 2.0)};
}

team::TeamConfig team_of(int id) {
  team::TeamConfig config;
  config.size = 4;
  config.id = id;
  return config;
}

std::vector<MapSnapshotPtr> maps_of_a_flight() {
  const test::SyntheticScene forest = test::seeded_forest(kEdgeM, 0.20, 20);
  const CameraModel camera(test::camera_config(160, 120));
  Mapper mapper(MapConfig{}, box());
  std::vector<MapSnapshotPtr> maps;
  for (const Pose& pose : test::flight_through(forest, kEdgeM, kFlightHeightM, kFrames)) {
    const DepthImage image = test::render(forest, camera, pose);
    (void)mapper.integrate(camera, image.view(), pose, Time{});
    maps.push_back(mapper.publish());
  }
  return maps;
}

const std::vector<MapSnapshotPtr>& flight() {
  static const std::vector<MapSnapshotPtr> kMaps = maps_of_a_flight();
  return kMaps;
}

// The argument: how many team mates have told of every tile.
void fuse_frames(benchmark::State& state) {
  const std::vector<MapSnapshotPtr>& maps = flight();
  std::size_t changed = 0;
  std::size_t frames = 0;
  for (auto _ : state) {
    state.PauseTiming();
    team::FusedMap fused(team_of(0), maps[0]->geometry, maps[0]->sensor_model);
    for (std::int64_t mate = 1; mate <= state.range(0); ++mate) {
      for (TileSlot slot = 0; slot < maps.back()->tiles.size(); ++slot) {
        if (maps.back()->tiles[slot]) {
          (void)fused.accept(static_cast<std::uint8_t>(mate),
                             slot,
                             1,
                             team::layer_of(*maps.back()->tiles[slot], maps[0]->sensor_model));
        }
      }
    }
    (void)fused.update_own(*maps[0]);
    state.ResumeTiming();
    for (std::size_t i = 1; i < maps.size(); ++i) {
      changed += maps[i]->changed_tiles.size();
      benchmark::DoNotOptimize(fused.update_own(*maps[i]));
      ++frames;
    }
  }
  state.counters["s_per_frame"] = benchmark::Counter(
      static_cast<double>(frames), benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
  state.counters["own_tiles_per_frame"] =
      static_cast<double>(changed) / static_cast<double>(frames);
}
BENCHMARK(fuse_frames)
    ->Name("FusedMap_UpdateOwn/team_mates")
    ->Arg(0)
    ->Arg(1)
    ->Arg(3)
    ->Unit(benchmark::kMillisecond);

void tell_flight(benchmark::State& state) {
  const std::vector<MapSnapshotPtr>& maps = flight();
  team::Counters counters;
  std::size_t known = 0;
  for (auto _ : state) {
    team::Exchange exchange(team_of(0), maps[0]->geometry, maps[0]->sensor_model, kSession);
    for (std::size_t i = 0; i < maps.size() + 300; ++i) {
      const Time now(Duration(static_cast<Duration::rep>(i) * 66'667));
      if (i < maps.size()) {
        (void)exchange.on_map(*maps[i], now);
      }
      benchmark::DoNotOptimize(exchange.due(team::OwnState{}, now));
    }
    counters = exchange.counters();
  }
  for (const TilePtr& tile : maps.back()->tiles) {
    known += tile ? 1U : 0U;
  }
  const auto& tiles = counters.sent[2];
  const auto& states = counters.sent[0];
  state.counters["tiles_known"] = static_cast<double>(known);
  state.counters["blocks_sent"] = static_cast<double>(tiles.samples);
  state.counters["bytes_of_blocks"] = static_cast<double>(tiles.bytes);
  state.counters["bytes_per_state"] =
      static_cast<double>(states.bytes) / static_cast<double>(states.samples);
}
BENCHMARK(tell_flight)->Name("Exchange_TellFlight")->Unit(benchmark::kMillisecond);

void receive_tiles(benchmark::State& state) {
  const std::vector<MapSnapshotPtr>& maps = flight();
  team::TeamConfig config = team_of(1);
  config.exchange.tile_rate_bytes_per_s = 1e9;
  team::Exchange sender(config, maps[0]->geometry, maps[0]->sensor_model, kSession);
  (void)sender.on_map(*maps.back(), Time{});
  const std::vector<team::Sample> samples =
      sender.due(team::OwnState{}, Time(Duration(10'000'000)));
  for (auto _ : state) {
    team::Exchange receiver(team_of(0), maps[0]->geometry, maps[0]->sensor_model, kSession);
    for (const team::Sample& sample : samples) {
      receiver.receive(sample, Time{});
    }
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(samples.size()));
}
BENCHMARK(receive_tiles)->Name("Exchange_ReceiveTiles")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace understory
