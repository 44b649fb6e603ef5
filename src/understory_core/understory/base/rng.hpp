// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Seeded random numbers that are the same on every machine: xoshiro256** (Blackman and Vigna 2018)
// seeded by SplitMix64, with distributions of our own because the standard ones differ between
// libraries. Every consumer forks its own stream by name, so that one more draw in one place moves
// nothing elsewhere. Not thread-safe.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace understory {

class Rng {
 public:
  explicit Rng(std::uint64_t seed);

  // A stream that depends on this stream's seed and the name alone, not on what was drawn so far.
  [[nodiscard]] Rng fork(std::string_view name) const;

  [[nodiscard]] std::uint64_t next();
  [[nodiscard]] double uniform();                          // [0, 1)
  [[nodiscard]] double uniform(double low, double high);   // [low, high)
  [[nodiscard]] std::uint64_t below(std::uint64_t count);  // 0 .. count - 1, count > 0
  [[nodiscard]] double normal();                           // mean 0, deviation 1

 private:
  std::uint64_t seed_;
  std::array<std::uint64_t, 4> state_;
};

}  // namespace understory
