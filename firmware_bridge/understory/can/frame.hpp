// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// A classic CAN data frame with an 11-bit identifier. A value; nothing here can fail.
#pragma once

#include <array>
#include <cstdint>
#include <string>

namespace understory::can {

struct Frame {
  std::uint16_t id = 0;
  std::uint8_t length = 8;
  std::array<std::uint8_t, 8> data{};

  [[nodiscard]] bool operator==(const Frame& other) const {
    return id == other.id && length == other.length && data == other.data;
  }
};

// As candump and cansend write it: 101#E803000030F8FFFF.
[[nodiscard]] std::string to_candump(const Frame& frame);

}  // namespace understory::can
