// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/radio_outbox.hpp"

#include <cassert>
#include <cstddef>
#include <utility>

namespace understory {
namespace {

VehicleSet only(std::size_t vehicle) {
  return VehicleSet{1} << vehicle;
}

}  // namespace

RadioOutbox::RadioOutbox(VehicleSet receivers)
    : receivers_(receivers), queues_(kMostRadioVehicles) {}

void RadioOutbox::publish(team::Sample sample) {
  const auto place = history_.try_emplace(sample.key).first;
  Newest& newest = place->second;
  const Order old_order = newest.order;
  newest.order = Order(sample.key.kind, ++publications_);
  newest.sample = std::make_shared<const team::Sample>(std::move(sample));
  for (VehicleSet left = receivers_; left != 0; left &= left - 1) {
    auto& ready = queues_[static_cast<std::size_t>(__builtin_ctz(left))].ready;
    ready.erase(old_order);
    ready.emplace_hint(ready.end(), newest.order, place);
  }
  newest.missing = receivers_;
}

RadioOutbox::Offer RadioOutbox::next_for(VehicleSet receivers) const {
  const std::pair<const Order, History::const_iterator>* first = nullptr;
  for (VehicleSet left = receivers; left != 0; left &= left - 1) {
    const auto& ready = queues_[static_cast<std::size_t>(__builtin_ctz(left))].ready;
    if (!ready.empty() && (first == nullptr || ready.begin()->first < first->first)) {
      first = &*ready.begin();
    }
  }
  if (first == nullptr) {
    return {team::SampleKind::kState, 0, nullptr};
  }
  return {std::get<0>(first->first), std::get<1>(first->first), first->second->second.sample};
}

VehicleSet RadioOutbox::missing(const Offer& offer) const {
  return history_.at(offer.sample->key).missing;
}

RadioOutbox::Newest& RadioOutbox::newest_of(const Offer& offer) {
  Newest& newest = history_.at(offer.sample->key);
  assert(newest.sample == offer.sample);
  return newest;
}

void RadioOutbox::note_received(const Offer& offer, int receiver) {
  const auto index = static_cast<std::size_t>(receiver);
  newest_of(offer).missing &= ~only(index);
  queues_[index].ready.erase(Order(offer.kind, offer.number));
}

void RadioOutbox::note_lost(const Offer& offer, int receiver, Time try_again_at) {
  Receiver& queue = queues_[static_cast<std::size_t>(receiver)];
  const Order order(offer.kind, offer.number);
  // What another one needed again was sent early for this one, who waits on.
  if (queue.ready.erase(order) > 0) {
    queue.retries.push_back({try_again_at, offer.sample->key, order});
  }
}

void RadioOutbox::release_retries(Time now) {
  for (VehicleSet left = receivers_; left != 0; left &= left - 1) {
    const auto index = static_cast<std::size_t>(__builtin_ctz(left));
    Receiver& queue = queues_[index];
    while (!queue.retries.empty() && queue.retries.front().due <= now) {
      const Retry& retry = queue.retries.front();
      const auto place = history_.find(retry.key);
      const Newest& newest = place->second;
      if (newest.order == retry.order && (newest.missing & only(index)) != 0) {
        queue.ready.emplace(newest.order, place);
      }
      queue.retries.pop_front();
    }
  }
}

void RadioOutbox::forget_receiver(int receiver) {
  const auto index = static_cast<std::size_t>(receiver);
  receivers_ &= ~only(index);
  for (auto& entry : history_) {
    entry.second.missing &= ~only(index);
  }
  queues_[index] = Receiver{};
}

}  // namespace understory
