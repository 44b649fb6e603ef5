// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Feeds as many frames as its argument says to all decoders and to a station of either side: random
// ones, and those of a real flight with bits altered. The same frames every time.
#include <cstdio>
#include <cstdlib>
#include <exception>

#include "fuzz/can_target.hpp"
#include "support/frame_noise.hpp"
#include "support/station_pair.hpp"

namespace {

using understory::test::CanTarget;
using understory::test::FrameNoise;

// All that both sides send in a flight of a few seconds.
std::vector<understory::can::Frame> real_frames() {
  understory::test::StationPair pair;
  pair.run(std::chrono::seconds(1));
  pair.host.ask_arm();
  pair.run(std::chrono::seconds(2));
  std::vector<understory::can::Frame> frames;
  for (const auto* side : {&pair.from_host, &pair.from_vehicle}) {
    for (const understory::can::PortFrame& frame : *side) {
      frames.push_back(frame.frame);
    }
  }
  return frames;
}

}  // namespace

int main(int argc, char** argv) try {
  const long long count = argc > 1 ? std::strtoll(argv[1], nullptr, 10) : 0;
  if (count <= 0) {
    std::fputs("usage: understory_can_noise FRAMES\n", stderr);
    return 2;
  }
  FrameNoise noise(understory::Rng(20), real_frames());
  CanTarget target;
  for (long long i = 0; i < count; ++i) {
    target.take(i % 2 == 0 ? noise.random() : noise.altered());
  }
  std::printf("%lld frames, %llu of them with a right checksum\n",
              count,
              static_cast<unsigned long long>(target.decoded()));
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "understory_can_noise: %s\n", error.what());
  return 1;
}
