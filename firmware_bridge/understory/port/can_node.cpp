// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/port/can_node.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

namespace understory::can {

CanNode::CanNode(std::unique_ptr<CanPort> port, const CanNodeConfig& config)
    : port_(std::move(port)),
      queue_(config.transmits, config.set),
      guard_(config.receives),
      answers_(config.answers) {
  assert(port_ != nullptr);
}

void CanNode::run_until(Time now, Time until, FrameHandler& handler) {
  if (queue_.waiting() > 0 || now >= until) {
    now = poll(handler);
  }
  while (now < until) {
    // An echo makes room for what waits.
    const bool is_sending = queue_.in_flight() + queue_.waiting() > 0;
    const Time wake = std::min(until, queue_.wake_at().value_or(until));
    port_->wait(std::max(wake - now, Duration(0)),
                answers_ || is_sending ? WaitFor::kArrivals : WaitFor::kChanges);
    const Time before = now;
    now = poll(handler);
    if (now < before) {
      return;
    }
  }
}

Time CanNode::poll(FrameHandler& handler) {
  now_ = port_->now();
  // Again after sending, because on a vcan the echo is there at once. Bounded, because a flood may
  // come faster than it is handled.
  bool goes_on = true;
  for (int batches = 0; goes_on && batches < kMostBatches; ++batches) {
    const std::size_t count = port_->receive(batch_.data(), batch_.size());
    for (std::size_t i = 0; i < count; ++i) {
      handle(batch_[i], handler);
    }
    const std::uint64_t sent = queue_.counters().sent;
    queue_.pump(*port_, now_);
    goes_on = count == batch_.size() || queue_.counters().sent != sent;
  }
  return now_;
}

void CanNode::handle(const PortFrame& frame, FrameHandler& handler) {
  if (tap_) {
    tap_->on_port_frame(frame);
  }
  if (frame.is_own) {
    queue_.confirm(frame.frame, now_);
    handler.on_echo(frame);
    return;
  }
  if (queue_.allowed()[frame.frame.id % kIdCount]) {
    ++counters_.foreign_own_ids;
    return;
  }
  switch (guard_.accept(frame.frame.id, frame.stamp)) {
    case FloodGuard::Answer::kPass:
      ++counters_.received;
      handler.on_frame(frame);
      return;
    case FloodGuard::Answer::kFlood:
      ++counters_.flooded;
      last_flood_ = now_;
      return;
    case FloodGuard::Answer::kUnlisted:
      ++counters_.unlisted;
      return;
  }
}

bool CanNode::is_flooded() const {
  return last_flood_ && now_ >= *last_flood_ && now_ - *last_flood_ < kFloodHold;
}

}  // namespace understory::can
