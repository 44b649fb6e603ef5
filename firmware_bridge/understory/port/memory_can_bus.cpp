// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/port/memory_can_bus.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

#include "understory/can/wire_length.hpp"

namespace understory::can {
namespace {

constexpr std::int64_t kNanoseconds = 1'000'000'000;
constexpr std::int64_t kNsPerUs = 1'000;
constexpr std::size_t kReceiveRoom = 4096;
constexpr std::size_t kLateRoom = 1024;

std::int64_t to_ns(Time time) {
  return time.time_since_epoch().count() * kNsPerUs;
}

// Never before the bits were there.
Time to_time(std::int64_t ns) {
  return Time(Duration((ns + kNsPerUs - 1) / kNsPerUs));
}

bool hits(Rng& rng, double probability) {
  return probability > 0.0 && rng.uniform() < probability;
}

}  // namespace

BusStation::BusStation(std::size_t hardware_queue)
    : to_send(hardware_queue), received(kReceiveRoom) {}

void BusStation::deliver(const PortFrame& frame) {
  if (!received.push(frame)) {
    ++counters.overflows;
    return;
  }
  counters.received += frame.is_own ? 0 : 1;
  has_arrivals = true;
}

void BusStation::change_to(PortState next) {
  if (next == state) {
    return;
  }
  to_send.clear();
  received.clear();
  if (next == PortState::kUp) {
    ++session;
    ++counters.reopened;
  }
  state = next;
  has_changed = true;
}

MemoryCanBus::MemoryCanBus(int bits_per_s, const Rng& rng)
    : bits_per_s_(bits_per_s),
      loss_(rng.fork("loss")),
      echo_loss_(rng.fork("echo loss")),
      duplication_(rng.fork("duplication")),
      delay_(rng.fork("delay")),
      corruption_(rng.fork("corruption")) {
  assert(bits_per_s > 0);
  late_.reserve(kLateRoom);
}

std::unique_ptr<MemoryCanPort> MemoryCanBus::open(std::size_t hardware_queue) {
  stations_.push_back(std::make_unique<BusStation>(hardware_queue));
  return std::make_unique<MemoryCanPort>(*this, *stations_.back());
}

std::int64_t MemoryCanBus::duration_ns(int bits) const {
  return bits * kNanoseconds / bits_per_s_;
}

std::optional<std::int64_t> MemoryCanBus::next_start_ns() const {
  std::optional<Time> earliest;
  for (const auto& station : stations_) {
    if (!station->to_send.is_empty()) {
      const Time since = station->to_send.front().since;
      earliest = earliest ? std::min(*earliest, since) : since;
    }
  }
  return earliest ? std::optional<std::int64_t>(std::max(free_ns_, to_ns(*earliest)))
                  : std::nullopt;
}

// Of what is queued by then, the lowest identifier.
BusStation* MemoryCanBus::winner(std::int64_t start_ns) const {
  BusStation* best = nullptr;
  for (const auto& station : stations_) {
    if (station->to_send.is_empty() || to_ns(station->to_send.front().since) > start_ns) {
      continue;
    }
    if (best == nullptr || station->to_send.front().frame.id < best->to_send.front().frame.id) {
      best = station.get();
    }
  }
  return best;
}

std::optional<Time> MemoryCanBus::next_arrival() const {
  std::optional<Time> next;
  if (transmission_) {
    next = to_time(transmission_->end_ns);
  } else if (const std::optional<std::int64_t> start_ns = next_start_ns()) {
    const Frame& frame = winner(*start_ns)->to_send.front().frame;
    next = to_time(*start_ns + duration_ns(wire_bits(frame)));
  }
  if (!late_.empty() && (!next || late_.front().arrival < *next)) {
    next = late_.front().arrival;
  }
  return next;
}

void MemoryCanBus::advance(Time until) {
  while (step(until)) {
  }
  now_ = std::max(now_, until);
}

bool MemoryCanBus::step(Time until) {
  assert(!is_delivering_);
  const std::optional<std::int64_t> start_ns = transmission_ ? std::nullopt : next_start_ns();
  const bool is_late_next =
      !late_.empty() &&
      (!transmission_ || late_.front().arrival < to_time(transmission_->end_ns)) &&
      (!start_ns || to_ns(late_.front().arrival) <= *start_ns);
  if (is_late_next) {
    if (late_.front().arrival > until) {
      return false;
    }
    deliver_late();
    call_stations();
    return true;
  }
  if (transmission_) {
    if (to_time(transmission_->end_ns) > until) {
      return false;
    }
    finish();
    call_stations();
    return true;
  }
  if (!start_ns || *start_ns >= to_ns(until)) {
    return false;
  }
  begin(*start_ns);
  return true;
}

void MemoryCanBus::begin(std::int64_t start_ns) {
  BusStation* const sender = winner(start_ns);
  const int bits = wire_bits(sender->to_send.front().frame);
  transmission_ = {sender, sender->session, start_ns + duration_ns(bits)};
  free_ns_ = start_ns + duration_ns(bits + kInterframeBits);
  busy_ns_ += free_ns_ - start_ns;
}

void MemoryCanBus::finish() {
  const Transmission done = *transmission_;
  transmission_.reset();
  now_ = std::max(now_, to_time(done.end_ns));
  BusStation& sender = *done.sender;
  if (sender.state != PortState::kUp || sender.session != done.session) {
    return;  // it left the bus in the middle of the frame
  }
  const Frame frame = sender.to_send.front().frame;
  sender.to_send.pop();
  for (const auto& receiver : stations_) {
    if (receiver.get() != done.sender && receiver->state == PortState::kUp) {
      pass_on(frame, *receiver);
    }
  }
  if (!hits(echo_loss_, faults_.echo_loss)) {
    sender.deliver({frame, now_, true});
  }
}

void MemoryCanBus::pass_on(const Frame& frame, BusStation& receiver) {
  if (faults_.dropped[frame.id % kIdCount] || hits(loss_, faults_.loss)) {
    return;
  }
  const Frame copy = hits(corruption_, faults_.corruption) ? corrupted(frame) : frame;
  const int copies = hits(duplication_, faults_.duplication) ? 2 : 1;
  for (int i = 0; i < copies; ++i) {
    if (!hits(delay_, faults_.delay)) {
      receiver.deliver({copy, now_, false});
      continue;
    }
    const auto longest = static_cast<std::uint64_t>(faults_.longest_delay.count());
    const Duration delay(
        1 + static_cast<Duration::rep>(delay_.below(std::max(longest, std::uint64_t{1}))));
    late_.push_back({now_ + delay, late_order_++, &receiver, copy});
    std::push_heap(late_.begin(), late_.end(), &MemoryCanBus::is_later);
  }
}

Frame MemoryCanBus::corrupted(Frame frame) {
  if (frame.length > 0) {
    const std::size_t length = std::min<std::size_t>(frame.length, frame.data.size());
    const std::size_t at = corruption_.below(length);
    frame.data[at] = static_cast<std::uint8_t>(frame.data[at] ^ (1U + corruption_.below(255)));
  }
  return frame;
}

bool MemoryCanBus::is_later(const Late& left, const Late& right) {
  return left.arrival != right.arrival ? left.arrival > right.arrival : left.order > right.order;
}

void MemoryCanBus::deliver_late() {
  std::pop_heap(late_.begin(), late_.end(), &MemoryCanBus::is_later);
  const Late late = late_.back();
  late_.pop_back();
  now_ = std::max(now_, late.arrival);
  if (late.receiver->state == PortState::kUp) {
    late.receiver->deliver({late.frame, now_, false});
  }
}

// By index: an arrival function may open a port.
void MemoryCanBus::call_stations() {
  is_delivering_ = true;
  for (std::size_t i = 0; i < stations_.size(); ++i) {
    BusStation& station = *stations_[i];
    if (std::exchange(station.has_arrivals, false) && station.on_arrival) {
      station.on_arrival();
    }
  }
  is_delivering_ = false;
}

MemoryCanPort::~MemoryCanPort() {
  station_.change_to(PortState::kGone);
  station_.on_arrival = nullptr;
}

SendResult MemoryCanPort::send(const Frame& frame) {
  assert(frame.id < kIdCount && frame.length <= frame.data.size());
  if (station_.state != PortState::kUp) {
    return SendResult::kDown;
  }
  if (!station_.to_send.push({frame, bus_.now()})) {
    ++station_.counters.full;
    return SendResult::kFull;
  }
  ++station_.counters.sent;
  return SendResult::kSent;
}

std::size_t MemoryCanPort::receive(PortFrame* frames, std::size_t most) {
  std::size_t count = 0;
  for (; count < most && !station_.received.is_empty(); ++count) {
    frames[count] = station_.received.front();
    station_.received.pop();
  }
  return count;
}

void MemoryCanPort::wait(Duration at_most, WaitFor what) {
  if (bus_.is_delivering()) {
    return;
  }
  const Time until = bus_.now() + at_most;
  const bool can_arrivals_wait = what == WaitFor::kChanges;
  while ((can_arrivals_wait || station_.received.is_empty()) && !station_.has_changed) {
    if (!bus_.step(until)) {
      bus_.advance(until);
      break;
    }
  }
  station_.has_changed = false;
}

void MemoryCanPort::set_on_arrival(std::function<void()> on_arrival) {
  station_.on_arrival = std::move(on_arrival);
}

}  // namespace understory::can
