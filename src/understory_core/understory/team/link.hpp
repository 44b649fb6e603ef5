// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// The seam between what a team exchanges and what carries it: samples, of which the newest wins
// per key. A carrier brings each vehicle's newest sample of every key to every vehicle in contact,
// in any order, perhaps more than once; what was superseded on the way may never arrive, and what
// was missed out of contact arrives after it. Payloads are opaque to the carrier. One thread.
#pragma once

#include <cstdint>
#include <tuple>
#include <vector>

namespace understory::team {

enum class SampleKind : std::uint8_t { kState = 1, kTrajectory = 2, kTileBlock = 3 };

struct SampleKey {
  std::uint8_t vehicle = 0;  // who made it, 0 .. 254
  SampleKind kind = SampleKind::kState;
  std::uint32_t item = 0;  // of a tile block: its index; else 0

  friend bool operator<(const SampleKey& a, const SampleKey& b) {
    return std::tie(a.vehicle, a.kind, a.item) < std::tie(b.vehicle, b.kind, b.item);
  }
  friend bool operator==(const SampleKey& a, const SampleKey& b) {
    return std::tie(a.vehicle, a.kind, a.item) == std::tie(b.vehicle, b.kind, b.item);
  }
};

struct Sample {
  SampleKey key;
  std::uint64_t version = 0;  // of one key, later ones are greater
  std::vector<std::uint8_t> payload;
};

class Link {
 public:
  Link() = default;
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;
  virtual ~Link() = default;

  // Replaces what was published under the same key before. Never blocks.
  virtual void publish(Sample sample) = 0;
  // What has arrived from others since the last call, in order of arrival.
  [[nodiscard]] virtual std::vector<Sample> take() = 0;
};

}  // namespace understory::team
