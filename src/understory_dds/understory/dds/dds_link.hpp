// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Carries samples between vehicles by DDS, reliably and without a server: whoever comes into
// contact, for the first time or again, gets the newest sample of every key, from the vehicle that
// published it. That vehicle's history dies with the link. Nothing waits for anybody: while a
// vehicle is out of contact, samples are replaced as they would be in contact. Construction throws
// ConfigError when the network cannot be used; later there is nothing but counters. The threads
// are those of CycloneDDS; a link itself belongs to one thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "understory/dds/dds_config.hpp"
#include "understory/team/link.hpp"

namespace understory::dds {

// Of one sample; longer ones neither leave nor arrive.
inline constexpr std::size_t kMaxPayloadBytes = std::size_t{256} * 1024;
inline constexpr std::size_t kMostPerTake = 256;

// Since the construction.
struct DdsCounters {
  std::uint64_t sent = 0;
  std::uint64_t refused = 0;  // too long, or not taken by DDS
  std::uint64_t received = 0;
  std::uint64_t malformed = 0;  // arrived, and was dropped
};

class DdsLink : public team::Link {
 public:
  explicit DdsLink(const DdsConfig& config);
  DdsLink(const DdsLink&) = delete;
  DdsLink& operator=(const DdsLink&) = delete;
  ~DdsLink() override;

  void publish(team::Sample sample) override;
  // At most kMostPerTake, in any order among keys; the rest is for the next call. One key may come
  // again with a version that was here before, namely after a silence.
  [[nodiscard]] std::vector<team::Sample> take() override;

  [[nodiscard]] const DdsCounters& counters() const { return counters_; }
  // Links that this one knows of, be they in contact or silent for less than the lease.
  [[nodiscard]] std::size_t mates() const;

 private:
  std::int32_t domain_ = 0;  // handles of CycloneDDS
  std::int32_t reader_ = 0;
  std::int32_t writer_ = 0;
  DdsCounters counters_;
};

}  // namespace understory::dds
