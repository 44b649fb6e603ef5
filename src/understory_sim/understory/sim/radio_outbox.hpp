// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What one vehicle of a simulated team has published and who has not got it yet. Costs nothing
// while nobody in contact misses anything, however much others miss. Virtual time; one thread;
// nothing here can fail.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <tuple>
#include <vector>

#include "understory/base/time.hpp"
#include "understory/team/link.hpp"

namespace understory {

inline constexpr int kMostRadioVehicles = 32;
using VehicleSet = std::uint32_t;  // bit i: vehicle i

class RadioOutbox {
 public:
  // The newest sample of a key. Small kinds come first, then the oldest.
  struct Offer {
    team::SampleKind kind;
    std::uint64_t number;  // of publication
    std::shared_ptr<const team::Sample> sample;
  };

  // `receivers` are those who will have to get everything, from the first sample on.
  explicit RadioOutbox(VehicleSet receivers);

  void publish(team::Sample sample);

  // The first of what one of these misses and is not waiting to be sent again; null sample: none.
  [[nodiscard]] Offer next_for(VehicleSet receivers) const;
  // Who still misses what next_for has just offered, those for whom it waits included.
  [[nodiscard]] VehicleSet missing(const Offer& offer) const;

  void note_received(const Offer& offer, int receiver);
  void note_lost(const Offer& offer, int receiver, Time try_again_at);
  void release_retries(Time now);

  // No longer needs anything.
  void forget_receiver(int receiver);

 private:
  using Order = std::tuple<team::SampleKind, std::uint64_t>;
  struct Newest {
    std::shared_ptr<const team::Sample> sample;
    Order order;
    VehicleSet missing = 0;
  };
  using History = std::map<team::SampleKey, Newest>;
  struct Retry {
    Time due;
    team::SampleKey key;
    Order order;  // of the version that was lost
  };
  struct Receiver {
    std::map<Order, History::const_iterator> ready;
    std::deque<Retry> retries;  // by time
  };

  [[nodiscard]] Newest& newest_of(const Offer& offer);

  VehicleSet receivers_;
  std::uint64_t publications_ = 0;
  History history_;
  std::vector<Receiver> queues_;  // by vehicle
};

}  // namespace understory
