// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/radio_station.hpp"

#include <algorithm>
#include <string>

namespace understory {
namespace {

VehicleSet all_but(int vehicle, int vehicles) {
  const std::uint64_t all = (std::uint64_t{1} << static_cast<unsigned>(vehicles)) - 1;
  return static_cast<VehicleSet>(all & ~(std::uint64_t{1} << static_cast<unsigned>(vehicle)));
}

}  // namespace

RadioStation::RadioStation(int vehicle, int vehicles, const Rng& rng)
    : outbox_(all_but(vehicle, vehicles)) {
  for (int receiver = 0; receiver < vehicles; ++receiver) {
    loss_rngs_.push_back(
        rng.fork("from " + std::to_string(vehicle) + " to " + std::to_string(receiver)));
  }
}

void RadioStation::publish(team::Sample sample) {
  if (is_on_) {
    outbox_.publish(std::move(sample));
  }
}

std::vector<team::Sample> RadioStation::take() {
  std::vector<Arrival> arrivals;
  arrivals.reserve(inbox_.size());
  for (const auto& [key, arrival] : inbox_) {
    arrivals.push_back(arrival);
  }
  inbox_.clear();
  std::sort(arrivals.begin(), arrivals.end(), [](const Arrival& a, const Arrival& b) {
    return a.number < b.number;
  });
  std::vector<team::Sample> samples;
  samples.reserve(arrivals.size());
  for (const Arrival& arrival : arrivals) {
    samples.push_back(*arrival.sample);
  }
  return samples;
}

void RadioStation::switch_off() {
  is_on_ = false;
  outbox_ = RadioOutbox(0);
  inbox_.clear();
}

void RadioStation::note_sent(std::uint64_t bytes, Time end) {
  free_at_ = end;
  ++use_.samples_sent;
  use_.bytes_sent += bytes;
  last_second_.push_back({end, bytes});
  bytes_in_last_second_ += bytes;
  while (last_second_.front().end <= end - std::chrono::seconds(1)) {
    bytes_in_last_second_ -= last_second_.front().bytes;
    last_second_.pop_front();
  }
  use_.peak_bytes_in_a_second = std::max(use_.peak_bytes_in_a_second, bytes_in_last_second_);
  if (contact_at_ && last_second_.front().end - *contact_at_ > kCatchUp) {
    use_.steady_peak_bytes_in_a_second =
        std::max(use_.steady_peak_bytes_in_a_second, bytes_in_last_second_);
  }
}

bool RadioStation::draw_loss(double loss, int receiver) {
  return loss_rngs_[static_cast<std::size_t>(receiver)].uniform() < loss;
}

void RadioStation::receive(int sender, std::shared_ptr<const team::Sample> sample) {
  ++use_.samples_delivered;
  const std::pair<int, team::SampleKey> key(sender, sample->key);
  inbox_.insert_or_assign(key, Arrival{++arrivals_, std::move(sample)});
}

}  // namespace understory
