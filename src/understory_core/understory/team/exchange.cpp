// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/team/exchange.hpp"

#include <algorithm>
#include <utility>

namespace understory::team {
namespace {

constexpr std::uint64_t kSessionEnd = std::uint64_t{1} << 51U;
// What of a changing clock estimate is worth mapping a trajectory anew.
constexpr Duration kMappingTolerance{1000};

std::size_t index_of(SampleKind kind) {
  return static_cast<std::size_t>(kind) - 1;
}

bool is_known_kind(SampleKind kind) {
  return kind == SampleKind::kState || kind == SampleKind::kTrajectory ||
         kind == SampleKind::kTileBlock;
}

void count(Counters::Traffic& traffic, const Sample& sample) {
  ++traffic.samples;
  traffic.bytes += sample.payload.size();
}

}  // namespace

const char* to_string(Rejection rejection) {
  switch (rejection) {
    case Rejection::kOwnId:
      return "own id";
    case Rejection::kOutsideTeam:
      return "id outside the team";
    case Rejection::kOversized:
      return "oversized";
    case Rejection::kMalformed:
      return "malformed";
    case Rejection::kForeignProtocol:
      return "foreign protocol";
    case Rejection::kForeignGeometry:
      return "foreign geometry";
    case Rejection::kStale:
      return "stale";
    case Rejection::kClockOff:
      return "clock too far off";
  }
  return "invalid rejection";
}

Exchange::Exchange(const TeamConfig& config,
                   const GridGeometry& geometry,
                   const SensorModel& sensor_model,
                   std::uint64_t session)
    : config_(config),
      geometry_(geometry),
      session_(session),
      geometry_hash_(hash_of(geometry)),
      fused_(config, geometry, sensor_model),
      blocks_(geometry),
      outbox_(config.exchange, blocks_.count()),
      sent_layers_(geometry.slot_count()),
      mates_(static_cast<std::size_t>(config.size)) {
  if (session >= kSessionEnd) {
    throw ConfigError("team: session must be less than 2^51");
  }
}

MapSnapshotPtr Exchange::on_map(const MapSnapshot& own, Time now) {
  MapSnapshotPtr fused = fused_.update_own(own);
  for (const TileSlot slot : fused_.own_changes()) {
    outbox_.note_change(blocks_.block_of(slot), now);
  }
  return fused;
}

void Exchange::receive(const Sample& sample, Time now) {
  std::optional<Rejection> rejection = refusal_of(sample);
  if (!rejection) {
    rejection = take(sample, now);
  }
  if (rejection) {
    ++counters_.rejected[static_cast<std::size_t>(*rejection)];
  } else {
    count(counters_.accepted[index_of(sample.key.kind)], sample);
  }
}

std::optional<Rejection> Exchange::refusal_of(const Sample& sample) const {
  if (sample.key.vehicle == config_.id) {
    return Rejection::kOwnId;
  }
  if (sample.key.vehicle >= mates_.size()) {
    return Rejection::kOutsideTeam;
  }
  if (!is_known_kind(sample.key.kind)) {
    return Rejection::kMalformed;
  }
  if (sample.payload.size() > max_payload_bytes(sample.key.kind)) {
    return Rejection::kOversized;
  }
  const std::optional<SampleHeader> header = decode_header(sample.payload);
  if (!header) {
    return Rejection::kMalformed;
  }
  if (header->protocol != kProtocolVersion) {
    return Rejection::kForeignProtocol;
  }
  if (header->geometry_hash != geometry_hash_) {
    return Rejection::kForeignGeometry;
  }
  if (version_of(*header) != sample.version ||
      (sample.key.kind != SampleKind::kTileBlock && sample.key.item != 0)) {
    return Rejection::kMalformed;
  }
  return std::nullopt;
}

std::optional<Rejection> Exchange::take(const Sample& sample, Time now) {
  if (sample.key.kind == SampleKind::kState) {
    const std::optional<StateSample> state = decode_state(sample.payload);
    return state ? take_state(sample, *state, now) : Rejection::kMalformed;
  }
  if (sample.key.kind == SampleKind::kTrajectory) {
    const std::optional<TrajectorySample> trajectory = decode_trajectory(sample.payload);
    return trajectory ? take_trajectory(sample, *trajectory) : Rejection::kMalformed;
  }
  const std::optional<TileBlockSample> tiles = decode_tile_block(sample.payload);
  return tiles ? take_tiles(sample, *tiles) : Rejection::kMalformed;
}

std::optional<Rejection> Exchange::take_state(const Sample& sample,
                                              const StateSample& state,
                                              Time now) {
  Mate& mate = mates_[sample.key.vehicle];
  if (mate.state && sample.version <= mate.state_version) {
    return Rejection::kStale;
  }
  if (mate.state && mate.state->header.session != state.header.session) {
    mate.clock = ClockEstimate{};  // it has started anew, its clock perhaps too
  }
  mate.clock.add_one_way(state.stamp, now);
  for (const Echo& echo : state.echoes) {
    if (echo.vehicle == config_.id && echo.session == session_) {
      mate.clock.add_round_trip(echo.stamp, echo.held, state.stamp, now);
    }
  }
  mate.state_version = sample.version;
  mate.state = state;
  mate.heard_at = now;
  map_trajectory(mate);
  return is_clock_believed(mate) ? std::nullopt : std::optional(Rejection::kClockOff);
}

std::optional<Rejection> Exchange::take_trajectory(const Sample& sample,
                                                   const TrajectorySample& told) {
  Mate& mate = mates_[sample.key.vehicle];
  if (mate.told && sample.version <= mate.trajectory_version) {
    return Rejection::kStale;
  }
  mate.trajectory_version = sample.version;
  mate.trajectory_session = told.header.session;
  mate.told = std::make_shared<const Trajectory>(told.trajectory);
  mate.trajectory.reset();
  map_trajectory(mate);
  return is_clock_believed(mate) ? std::nullopt : std::optional(Rejection::kClockOff);
}

std::optional<Rejection> Exchange::take_tiles(const Sample& sample, const TileBlockSample& tiles) {
  if (tiles.block != sample.key.item || tiles.block >= blocks_.count() ||
      tiles.layers.size() != blocks_.slots_of(tiles.block).size()) {
    return Rejection::kMalformed;
  }
  const std::vector<TileSlot>& slots = blocks_.slots_of(tiles.block);
  for (std::size_t i = 0; i < slots.size(); ++i) {
    const VoxelIndex origin = geometry_.tile_of_slot(slots[i]) * kTileVoxels;
    if (!lies_within(tiles.layers[i], origin, geometry_.voxels())) {
      return Rejection::kMalformed;
    }
  }
  bool is_new = false;
  for (std::size_t i = 0; i < slots.size(); ++i) {
    is_new |= fused_.accept(sample.key.vehicle, slots[i], sample.version, tiles.layers[i]);
  }
  return is_new ? std::nullopt : std::optional(Rejection::kStale);
}

bool Exchange::is_clock_believed(const Mate& mate) const {
  const Duration most = duration_from_seconds(config_.exchange.max_clock_offset_s);
  const Duration offset = mate.clock.offset().value_or(Duration::zero());
  return offset <= most && offset >= -most;
}

void Exchange::map_trajectory(Mate& mate) {
  // One of a former start is not flown any more, and of a later one the clock is not known yet.
  if (!mate.told || !mate.state || mate.state->header.session != mate.trajectory_session) {
    mate.trajectory.reset();
    return;
  }
  const Duration offset = *mate.clock.offset();
  const Duration change = offset - mate.mapped_by;
  if (mate.trajectory && change <= kMappingTolerance && change >= -kMappingTolerance) {
    return;
  }
  auto mapped = std::make_shared<Trajectory>(*mate.told);
  mapped->start -= offset;
  mapped->depth_stamp -= offset;
  mate.trajectory = std::move(mapped);
  mate.mapped_by = offset;
}

std::vector<Sample> Exchange::due(const OwnState& own, Time now) {
  std::vector<Sample> due;
  append_state(own, now, due);
  append_trajectory(own, due);
  append_tiles(now, due);
  return due;
}

void Exchange::append_state(const OwnState& own, Time now, std::vector<Sample>& due) {
  const bool is_finite = own.position_m.allFinite() && own.velocity_mps.allFinite() &&
                         std::isfinite(own.yaw_rad) && (!own.target_m || own.target_m->allFinite());
  if (!is_finite || (next_state_at_ && now < *next_state_at_)) {
    return;
  }
  const Duration period = duration_from_seconds(1.0 / config_.exchange.state_rate_hz);
  // On a grid, so that the rate holds; after a gap from now on.
  const Time next = next_state_at_.value_or(now) + period;
  next_state_at_ = next > now ? next : now + period;
  StateSample sample;
  sample.header = next_header();
  sample.stamp = now;
  sample.position_m = own.position_m;
  sample.velocity_mps = own.velocity_mps;
  sample.yaw_rad = own.yaw_rad;
  sample.mode = own.mode;
  sample.state = own.state;
  sample.target_m = own.target_m;
  sample.echoes = echoes(now);
  append({static_cast<std::uint8_t>(config_.id), SampleKind::kState, 0},
         sample.header,
         encode(sample),
         due);
}

void Exchange::append_trajectory(const OwnState& own, std::vector<Sample>& due) {
  if (!own.trajectory || sent_trajectory_id_ == own.trajectory->id) {
    return;
  }
  sent_trajectory_id_ = own.trajectory->id;
  const TrajectorySample sample{next_header(), *own.trajectory};
  append({static_cast<std::uint8_t>(config_.id), SampleKind::kTrajectory, 0},
         sample.header,
         encode(sample),
         due);
}

void Exchange::append_tiles(Time now, std::vector<Sample>& due) {
  while (const std::optional<BlockIndex> block = outbox_.next(now)) {
    std::optional<std::vector<LayerTile>> layers = unsent_layers(*block);
    if (!layers) {
      continue;  // they have changed back
    }
    const auto item = static_cast<std::uint32_t>(*block);
    const TileBlockSample sample{next_header(), item, std::move(*layers)};
    append({static_cast<std::uint8_t>(config_.id), SampleKind::kTileBlock, item},
           sample.header,
           encode(sample),
           due);
    outbox_.note_sent(due.back().payload.size());
  }
}

std::optional<std::vector<LayerTile>> Exchange::unsent_layers(BlockIndex block) {
  std::vector<LayerTile> layers;
  bool is_new = false;
  for (const TileSlot slot : blocks_.slots_of(block)) {
    const LayerTilePtr& own = fused_.own_layer(slot);
    LayerTilePtr& sent = sent_layers_[slot];
    is_new |= own && !(sent && *sent == *own);
    sent = own;
    layers.push_back(own ? *own : LayerTile{});
  }
  return is_new ? std::optional(std::move(layers)) : std::nullopt;
}

std::vector<Echo> Exchange::echoes(Time now) const {
  std::vector<Echo> echoes;
  for (std::size_t id = 0; id < mates_.size(); ++id) {
    const Mate& mate = mates_[id];
    if (mate.state) {
      echoes.push_back({static_cast<std::uint8_t>(id),
                        mate.state->header.session,
                        mate.state->stamp,
                        now - mate.heard_at});
    }
  }
  return echoes;
}

SampleHeader Exchange::next_header() {
  return {kProtocolVersion, geometry_hash_, session_, ++sample_count_};
}

void Exchange::append(const SampleKey& key,
                      const SampleHeader& header,
                      Encoded encoded,
                      std::vector<Sample>& due) {
  due.push_back({key, version_of(header), std::move(encoded)});
  count(counters_.sent[index_of(key.kind)], due.back());
}

Peers Exchange::peers(Time now) const {
  const Duration timeout = duration_from_seconds(config_.exchange.contact_timeout_s);
  Peers peers;
  for (std::size_t id = 0; id < mates_.size(); ++id) {
    const Mate& mate = mates_[id];
    if (!mate.state) {
      continue;
    }
    Peer peer;
    peer.id = static_cast<std::uint8_t>(id);
    peer.heard_at = mate.heard_at;
    peer.stated_at = std::min(mate.heard_at, mate.state->stamp - *mate.clock.offset());
    peer.position_m = mate.state->position_m;
    peer.velocity_mps = mate.state->velocity_mps;
    peer.yaw_rad = mate.state->yaw_rad;
    peer.mode = mate.state->mode;
    peer.state = mate.state->state;
    peer.target_m = mate.state->target_m;
    peer.trajectory = is_clock_believed(mate) ? mate.trajectory : nullptr;
    peer.in_contact = now - mate.heard_at <= timeout;
    peers.push_back(std::move(peer));
  }
  return peers;
}

std::optional<Duration> Exchange::clock_offset(std::uint8_t vehicle) const {
  return vehicle < mates_.size() ? mates_[vehicle].clock.offset() : std::nullopt;
}

}  // namespace understory::team
