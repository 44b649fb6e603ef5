// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// How many bit times a classic frame takes on the wire, with its stuff bits. Source: ISO 11898-1
// (frame format, 15-bit CRC 0x4599, a stuff bit after five equal ones from the start of frame to
// the end of the CRC). Pure functions; nothing here can fail.
#pragma once

#include "understory/can/frame.hpp"

namespace understory::can {

inline constexpr int kInterframeBits = 3;

// From the start of frame to the end of frame.
[[nodiscard]] int wire_bits(const Frame& frame);

// The most that a frame of so many data bytes can take, interframe space included.
[[nodiscard]] constexpr int worst_case_bits(int data_bytes) {
  const int stuffed_bits = 34 + 8 * data_bytes;
  return stuffed_bits + 13 + (stuffed_bits - 1) / 4;
}

}  // namespace understory::can
