// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/radio.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <string>
#include <utility>

#include "understory/sim/forest_truth.hpp"
#include "understory/sim/radio_station.hpp"

namespace understory {
namespace {

VehicleSet only(int vehicle) {
  return VehicleSet{1} << static_cast<unsigned>(vehicle);
}

Duration time_to_send(std::uint64_t bytes, double rate_bytes_per_s) {
  // Rounded up, so that the rate is never exceeded.
  return Duration(
      static_cast<Duration::rep>(std::ceil(static_cast<double>(bytes) / rate_bytes_per_s * 1e6)));
}

bool is_cut(const std::vector<RadioCutConfig>& cuts, Time now) {
  return std::any_of(cuts.begin(), cuts.end(), [&](const RadioCutConfig& cut) {
    return to_seconds(now) >= cut.from_s && to_seconds(now) < cut.to_s;
  });
}

void check(const RadioConfig& config, int vehicles, bool has_predicate) {
  if (vehicles < 1 || vehicles > kMostRadioVehicles) {
    throw ConfigError("radio: 1 to " + std::to_string(kMostRadioVehicles) + " vehicles, not " +
                      std::to_string(vehicles));
  }
  for (const RadioCutConfig& cut : config.cuts) {
    if (cut.to_s < cut.from_s) {
      throw ConfigError("radio.cuts: to_s before from_s");
    }
  }
  if (config.occlusion && !has_predicate) {
    throw ConfigError("radio.occlusion: nobody says what is in between");
  }
}

}  // namespace

bool trunk_between(const ForestTruth& truth, const Vector3d& from_m, const Vector3d& to_m) {
  const double height_m = truth.forest().trunk_height_m;
  Vector3d low = from_m;
  Vector3d high = to_m;
  if (low.z() > high.z()) {
    std::swap(low, high);
  }
  if (low.z() > height_m) {
    return false;
  }
  if (high.z() > height_m) {  // only what lies below the tops
    high = low + (height_m - low.z()) / (high.z() - low.z()) * (high - low);
  }
  return truth.trunks().touches_line(low.head<2>(), high.head<2>());
}

SimulatedRadio::SimulatedRadio(const RadioConfig& config,
                               int vehicles,
                               const Rng& rng,
                               LineBlocked is_blocked)
    : config_(config), is_blocked_(std::move(is_blocked)) {
  check(config_, vehicles, static_cast<bool>(is_blocked_));
  for (int vehicle = 0; vehicle < vehicles; ++vehicle) {
    stations_.push_back(std::make_unique<RadioStation>(vehicle, vehicles, rng));
  }
  contacts_.resize(stations_.size());
}

SimulatedRadio::~SimulatedRadio() = default;

RadioStation& SimulatedRadio::station(int vehicle) const {
  return *stations_[static_cast<std::size_t>(vehicle)];
}

team::Link& SimulatedRadio::link(int vehicle) {
  return station(vehicle);
}

const RadioUse& SimulatedRadio::use(int vehicle) const {
  return station(vehicle).use();
}

bool SimulatedRadio::are_in_contact(int a, int b) const {
  return (contacts_[static_cast<std::size_t>(a)] & only(b)) != 0;
}

void SimulatedRadio::switch_off(int vehicle) {
  station(vehicle).switch_off();
  contacts_[static_cast<std::size_t>(vehicle)] = 0;
  for (std::size_t other = 0; other < stations_.size(); ++other) {
    contacts_[other] &= ~only(vehicle);
    stations_[other]->outbox().forget_receiver(vehicle);
  }
}

void SimulatedRadio::find_contacts(Time now, const std::vector<Vector3d>& positions_m) {
  std::fill(contacts_.begin(), contacts_.end(), 0);
  if (is_cut(config_.cuts, now)) {
    return;
  }
  for (std::size_t a = 0; a < stations_.size(); ++a) {
    for (std::size_t b = a + 1; b < stations_.size(); ++b) {
      const bool are_on = stations_[a]->is_on() && stations_[b]->is_on();
      if (are_on &&
          (positions_m[a] - positions_m[b]).squaredNorm() <= config_.range_m * config_.range_m &&
          !(config_.occlusion && is_blocked_(positions_m[a], positions_m[b]))) {
        contacts_[a] |= only(static_cast<int>(b));
        contacts_[b] |= only(static_cast<int>(a));
      }
    }
  }
}

void SimulatedRadio::advance(Time now, const std::vector<Vector3d>& positions_m) {
  assert(positions_m.size() == stations_.size());
  assert(!has_advanced_ || now >= advanced_to_);
  const Time begin = has_advanced_ ? advanced_to_ : now;
  const std::vector<VehicleSet> before = contacts_;
  find_contacts(now, positions_m);
  for (std::size_t vehicle = 0; vehicle < stations_.size(); ++vehicle) {
    if ((contacts_[vehicle] & ~before[vehicle]) != 0) {
      stations_[vehicle]->note_contact(now);
    }
  }
  for (std::size_t sender = 0; sender < stations_.size(); ++sender) {
    send(static_cast<int>(sender), begin, now);
  }
  deliver(now);
  advanced_to_ = now;
  has_advanced_ = true;
}

void SimulatedRadio::send(int sender, Time begin, Time end) {
  RadioStation& from = station(sender);
  const VehicleSet receivers = contacts_[static_cast<std::size_t>(sender)];
  from.outbox().release_retries(begin);
  Time start = std::max(from.free_at(), begin);
  while (start < end) {
    const RadioOutbox::Offer offer = from.outbox().next_for(receivers);
    if (!offer.sample) {
      return;
    }
    const std::uint64_t bytes =
        offer.sample->payload.size() + static_cast<std::uint64_t>(config_.header_bytes);
    start += time_to_send(bytes, config_.rate_bytes_per_s);
    from.note_sent(bytes, start);
    transmit(sender, offer, start);
  }
}

void SimulatedRadio::transmit(int sender, const RadioOutbox::Offer& offer, Time sent_at) {
  RadioStation& from = station(sender);
  RadioOutbox& outbox = from.outbox();
  const VehicleSet hearing = contacts_[static_cast<std::size_t>(sender)] & outbox.missing(offer);
  for (VehicleSet left = hearing; left != 0; left &= left - 1) {
    const int receiver = __builtin_ctz(left);
    if (from.draw_loss(config_.loss, receiver)) {
      station(receiver).note_missed();
      outbox.note_lost(offer, receiver, sent_at + duration_from_seconds(config_.retry_s));
    } else {
      outbox.note_received(offer, receiver);
      in_flight_.push_back({sent_at + duration_from_seconds(config_.delay_s),
                            ++flights_,
                            sender,
                            receiver,
                            offer.sample});
      std::push_heap(in_flight_.begin(), in_flight_.end());
    }
  }
}

void SimulatedRadio::deliver(Time now) {
  while (!in_flight_.empty() && in_flight_.front().arrives_at <= now) {
    std::pop_heap(in_flight_.begin(), in_flight_.end());
    const Flight flight = std::move(in_flight_.back());
    in_flight_.pop_back();
    if (station(flight.receiver).is_on()) {
      station(flight.receiver).receive(flight.sender, flight.sample);
    }
  }
}

}  // namespace understory
