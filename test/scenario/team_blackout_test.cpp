// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Two vehicles explore for five minutes out of contact; how long it takes until they know the same
// once they are in contact again, over the radio as configured (1 Mbit/s, 5 % loss).
#include <array>
#include <iostream>

#include <gtest/gtest.h>

#include "understory/sim/team_run.hpp"

namespace understory {
namespace {

constexpr double kBlackout_s = 300.0;
constexpr int kFramesPerSecond = 15;
constexpr std::uint64_t kSession = 1'790'000'000'000'000;

SimulationConfig scene() {
  SimulationConfig config;
  const std::string folder = std::string(UNDERSTORY_SOURCE_DIR) + "/config/";
  load_config_file(folder + "explorer.yaml", config);
  load_config_file(folder + "vehicle.yaml", config);
  load_config_file(folder + "scenarios/team_average.yaml", config);
  config.explorer.team.size = 2;
  return config;
}

// What each of two has seen itself when it never hears of the other.
std::array<MapSnapshot, 2> seen_alone(SimulationConfig config) {
  config.radio.range_m = 0.0;
  TeamRun run(RunSetup{config, 1, std::nullopt});
  double now_s = 0.0;
  run.fly([&now_s] { return now_s >= kBlackout_s; },
          [&now_s](const std::vector<TickRow>& rows) { now_s = rows[0].time_s; });
  return {run.map_of(0), run.map_of(1)};
}

team::Exchange exchange_of(const SimulationConfig& config, int id, const MapSnapshot& own) {
  team::TeamConfig team = config.explorer.team;
  team.id = id;
  return {team, own.geometry, own.sensor_model, kSession};
}

// A vehicle that has seen it all and stands.
struct Station {
  team::Exchange exchange;
  team::Link* link;
  MapSnapshot own;

  MapSnapshotPtr talk(Time now) {
    for (const team::Sample& sample : link->take()) {
      exchange.receive(sample, now);
    }
    ++own.revision;
    own.changed_tiles.clear();
    MapSnapshotPtr fused = exchange.on_map(own, now);
    for (team::Sample& sample : exchange.due(team::OwnState{}, now)) {
      link->publish(std::move(sample));
    }
    return fused;
  }
};

TEST(TeamBlackout, OfFiveMinutesIsMadeUpForWithinTwoSecondsOfContact) {
  SimulationConfig config = scene();
  std::array<MapSnapshot, 2> seen = seen_alone(config);
  config.radio.cuts = {{0.0, kBlackout_s}};
  SimulatedRadio radio(config.radio, 2, Rng(1));
  std::vector<Station> stations;
  for (int id = 0; id < 2; ++id) {
    MapSnapshot& own = seen[static_cast<std::size_t>(id)];
    stations.push_back({exchange_of(config, id, own), &radio.link(id), std::move(own)});
  }

  // What they tell each other waits for them long before there is contact.
  double same_at_s = 0.0;
  const std::vector<Vector3d> places_m{{0.0, 0.0, 1.0}, {5.0, 0.0, 1.0}};
  constexpr int kFirst = static_cast<int>(0.9 * kBlackout_s) * kFramesPerSecond;
  constexpr int kEnd = static_cast<int>(kBlackout_s + 10.0) * kFramesPerSecond;
  for (int frame = kFirst; frame < kEnd; ++frame) {
    const double now_s = static_cast<double>(frame) / kFramesPerSecond;
    const Time now(duration_from_seconds(now_s));
    radio.advance(now, places_m);
    const MapSnapshotPtr a = stations[0].talk(now);
    const MapSnapshotPtr b = stations[1].talk(now);
    const bool is_same = team::digest_of(*a) == team::digest_of(*b);
    ASSERT_FALSE(is_same && now_s < kBlackout_s);
    if (is_same) {
      same_at_s = now_s;
      break;
    }
  }

  const double bytes = static_cast<double>(radio.use(0).bytes_sent + radio.use(1).bytes_sent);
  std::cout << "the same " << same_at_s - kBlackout_s << " s after contact, " << 1e-3 * bytes
            << " kB\n";
  EXPECT_GT(same_at_s, kBlackout_s);
  EXPECT_LE(same_at_s, kBlackout_s + 2.0);
}

}  // namespace
}  // namespace understory
