// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Signals in the 64 bits of a frame, little endian: bit 0 is the lowest bit of byte 0. The first 12
// bits (CRC and counter) belong to e2e.hpp. Values are physical, in SI units; NaN is "not
// available". Values; no allocation; what cannot be encoded or is forbidden is told by the result.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

namespace understory::can {

using Payload = std::uint64_t;

inline constexpr double kNotAvailable = std::numeric_limits<double>::quiet_NaN();

struct SignalLayout {
  unsigned start_bit;
  unsigned size_bits;
  bool is_signed;
  double factor;
  double offset;
  std::int64_t lowest;  // legal codes
  std::int64_t highest;
  std::int64_t not_available;
};

[[nodiscard]] constexpr Payload mask_of(unsigned size_bits) {
  return size_bits >= 64 ? ~Payload{0} : (Payload{1} << size_bits) - 1;
}

class PayloadWriter {
 public:
  void put(const SignalLayout& layout, double value) {
    std::int64_t code = layout.not_available;
    if (!std::isnan(value)) {
      const double scaled = (value - layout.offset) / layout.factor;
      // Also refuses what is infinite or would not fit an integer.
      if (!(scaled > static_cast<double>(layout.lowest) - 0.5) ||
          !(scaled < static_cast<double>(layout.highest) + 0.5)) {
        is_good_ = false;
        return;
      }
      code = std::llround(scaled);
    }
    payload_ |= (static_cast<Payload>(code) & mask_of(layout.size_bits)) << layout.start_bit;
  }

  void put_whole(unsigned start_bit, unsigned size_bits, std::uint32_t value) {
    is_good_ = is_good_ && (value & ~mask_of(size_bits)) == 0;
    payload_ |= (value & mask_of(size_bits)) << start_bit;
  }

  [[nodiscard]] std::optional<Payload> payload() const {
    return is_good_ ? std::optional<Payload>(payload_) : std::nullopt;
  }

 private:
  Payload payload_ = 0;
  bool is_good_ = true;
};

[[nodiscard]] inline std::uint32_t get_whole(Payload payload,
                                             unsigned start_bit,
                                             unsigned size_bits) {
  return static_cast<std::uint32_t>((payload >> start_bit) & mask_of(size_bits));
}

// False for a code that is neither legal nor "not available".
[[nodiscard]] inline bool get(const SignalLayout& layout, Payload payload, double& value) {
  auto code = static_cast<std::int64_t>((payload >> layout.start_bit) & mask_of(layout.size_bits));
  const std::int64_t sign_bit = std::int64_t{1} << (layout.size_bits - 1);
  if (layout.is_signed && (code & sign_bit) != 0) {
    code -= 2 * sign_bit;
  }
  if (code == layout.not_available) {
    value = kNotAvailable;
    return true;
  }
  value = static_cast<double>(code) * layout.factor + layout.offset;
  return code >= layout.lowest && code <= layout.highest;
}

}  // namespace understory::can
