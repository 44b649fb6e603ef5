// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// The receiver of one message from one sender: decodes it and checks its counter. One thread; no
// allocation; cannot fail.
#pragma once

#include <optional>

#include "understory/can/codec.hpp"
#include "understory/can/receiver.hpp"

namespace understory::can {

template <class Message>
class Inbox {
 public:
  // Of a frame with this message's identifier: what is new and right of it.
  [[nodiscard]] std::optional<Received<Message>> take(const Frame& frame) {
    const Result<Received<Message>, FrameError> received = decode<Message>(frame);
    if (!received) {
      check_.reject();
      return std::nullopt;
    }
    if (check_.accept(received->counter) != Verdict::kGood) {
      return std::nullopt;
    }
    return *received;
  }

  [[nodiscard]] const CounterCheck& check() const { return check_; }

 private:
  CounterCheck check_;
};

// The counter that a sender puts into its frames of one message.
class Outbox {
 public:
  [[nodiscard]] std::uint8_t next() {
    counter_ = static_cast<std::uint8_t>((counter_ + 1U) & 0xFU);
    return counter_;
  }

 private:
  std::uint8_t counter_ = 0xF;
};

}  // namespace understory::can
