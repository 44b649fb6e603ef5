// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Messages to frames and back, protected end to end. Source: AUTOSAR E2E profile 2, with one data
// identifier per message (docs/can_protocol.md). encode: nothing when a value is infinite or out of
// range; nothing is ever clamped. decode: the message and its counter, or what is wrong with the
// frame. Pure functions, any thread, no allocation.
#pragma once

#include <cstdint>
#include <optional>

#include "understory/base/result.hpp"
#include "understory/can/frame.hpp"
#include "understory/can/messages.hpp"

namespace understory::can {

enum class FrameError : std::uint8_t {
  kOtherId,
  kLength,
  kChecksum,
  kForbiddenCode,  // protected rightly, but a signal has a code that the protocol does not allow
};
[[nodiscard]] const char* to_string(FrameError error);

template <class Message>
struct Received {
  Message message;
  std::uint8_t counter = 0;  // 0 .. 15
};

// The frame of a payload, with counter and checksum. The payload's header bits are overwritten.
[[nodiscard]] Frame protect(std::uint16_t id,
                            std::uint8_t data_id,
                            std::uint8_t counter,
                            Payload payload);
// Nothing when the checksum is wrong for this data identifier.
[[nodiscard]] std::optional<Payload> unprotect(const Frame& frame, std::uint8_t data_id);

template <class Message>
[[nodiscard]] std::optional<Frame> encode(const Message& message, std::uint8_t counter) {
  const std::optional<Payload> payload = to_payload(message);
  return payload ? std::optional<Frame>(protect(Message::kId, Message::kDataId, counter, *payload))
                 : std::nullopt;
}

template <class Message>
[[nodiscard]] Result<Received<Message>, FrameError> decode(const Frame& frame) {
  if (frame.id != Message::kId) {
    return FrameError::kOtherId;
  }
  if (frame.length != frame.data.size()) {
    return FrameError::kLength;
  }
  const std::optional<Payload> payload = unprotect(frame, Message::kDataId);
  if (!payload) {
    return FrameError::kChecksum;
  }
  Received<Message> received;
  received.counter = static_cast<std::uint8_t>((*payload >> 8U) & 0xFU);
  if (!from_payload(*payload, received.message)) {
    return FrameError::kForbiddenCode;
  }
  return received;
}

}  // namespace understory::can
