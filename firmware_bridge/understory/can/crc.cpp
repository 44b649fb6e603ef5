// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/can/crc.hpp"

#include <array>

namespace understory::can {
namespace {

constexpr std::uint8_t kPolynomial8 = 0x2F;
constexpr std::uint32_t kPolynomial32 = 0x82F63B78;  // reflected

constexpr std::array<std::uint8_t, 256> make_table8() {
  std::array<std::uint8_t, 256> table{};
  for (unsigned i = 0; i < 256; ++i) {
    unsigned crc = i;
    for (int bit = 0; bit < 8; ++bit) {
      crc = (crc & 0x80U) != 0 ? (crc << 1U) ^ kPolynomial8 : crc << 1U;
    }
    table[i] = static_cast<std::uint8_t>(crc);
  }
  return table;
}

constexpr std::array<std::uint32_t, 256> make_table32() {
  std::array<std::uint32_t, 256> table{};
  for (std::uint32_t i = 0; i < 256; ++i) {
    std::uint32_t crc = i;
    for (int bit = 0; bit < 8; ++bit) {
      crc = (crc & 1U) != 0 ? (crc >> 1U) ^ kPolynomial32 : crc >> 1U;
    }
    table[i] = crc;
  }
  return table;
}

constexpr std::array<std::uint8_t, 256> kTable8 = make_table8();
constexpr std::array<std::uint32_t, 256> kTable32 = make_table32();

std::uint8_t begin8(const std::uint8_t* data, std::size_t size) {
  std::uint8_t crc = 0xFF;
  for (std::size_t i = 0; i < size; ++i) {
    crc = kTable8[crc ^ data[i]];
  }
  return crc;
}

}  // namespace

std::uint8_t crc8h2f(const std::uint8_t* data, std::size_t size, std::uint8_t last) {
  return kTable8[begin8(data, size) ^ last] ^ 0xFFU;
}

std::uint8_t crc8h2f(const std::uint8_t* data, std::size_t size) {
  return begin8(data, size) ^ 0xFFU;
}

std::uint32_t crc32c(const std::uint8_t* data, std::size_t size) {
  std::uint32_t crc = ~std::uint32_t{0};
  for (std::size_t i = 0; i < size; ++i) {
    crc = (crc >> 8U) ^ kTable32[(crc ^ data[i]) & 0xFFU];
  }
  return ~crc;
}

}  // namespace understory::can
