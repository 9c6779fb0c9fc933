// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The two checksums of PNG: CRC-32 of a chunk (polynomial 0x04c11db7, bit-reversed) and Adler-32 of the unpacked data.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace searvins::examples {

namespace detail {

[[nodiscard]] constexpr std::array<std::uint32_t, 256> crc_table() {
  std::array<std::uint32_t, 256> table{};
  for (std::uint32_t byte = 0; byte < 256; ++byte) {
    std::uint32_t rest = byte;
    for (int bit = 0; bit < 8; ++bit) rest = (rest & 1U) != 0 ? (rest >> 1U) ^ 0xedb88320U : rest >> 1U;
    table[byte] = rest;
  }
  return table;
}

inline constexpr std::array<std::uint32_t, 256> kCrcTable = crc_table();

}  // namespace detail

/// CRC-32 of bytes.
[[nodiscard]] constexpr std::uint32_t crc32(std::span<const std::uint8_t> bytes) {
  std::uint32_t rest = 0xffffffffU;
  for (const std::uint8_t byte : bytes) rest = detail::kCrcTable[(rest ^ byte) & 0xffU] ^ (rest >> 8U);
  return rest ^ 0xffffffffU;
}

/// Adler-32 of bytes.
[[nodiscard]] constexpr std::uint32_t adler32(std::span<const std::uint8_t> bytes) {
  constexpr std::uint32_t kPrime = 65521;
  constexpr std::size_t kUntilOverflow = 5552;  // sums of so many bytes fit 32 bits
  std::uint32_t a = 1, b = 0;
  for (std::size_t begin = 0; begin < bytes.size(); begin += kUntilOverflow) {
    for (std::size_t i = begin; i < bytes.size() && i < begin + kUntilOverflow; ++i) {
      a += bytes[i];
      b += a;
    }
    a %= kPrime;
    b %= kPrime;
  }
  return (b << 16U) | a;
}

}  // namespace searvins::examples
