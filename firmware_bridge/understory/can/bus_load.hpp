// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What a set of periodic messages asks of a bus at worst: its load and the longest time from when a
// message is due to when it was received. Source: R. I. Davis, A. Burns, R. J. Bril, J. J. Lukkien,
// "Controller Area Network (CAN) schedulability analysis: refuted, revisited and revised",
// Real-Time Systems 35, 2007. Pure functions; nothing here can fail.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "understory/base/time.hpp"

namespace understory::can {

struct PeriodicMessage {
  std::uint16_t id = 0;  // the lowest wins
  Duration period{0};
  Duration jitter{0};  // how much later than due it may be queued
  int data_bytes = 8;
};

// 1.0: the bus is never free.
[[nodiscard]] double worst_load(const std::vector<PeriodicMessage>& messages, int bits_per_s);

// Of the message with this identifier, which is one of them. Nothing: there is no bound.
[[nodiscard]] std::optional<Duration> worst_response(const std::vector<PeriodicMessage>& messages,
                                                     std::uint16_t id,
                                                     int bits_per_s);

}  // namespace understory::can
