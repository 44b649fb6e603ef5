// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/team/fused_map.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

namespace understory::team {
namespace {

using Row = std::array<std::int16_t, kTileVoxels>;

constexpr Row bits_of_row() {
  Row bits{};
  for (unsigned x = 0; x < bits.size(); ++x) {
    bits[x] = static_cast<std::int16_t>(static_cast<std::uint16_t>(1U << x));
  }
  return bits;
}
constexpr Row kBits = bits_of_row();

// What a layer adds to a voxel. One that says occupied outweighs one that says free, just.
struct Votes {
  std::int16_t free;
  std::int16_t occupied;
};

Votes votes_of(const SensorModel& model) {
  return {static_cast<std::int16_t>(model.min),
          static_cast<std::int16_t>(std::max(model.occupied_threshold, -model.min))};
}

// Adds the votes of 16 voxels, in lanes of the same width so that it becomes vector operations.
void add_votes(const Votes& votes, unsigned free, unsigned occupied, Row& sums) {
  const auto free_bits = static_cast<std::int16_t>(free);
  const auto occupied_bits = static_cast<std::int16_t>(occupied);
  for (std::size_t x = 0; x < sums.size(); ++x) {
    const int from_free = (free_bits & kBits[x]) != 0 ? votes.free : 0;
    const int from_occupied = (occupied_bits & kBits[x]) != 0 ? votes.occupied : 0;
    sums[x] = static_cast<std::int16_t>(sums[x] + from_free + from_occupied);
  }
}

void write_row(const Row& sums, unsigned known, const SensorModel& model, std::int8_t* log_odds) {
  const auto known_bits = static_cast<std::int16_t>(known);
  const auto min = static_cast<std::int16_t>(model.min);
  const auto max = static_cast<std::int16_t>(model.max);
  for (std::size_t x = 0; x < sums.size(); ++x) {
    const std::int16_t clamped = std::min(std::max(sums[x], min), max);
    const bool is_known = (known_bits & kBits[x]) != 0;
    log_odds[x] = static_cast<std::int8_t>(is_known ? clamped : std::int16_t{kUnknownLogOdds});
  }
}

std::uint16_t negative_among(const Row& sums) {
  std::int16_t negative = 0;
  for (std::size_t x = 0; x < sums.size(); ++x) {
    negative = static_cast<std::int16_t>(negative | (sums[x] < 0 ? kBits[x] : 0));
  }
  return static_cast<std::uint16_t>(negative);
}

// Whether anything is known.
bool fuse_row(const std::vector<const LayerTile*>& layers,
              const SensorModel& model,
              std::size_t row,
              Tile& fused) {
  const Votes votes = votes_of(model);
  Row sums{};
  unsigned known = 0;
  for (const LayerTile* layer : layers) {
    const unsigned maybe_free = layer->maybe_free_rows[row];
    const unsigned maybe_solid = layer->maybe_solid_rows[row];
    known |= maybe_free | maybe_solid;
    add_votes(votes, maybe_free & ~maybe_solid, maybe_solid & ~maybe_free, sums);
  }
  if (known == 0) {
    return false;
  }
  write_row(sums, known, model, &fused.log_odds[row * kTileVoxels]);
  fused.known_rows[row] = static_cast<std::uint16_t>(known);
  fused.free_rows[row] = static_cast<std::uint16_t>(known & negative_among(sums));
  return true;
}

// Null if they know nothing.
TilePtr fused_of(const std::vector<const LayerTile*>& layers, const SensorModel& model) {
  auto fused = std::make_shared<Tile>();
  bool is_known = false;
  for (std::size_t row = 0; row < kRowsPerTile; ++row) {
    is_known = fuse_row(layers, model, row, *fused) || is_known;
  }
  return is_known ? fused : nullptr;
}

MapSnapshot unknown_map(const GridGeometry& geometry, const SensorModel& sensor_model) {
  MapSnapshot map{geometry, sensor_model, 0, Time{}, {}, {}};
  map.tiles.resize(geometry.slot_count());
  return map;
}

std::uint64_t fnv(std::uint64_t hash, std::uint64_t value) {
  constexpr std::uint64_t kPrime = 1099511628211U;
  return (hash ^ value) * kPrime;
}

}  // namespace

FusedMap::FusedMap(const TeamConfig& team,
                   const GridGeometry& geometry,
                   const SensorModel& sensor_model)
    : own_id_(static_cast<std::size_t>(team.id)),
      fused_(unknown_map(geometry, sensor_model)),
      is_stale_(geometry.slot_count()) {
  if (team.size < 1 || team.id < 0 || team.id >= team.size) {
    throw ConfigError("team: id must be 0 .. size - 1");
  }
  layers_.resize(static_cast<std::size_t>(team.size), std::vector<Layer>(geometry.slot_count()));
}

MapSnapshotPtr FusedMap::update_own(const MapSnapshot& own) {
  assert(own.geometry == fused_.geometry && own.tiles.size() == fused_.tiles.size());
  own_changes_.clear();
  if (has_own_ && own.revision == own_revision_ + 1) {
    for (const TileSlot slot : own.changed_tiles) {
      update_own_layer(slot, own.tiles[slot].get());
    }
  } else {
    for (TileSlot slot = 0; slot < own.tiles.size(); ++slot) {
      update_own_layer(slot, own.tiles[slot].get());
    }
  }
  has_own_ = true;
  own_revision_ = own.revision;
  fused_.stamp = own.stamp;
  fused_.intruders_m = own.intruders_m;
  ++fused_.revision;
  fused_.changed_tiles.clear();
  std::sort(stale_slots_.begin(), stale_slots_.end());
  for (const TileSlot slot : stale_slots_) {
    is_stale_[slot] = false;
    if (fuse(slot)) {
      fused_.changed_tiles.push_back(slot);
    }
  }
  stale_slots_.clear();
  return std::make_shared<const MapSnapshot>(fused_);
}

void FusedMap::update_own_layer(TileSlot slot, const Tile* tile) {
  LayerTilePtr& known = layers_[own_id_][slot].content;
  if (tile == nullptr) {
    return;
  }
  const LayerTile layer = layer_of(*tile, fused_.sensor_model);
  if (known ? *known == layer : layer.is_unknown()) {
    return;
  }
  known = std::make_shared<const LayerTile>(layer);
  own_changes_.push_back(slot);
  mark_stale(slot);
}

bool FusedMap::accept(std::uint8_t vehicle,
                      TileSlot slot,
                      std::uint64_t version,
                      const LayerTile& layer) {
  if (vehicle >= layers_.size() || vehicle == own_id_ || slot >= fused_.tiles.size()) {
    return false;
  }
  Layer& known = layers_[vehicle][slot];
  if (version <= known.version) {
    return false;
  }
  known.version = version;
  if (known.content ? *known.content == layer : layer.is_unknown()) {
    return true;
  }
  known.content = std::make_shared<const LayerTile>(layer);
  mark_stale(slot);
  return true;
}

const LayerTilePtr& FusedMap::own_layer(TileSlot slot) const {
  return layers_[own_id_][slot].content;
}

void FusedMap::mark_stale(TileSlot slot) {
  if (!is_stale_[slot]) {
    is_stale_[slot] = true;
    stale_slots_.push_back(slot);
  }
}

bool FusedMap::fuse(TileSlot slot) {
  std::vector<const LayerTile*> layers;
  for (const std::vector<Layer>& of_vehicle : layers_) {
    if (of_vehicle[slot].content) {
      layers.push_back(of_vehicle[slot].content.get());
    }
  }
  TilePtr fused = fused_of(layers, fused_.sensor_model);
  TilePtr& before = fused_.tiles[slot];
  const bool is_same = fused && before ? fused->log_odds == before->log_odds : fused == before;
  if (is_same) {
    return false;
  }
  before = std::move(fused);
  return true;
}

std::uint64_t FusedMap::digest() const {
  return digest_of(fused_);
}

std::uint64_t digest_of(const MapSnapshot& map) {
  std::uint64_t hash = 14695981039346656037U;
  for (TileSlot slot = 0; slot < map.tiles.size(); ++slot) {
    if (!map.tiles[slot]) {
      continue;
    }
    hash = fnv(hash, slot);
    for (const std::int8_t log_odds : map.tiles[slot]->log_odds) {
      hash = fnv(hash, static_cast<std::uint8_t>(log_odds));
    }
  }
  return hash;
}

}  // namespace understory::team
