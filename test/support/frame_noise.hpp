// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Frames as no station sends them: random ones, real ones with bits altered, and real ones whose
// data are altered and whose checksum is right. Deterministic.
#pragma once

#include <vector>

#include "understory/base/rng.hpp"
#include "understory/can/codec.hpp"

namespace understory::test {

// With the checksum that its receiver expects; frames of no message stay as they are.
[[nodiscard]] inline can::Frame with_right_checksum(const can::Frame& frame) {
  can::Payload payload = 0;
  for (std::size_t i = frame.data.size(); i-- > 0;) {
    payload = (payload << 8U) | frame.data[i];
  }
  const auto counter = static_cast<std::uint8_t>(frame.data[1] & 0xFU);
  for (std::size_t i = 0; i < can::kMessages.size(); ++i) {
    if (can::kMessages[i].id == frame.id) {
      // docs/can_protocol.md: 0x11 and 7 more for each message before.
      return can::protect(frame.id, static_cast<std::uint8_t>(0x11U + 7U * i), counter, payload);
    }
  }
  return frame;
}

class FrameNoise {
 public:
  FrameNoise(const Rng& rng, std::vector<can::Frame> real) : rng_(rng), real_(std::move(real)) {}

  [[nodiscard]] can::Frame random() {
    can::Frame frame;
    const bool is_known = rng_.below(8) != 0;
    frame.id = is_known ? can::kMessages[rng_.below(can::kMessages.size())].id
                        : static_cast<std::uint16_t>(rng_.below(2048));
    frame.length = rng_.below(16) == 0 ? static_cast<std::uint8_t>(rng_.below(9)) : 8;
    std::uint64_t bits = rng_.next();
    for (std::uint8_t& byte : frame.data) {
      byte = static_cast<std::uint8_t>(bits & 0xFFU);
      bits >>= 8U;
    }
    return frame;
  }
  // In one to three bits, which the checksum always finds.
  [[nodiscard]] can::Frame altered() {
    can::Frame frame = next_real();
    const std::uint64_t first = rng_.below(64);
    const std::uint64_t gap = 1 + rng_.below(31);  // so that they are different ones
    const std::uint64_t count = 1 + rng_.below(3);
    for (std::uint64_t i = 0; i < count; ++i) {
      const std::uint64_t bit = (first + i * gap) % 64;
      frame.data[bit / 8] = static_cast<std::uint8_t>(frame.data[bit / 8] ^ (1U << (bit % 8)));
    }
    return frame;
  }
  // What a faulty gateway may send; the counter is that of the real one.
  [[nodiscard]] can::Frame altered_with_right_checksum() {
    can::Frame frame = next_real();
    for (std::uint64_t bits = 1 + rng_.below(4); bits > 0; --bits) {
      const std::uint64_t bit = 16 + rng_.below(48);
      frame.data[bit / 8] = static_cast<std::uint8_t>(frame.data[bit / 8] ^ (1U << (bit % 8)));
    }
    return with_right_checksum(frame);
  }

 private:
  [[nodiscard]] can::Frame next_real() {
    next_ = (next_ + 1) % real_.size();
    return real_[next_];
  }

  Rng rng_;
  std::vector<can::Frame> real_;
  std::size_t next_ = 0;
};

}  // namespace understory::test
