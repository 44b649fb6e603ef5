// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// A set of 11-bit identifiers. A value; nothing here can fail.
#pragma once

#include <bitset>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <initializer_list>

namespace understory::can {

inline constexpr std::size_t kIdCount = 2048;

using IdSet = std::bitset<kIdCount>;

[[nodiscard]] inline IdSet id_set(std::initializer_list<std::uint16_t> ids) {
  IdSet set;
  for (const std::uint16_t id : ids) {
    assert(id < kIdCount);
    set[id] = true;
  }
  return set;
}

}  // namespace understory::can
