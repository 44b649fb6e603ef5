// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/can/wire_length.hpp"

#include <algorithm>

namespace understory::can {
namespace {

constexpr int kIdBits = 11;
constexpr int kCrcBits = 15;
constexpr unsigned kCrcPolynomial = 0x4599;
constexpr int kMostEqual = 5;
// CRC delimiter, acknowledge slot and its delimiter, end of frame.
constexpr int kTailBits = 10;

class WireCounter {
 public:
  // The lowest `count` bits of `value`, the highest of them first.
  void put(unsigned value, int count) {
    for (int i = count - 1; i >= 0; --i) {
      const unsigned bit = (value >> static_cast<unsigned>(i)) & 1U;
      const unsigned feedback = bit ^ ((crc_ >> (kCrcBits - 1)) & 1U);
      crc_ = ((crc_ << 1U) & ((1U << kCrcBits) - 1U)) ^ (feedback != 0 ? kCrcPolynomial : 0U);
      stuff(bit);
    }
  }
  [[nodiscard]] unsigned crc() const { return crc_; }
  [[nodiscard]] int bits() const { return bits_; }

 private:
  void stuff(unsigned bit) {
    equal_ = bit == last_ ? equal_ + 1 : 1;
    last_ = bit;
    ++bits_;
    if (equal_ == kMostEqual) {
      ++bits_;
      last_ = 1U - bit;
      equal_ = 1;
    }
  }

  unsigned crc_ = 0;
  unsigned last_ = 1;  // the bus is recessive before
  int equal_ = 0;
  int bits_ = 0;
};

}  // namespace

int wire_bits(const Frame& frame) {
  const std::size_t length = std::min<std::size_t>(frame.length, frame.data.size());
  WireCounter wire;
  wire.put(0, 1);  // start of frame
  wire.put(frame.id, kIdBits);
  wire.put(0, 3);  // data frame, standard identifier, reserved
  wire.put(static_cast<unsigned>(length), 4);
  for (std::size_t i = 0; i < length; ++i) {
    wire.put(frame.data[i], 8);
  }
  wire.put(wire.crc(), kCrcBits);
  return wire.bits() + kTailBits;
}

}  // namespace understory::can
