// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Float minimum and maximum for loops that the compiler is to vectorise.
#pragma once

namespace understory {

// These forms, unlike std::max and fmax, become one SSE instruction without -ffast-math. Where `a`
// is NaN they give `b`.
[[nodiscard]] inline float larger(float a, float b) {
  return a > b ? a : b;
}
[[nodiscard]] inline float smaller(float a, float b) {
  return a < b ? a : b;
}

}  // namespace understory
