// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// One vehicle's end of the simulated radio: what it has to send, what has arrived, and what its
// transmitter was used for. Virtual time; one thread; nothing here can fail.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "understory/base/rng.hpp"
#include "understory/sim/radio.hpp"
#include "understory/sim/radio_outbox.hpp"

namespace understory {

class RadioStation : public team::Link {
 public:
  RadioStation(int vehicle, int vehicles, const Rng& rng);

  void publish(team::Sample sample) override;
  [[nodiscard]] std::vector<team::Sample> take() override;

  [[nodiscard]] bool is_on() const { return is_on_; }
  void switch_off();

  [[nodiscard]] RadioOutbox& outbox() { return outbox_; }
  [[nodiscard]] const RadioUse& use() const { return use_; }
  [[nodiscard]] Time free_at() const { return free_at_; }

  // There is somebody more who hears it.
  void note_contact(Time now) { contact_at_ = now; }
  // The transmitter is busy until `end`.
  void note_sent(std::uint64_t bytes, Time end);
  // Whether the receiver misses a packet of this vehicle.
  [[nodiscard]] bool draw_loss(double loss, int receiver);

  // From another vehicle. As a reader with KEEP_LAST 1 it holds the newest sample of every key.
  void receive(int sender, std::shared_ptr<const team::Sample> sample);
  void note_missed() { ++use_.samples_lost; }

 private:
  struct Arrival {
    std::uint64_t number = 0;
    std::shared_ptr<const team::Sample> sample;
  };
  struct Transmission {
    Time end;
    std::uint64_t bytes = 0;
  };

  RadioOutbox outbox_;
  std::vector<Rng> loss_rngs_;  // by receiver
  bool is_on_ = true;
  Time free_at_{};
  std::map<std::pair<int, team::SampleKey>, Arrival> inbox_;
  std::uint64_t arrivals_ = 0;
  std::deque<Transmission> last_second_;
  std::uint64_t bytes_in_last_second_ = 0;
  std::optional<Time> contact_at_;
  RadioUse use_;
};

}  // namespace understory
