// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Which blocks of own tiles are to be told next: those that have settled or waited for long, what
// changed first comes first, and no more than the configured rate (a token bucket of one second). A
// value.
#pragma once

#include <cstddef>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "understory/base/time.hpp"
#include "understory/team/team_config.hpp"
#include "understory/team/tile_blocks.hpp"

namespace understory::team {

class TileOutbox {
 public:
  TileOutbox(const ExchangeConfig& config, std::size_t block_count);

  void note_change(BlockIndex block, Time now);
  // The next to be sent now, which is no longer waiting then; none: nothing is ready, or no more
  // may be sent.
  [[nodiscard]] std::optional<BlockIndex> next(Time now);
  void note_sent(std::size_t bytes);

 private:
  struct Change {
    Time first{};  // since it was sent
    Time last{};
  };

  [[nodiscard]] bool is_ready(const Change& change, Time now) const;
  void refill(Time now);

  Duration settle_;
  Duration max_wait_;
  double rate_bytes_per_s_;
  double budget_bytes_;  // below 0: the last one sent took more than there was
  std::optional<Time> refilled_at_;
  std::vector<std::optional<Change>> changes_;     // by block
  std::set<std::pair<Time, BlockIndex>> waiting_;  // by time of the first change
};

}  // namespace understory::team
