// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/team/tile_outbox.hpp"

#include <algorithm>

namespace understory::team {
namespace {

constexpr double kBucket_s = 1.0;

}  // namespace

TileOutbox::TileOutbox(const ExchangeConfig& config, std::size_t block_count)
    : settle_(duration_from_seconds(config.tile_settle_s)),
      max_wait_(duration_from_seconds(config.tile_max_wait_s)),
      rate_bytes_per_s_(config.tile_rate_bytes_per_s),
      budget_bytes_(kBucket_s * config.tile_rate_bytes_per_s),
      changes_(block_count) {}

void TileOutbox::note_change(BlockIndex block, Time now) {
  std::optional<Change>& change = changes_[block];
  if (change) {
    change->last = now;
  } else {
    change = Change{now, now};
    waiting_.emplace(now, block);
  }
}

std::optional<BlockIndex> TileOutbox::next(Time now) {
  refill(now);
  if (budget_bytes_ <= 0.0) {
    return std::nullopt;
  }
  const auto found = std::find_if(waiting_.begin(), waiting_.end(), [&](const auto& entry) {
    return is_ready(*changes_[entry.second], now);
  });
  if (found == waiting_.end()) {
    return std::nullopt;
  }
  const BlockIndex block = found->second;
  waiting_.erase(found);
  changes_[block].reset();
  return block;
}

void TileOutbox::note_sent(std::size_t bytes) {
  budget_bytes_ -= static_cast<double>(bytes);
}

bool TileOutbox::is_ready(const Change& change, Time now) const {
  return now - change.last >= settle_ || now - change.first >= max_wait_;
}

void TileOutbox::refill(Time now) {
  const double elapsed_s = refilled_at_ ? std::max(0.0, to_seconds(now - *refilled_at_)) : 0.0;
  budget_bytes_ =
      std::min(budget_bytes_ + elapsed_s * rate_bytes_per_s_, kBucket_s * rate_bytes_per_s_);
  refilled_at_ = now;
}

}  // namespace understory::team
