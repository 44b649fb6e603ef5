// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// The two checksums of the bus. Source: AUTOSAR Specification of CRC Routines (CRC8H2F: polynomial
// 0x2F, initial and final XOR 0xFF); RFC 3720 appendix B.4 (CRC-32C, for arming tokens). Pure
// functions; nothing here can fail.
#pragma once

#include <cstddef>
#include <cstdint>

namespace understory::can {

// Over `data`, and then one byte more.
[[nodiscard]] std::uint8_t crc8h2f(const std::uint8_t* data, std::size_t size, std::uint8_t last);
[[nodiscard]] std::uint8_t crc8h2f(const std::uint8_t* data, std::size_t size);

[[nodiscard]] std::uint32_t crc32c(const std::uint8_t* data, std::size_t size);

}  // namespace understory::can
