// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// One vehicle's side of the exchange with its team: what to send and when, what to believe of what
// arrives. It knows no carrier: samples go to a Link and come from one. World frame, SI units,
// times of this vehicle's clock. Memory is bounded by team size and map. Whatever arrives, nothing
// throws; what is not believed is counted by reason. Deterministic; used by one thread.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "understory/team/clock_estimate.hpp"
#include "understory/team/fused_map.hpp"
#include "understory/team/link.hpp"
#include "understory/team/peer.hpp"
#include "understory/team/sample_codec.hpp"
#include "understory/team/team_config.hpp"
#include "understory/team/tile_blocks.hpp"
#include "understory/team/tile_outbox.hpp"

namespace understory::team {

enum class Rejection : std::uint8_t {
  kOwnId,
  kOutsideTeam,
  kOversized,
  kMalformed,
  kForeignProtocol,
  kForeignGeometry,
  kStale,     // known already, or superseded
  kClockOff,  // the position is believed, the trajectory is not
};
inline constexpr std::size_t kRejectionCount = 8;
[[nodiscard]] const char* to_string(Rejection rejection);

struct Counters {
  struct Traffic {
    std::uint64_t samples = 0;
    std::uint64_t bytes = 0;  // of payload
  };
  // By kind: state, trajectory, tile block.
  std::array<Traffic, 3> sent{};
  std::array<Traffic, 3> accepted{};
  std::array<std::uint64_t, kRejectionCount> rejected{};

  [[nodiscard]] std::uint64_t rejected_for(Rejection reason) const {
    return rejected[static_cast<std::size_t>(reason)];
  }
};

struct OwnState {
  Vector3d position_m = Vector3d::Zero();
  Vector3d velocity_mps = Vector3d::Zero();
  double yaw_rad = 0.0;
  FlightMode mode = FlightMode::kExplorer;
  MissionState state = MissionState::kWaiting;
  std::optional<Vector3d> target_m;
  TrajectoryPtr trajectory;  // the newest; null if there is none
};

class Exchange {
 public:
  // `session` grows from start to start, as the time of the start in microseconds does. ConfigError
  // if the id is not of the team, or a session of 2^51 and more.
  Exchange(const TeamConfig& config,
           const GridGeometry& geometry,
           const SensorModel& sensor_model,
           std::uint64_t session);

  // The newest map of what this vehicle itself has seen; returns the fused one (see FusedMap).
  [[nodiscard]] MapSnapshotPtr on_map(const MapSnapshot& own, Time now);
  // `now`: when it arrived, as exactly as is known.
  void receive(const Sample& sample, Time now);
  // What is to be published now. To be asked at least at the state rate.
  [[nodiscard]] std::vector<Sample> due(const OwnState& own, Time now);

  // Those of whose state a word has come, by id.
  [[nodiscard]] Peers peers(Time now) const;
  // Of a team mate's clock over this one, as far as can be told.
  [[nodiscard]] std::optional<Duration> clock_offset(std::uint8_t vehicle) const;
  [[nodiscard]] const Counters& counters() const { return counters_; }
  [[nodiscard]] std::uint64_t map_digest() const { return fused_.digest(); }

 private:
  struct Mate {
    std::uint64_t state_version = 0;
    std::optional<StateSample> state;  // times of its clock
    Time heard_at{};
    std::uint64_t trajectory_version = 0;
    std::uint64_t trajectory_session = 0;
    TrajectoryPtr told;        // times of its clock
    TrajectoryPtr trajectory;  // times of this clock
    Duration mapped_by{};      // clock offset that led from one to the other
    ClockEstimate clock;
  };

  // Why it is not believed; none: it is.
  [[nodiscard]] std::optional<Rejection> refusal_of(const Sample& sample) const;
  std::optional<Rejection> take(const Sample& sample, Time now);
  std::optional<Rejection> take_state(const Sample& sample, const StateSample& state, Time now);
  std::optional<Rejection> take_trajectory(const Sample& sample, const TrajectorySample& told);
  std::optional<Rejection> take_tiles(const Sample& sample, const TileBlockSample& tiles);
  [[nodiscard]] bool is_clock_believed(const Mate& mate) const;
  static void map_trajectory(Mate& mate);

  void append_state(const OwnState& own, Time now, std::vector<Sample>& due);
  void append_trajectory(const OwnState& own, std::vector<Sample>& due);
  void append_tiles(Time now, std::vector<Sample>& due);
  // The own layers of a block, if they are others than those sent last.
  [[nodiscard]] std::optional<std::vector<LayerTile>> unsent_layers(BlockIndex block);
  [[nodiscard]] std::vector<Echo> echoes(Time now) const;
  [[nodiscard]] SampleHeader next_header();
  void append(const SampleKey& key,
              const SampleHeader& header,
              Encoded encoded,
              std::vector<Sample>& due);

  TeamConfig config_;
  GridGeometry geometry_;
  std::uint64_t session_;
  std::uint64_t sample_count_ = 0;
  std::uint32_t geometry_hash_;
  FusedMap fused_;
  TileBlocks blocks_;
  TileOutbox outbox_;
  std::vector<LayerTilePtr> sent_layers_;  // by slot
  std::optional<Time> next_state_at_;
  std::optional<std::uint64_t> sent_trajectory_id_;
  std::vector<Mate> mates_;  // by id
  Counters counters_;
};

}  // namespace understory::team
