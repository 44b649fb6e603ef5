// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/can/codec.hpp"

#include <cstdio>

#include "understory/can/crc.hpp"

namespace understory::can {
namespace {

constexpr Payload kHeaderMask = 0xFFF;

}  // namespace

const char* to_string(FrameError error) {
  switch (error) {
    case FrameError::kOtherId:
      return "another identifier";
    case FrameError::kLength:
      return "not 8 bytes";
    case FrameError::kChecksum:
      return "wrong checksum";
    case FrameError::kForbiddenCode:
      return "forbidden code";
  }
  return "unknown";
}

std::string to_candump(const Frame& frame) {
  std::array<char, 24> text{};
  int length = std::snprintf(text.data(), text.size(), "%03X#", static_cast<unsigned>(frame.id));
  std::string line(text.data(), static_cast<std::size_t>(length));
  for (std::size_t i = 0; i < frame.length && i < frame.data.size(); ++i) {
    length = std::snprintf(text.data(), text.size(), "%02X", static_cast<unsigned>(frame.data[i]));
    line.append(text.data(), static_cast<std::size_t>(length));
  }
  return line;
}

Frame protect(std::uint16_t id, std::uint8_t data_id, std::uint8_t counter, Payload payload) {
  Frame frame;
  frame.id = id;
  const Payload counter_bits = static_cast<Payload>(counter & 0xFU) << 8U;
  const Payload word = (payload & ~kHeaderMask) | counter_bits;
  for (std::size_t i = 0; i < frame.data.size(); ++i) {
    frame.data[i] = static_cast<std::uint8_t>((word >> (8 * i)) & 0xFFU);
  }
  frame.data[0] = crc8h2f(frame.data.data() + 1, frame.data.size() - 1, data_id);
  return frame;
}

std::optional<Payload> unprotect(const Frame& frame, std::uint8_t data_id) {
  if (crc8h2f(frame.data.data() + 1, frame.data.size() - 1, data_id) != frame.data[0]) {
    return std::nullopt;
  }
  Payload word = 0;
  for (std::size_t i = 0; i < frame.data.size(); ++i) {
    word |= static_cast<Payload>(frame.data[i]) << (8 * i);
  }
  return word;
}

}  // namespace understory::can
