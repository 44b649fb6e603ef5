// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/port/tx_queue.hpp"

#include <algorithm>

namespace understory::can {
namespace {

// A little below zero is the time between the reading of the clock and an arrival; far below, the
// clock was set back, and nothing is known about the age.
bool is_within(Time begin, Time now, Duration limit) {
  return now - begin <= limit && begin - now <= limit;
}

std::uint8_t counter_of(const Frame& frame) {
  return static_cast<std::uint8_t>(frame.data[1] & 0xFU);
}

}  // namespace

TxQueue::TxQueue(const IdSet& allowed, const IdSet& set) : allowed_(allowed) {
  slots_.reserve(allowed.count());
  for (std::size_t id = 0; id < kIdCount; ++id) {
    if (allowed[id]) {
      slot_of_[id] = static_cast<std::uint16_t>(slots_.size());
      slots_.emplace_back();
      slots_.back().is_in_set = set[id];
    }
  }
}

void TxQueue::push(const Frame& frame, Time now) {
  if (frame.id >= kIdCount || !allowed_[frame.id]) {
    ++counters_.refused;
    return;
  }
  Slot& slot = slots_[slot_of_[frame.id]];
  if (slot.is_in_set && !joins_set(frame, now)) {
    ++counters_.dropped_with_set;
    return;
  }
  counters_.replaced += slot.is_waiting ? 1 : 0;
  slot.frame = frame;
  slot.queued = now;
  slot.is_waiting = true;
}

// False: frames of its set were dropped, so the receiver cannot make use of this one.
bool TxQueue::joins_set(const Frame& frame, Time now) {
  const bool is_same =
      set_begun_ && set_counter_ == counter_of(frame) && is_within(*set_begun_, now, kDeadline);
  if (!is_same) {
    drop_set(counters_.replaced);
    set_counter_ = counter_of(frame);
    set_begun_ = now;
    is_set_sent_ = false;
    is_set_dropped_ = false;
  }
  return !is_set_dropped_;
}

void TxQueue::drop_set(std::uint64_t& counter) {
  std::uint64_t dropped = 0;
  for (Slot& slot : slots_) {
    dropped += slot.is_in_set && slot.is_waiting ? 1 : 0;
    slot.is_waiting = slot.is_waiting && !slot.is_in_set;
  }
  counter += dropped;
  counters_.torn_sets += dropped > 0 && is_set_sent_ ? 1 : 0;
  is_set_dropped_ = true;
}

void TxQueue::pump(CanPort& port, Time now) {
  if (session_ && *session_ != port.session()) {
    purge();
  }
  session_ = port.session();
  give_up_in_flight(now);
  if (retry_at_ && now < *retry_at_ && is_within(*retry_at_, now, kRetry)) {
    return;
  }
  retry_at_.reset();
  // A dead bus must not gather a queue in the kernel.
  while (flying_count_ < (is_stalled_ ? 1 : kWindow)) {
    Slot* const slot = first_waiting();
    if (slot == nullptr) {
      return;
    }
    if (!is_within(slot->queued, now, kDeadline)) {
      expire(*slot);
    } else if (!hand_over(port, *slot, now)) {
      return;
    }
  }
}

TxQueue::Slot* TxQueue::first_waiting() {
  const auto found =
      std::find_if(slots_.begin(), slots_.end(), [](const Slot& slot) { return slot.is_waiting; });
  return found == slots_.end() ? nullptr : &*found;
}

void TxQueue::expire(Slot& slot) {
  if (slot.is_in_set) {
    drop_set(counters_.expired);
    return;
  }
  slot.is_waiting = false;
  ++counters_.expired;
}

bool TxQueue::hand_over(CanPort& port, Slot& slot, Time now) {
  switch (port.send(slot.frame)) {
    case SendResult::kSent:
      slot.is_waiting = false;
      is_set_sent_ = is_set_sent_ || slot.is_in_set;
      flying_[flying_count_] = {slot.frame, now};
      ++flying_count_;
      ++counters_.sent;
      return true;
    case SendResult::kFull:
      ++counters_.full;
      retry_at_ = now + kRetry;
      if (slot.is_in_set) {
        drop_set(counters_.dropped_with_set);
      }
      return false;
    case SendResult::kDown:
      purge();
      return false;
  }
  return false;
}

void TxQueue::give_up_in_flight(Time now) {
  while (flying_count_ > 0) {
    Flying& oldest = flying_.front();
    if (now < oldest.sent) {  // the clock was set back
      oldest.sent = now;
    }
    if (now - oldest.sent < kEchoTimeout) {
      return;
    }
    is_stalled_ = is_stalled_ || !last_echo_ || now - *last_echo_ >= kEchoTimeout;
    ++counters_.unconfirmed;
    land(0);
  }
}

void TxQueue::confirm(const Frame& frame, Time now) {
  const auto* const begin = flying_.data();
  const auto* const end = begin + flying_count_;
  const auto* found =
      std::find_if(begin, end, [&](const Flying& flying) { return flying.frame == frame; });
  if (found == end) {
    found =
        std::find_if(begin, end, [&](const Flying& flying) { return flying.frame.id == frame.id; });
  }
  if (found == end) {
    ++counters_.unknown_echoes;
  } else {
    // What was sent before has lost its echo: it would have come first.
    const auto overtaken = static_cast<std::size_t>(found - begin);
    for (std::size_t i = 0; i < overtaken; ++i) {
      ++counters_.unconfirmed;
      land(0);
    }
    ++counters_.confirmed;
    land(0);
  }
  last_echo_ = now;
  is_stalled_ = false;
  retry_at_.reset();
}

void TxQueue::land(std::size_t index) {
  for (std::size_t i = index + 1; i < flying_count_; ++i) {
    flying_[i - 1] = flying_[i];
  }
  --flying_count_;
}

void TxQueue::purge() {
  counters_.purged += waiting() + flying_count_;
  for (Slot& slot : slots_) {
    slot.is_waiting = false;
  }
  flying_count_ = 0;
  retry_at_.reset();
  is_set_dropped_ = true;
}

std::size_t TxQueue::waiting() const {
  return static_cast<std::size_t>(std::count_if(
      slots_.begin(), slots_.end(), [](const Slot& slot) { return slot.is_waiting; }));
}

std::optional<Time> TxQueue::wake_at() const {
  std::optional<Time> wake;
  if (flying_count_ > 0) {
    wake = flying_.front().sent + kEchoTimeout;
  }
  if (retry_at_ && waiting() > 0) {
    wake = wake ? std::min(*wake, *retry_at_) : *retry_at_;
  }
  return wake;
}

}  // namespace understory::can
