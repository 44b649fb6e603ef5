// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <benchmark/benchmark.h>

#include "understory/can/codec.hpp"

namespace understory::can {
namespace {

SpPosXy position() {
  SpPosXy message;
  message.sp_x_m = 12.345;
  message.sp_y_m = -67.89;
  return message;
}

void can_encode_position(benchmark::State& state) {
  SpPosXy message = position();
  std::uint8_t counter = 0;
  for (auto _ : state) {
    message.sp_x_m += 0.001;
    counter = static_cast<std::uint8_t>((counter + 1U) & 0xFU);
    benchmark::DoNotOptimize(encode(message, counter));
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(can_encode_position)->Name("Can_Encode/position");

void can_decode_position(benchmark::State& state) {
  const Frame frame = encode(position(), 3).value();
  for (auto _ : state) {
    benchmark::DoNotOptimize(frame);
    benchmark::DoNotOptimize(decode<SpPosXy>(frame));
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(can_decode_position)->Name("Can_Decode/position");

}  // namespace
}  // namespace understory::can
