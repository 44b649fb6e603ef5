// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// For libFuzzer (-DUNDERSTORY_FUZZ=ON with clang): ten bytes of the input are a frame, whose second
// byte says whether its checksum is to be made right, so that what lies behind it is reached.
#include <cstddef>
#include <cstdint>

#include "fuzz/can_target.hpp"
#include "support/frame_noise.hpp"

// NOLINTNEXTLINE(readability-identifier-naming): libFuzzer calls it so
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using understory::can::Frame;
  using understory::can::kMessages;
  constexpr std::size_t kBytes = 10;
  understory::test::CanTarget target;
  for (; size >= kBytes; data += kBytes, size -= kBytes) {
    Frame frame;
    frame.id = kMessages[data[0] % kMessages.size()].id;
    frame.length = data[1] < 16 ? static_cast<std::uint8_t>(data[1] % 9U) : 8;
    for (std::size_t i = 0; i < frame.data.size(); ++i) {
      frame.data[i] = data[i + 2];
    }
    target.take(data[1] % 2 == 0 ? frame : understory::test::with_right_checksum(frame));
  }
  return 0;
}
