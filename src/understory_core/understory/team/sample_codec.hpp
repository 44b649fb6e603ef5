// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Samples as bytes and back (samples.proto). World frame, SI units; times are of the sender's
// clock, to the microsecond, lengths to the millimetre, angles to 0.1 mrad. Encoding takes finite
// values. Decoding takes any bytes: what it returns is finite, within bounds and complete, and a
// trajectory ends at rest.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "understory/mission_state.hpp"
#include "understory/plan/trajectory.hpp"
#include "understory/team/layer_tile.hpp"
#include "understory/team/link.hpp"

namespace understory::team {

inline constexpr std::uint32_t kProtocolVersion = 2;
inline constexpr std::size_t kMaxTeam = 32;

using Encoded = std::vector<std::uint8_t>;

// What every sample begins with.
struct SampleHeader {
  std::uint32_t protocol = kProtocolVersion;
  std::uint32_t geometry_hash = 0;
  std::uint64_t session = 0;  // of the sender; below 2^51
  std::uint64_t count = 0;    // of samples that it made before in this session
};

inline constexpr unsigned kSessionShift = 12;
// Greater for later samples, also over a restart, unless sessions follow so closely upon each other
// that one is shorter than its samples / 4096.
[[nodiscard]] constexpr std::uint64_t version_of(const SampleHeader& header) {
  return (header.session << kSessionShift) + header.count;
}

// The newest word of a team mate that the sender has: its stamp comes back, with how long ago that
// word arrived.
struct Echo {
  std::uint8_t vehicle = 0;
  std::uint64_t session = 0;  // of the team mate
  Time stamp{};               // of the team mate's clock
  Duration held{};
};

struct StateSample {
  SampleHeader header;
  Time stamp{};
  Vector3d position_m = Vector3d::Zero();
  Vector3d velocity_mps = Vector3d::Zero();
  double yaw_rad = 0.0;
  FlightMode mode = FlightMode::kExplorer;
  MissionState state = MissionState::kWaiting;
  std::optional<Vector3d> target_m;
  std::vector<Echo> echoes;
};

struct TrajectorySample {
  SampleHeader header;
  Trajectory trajectory;  // its limits are not told
};

struct TileBlockSample {
  SampleHeader header;
  std::uint32_t block = 0;        // see TileBlocks
  std::vector<LayerTile> layers;  // of its tiles
};

[[nodiscard]] std::uint32_t hash_of(const GridGeometry& geometry);

[[nodiscard]] std::size_t max_payload_bytes(SampleKind kind);

[[nodiscard]] Encoded encode(const StateSample& sample);
[[nodiscard]] Encoded encode(const TrajectorySample& sample);
[[nodiscard]] Encoded encode(const TileBlockSample& sample);

// The header alone, of any kind of sample: the rest need not be of this protocol.
[[nodiscard]] std::optional<SampleHeader> decode_header(const Encoded& payload);
[[nodiscard]] std::optional<StateSample> decode_state(const Encoded& payload);
[[nodiscard]] std::optional<TrajectorySample> decode_trajectory(const Encoded& payload);
[[nodiscard]] std::optional<TileBlockSample> decode_tile_block(const Encoded& payload);

}  // namespace understory::team
