// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Bytes as text in base 64 [RFC 4648 sec. 4], for data inside a page: three bytes are four letters, the last group is filled with `=`.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace searvins::examples {

/// The text of the bytes, 4 ceil(n / 3) letters.
[[nodiscard]] inline std::string base64(std::string_view bytes) {
  constexpr std::string_view kLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k) group = group << 8U | (i + k < bytes.size() ? static_cast<std::uint8_t>(bytes[i + k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k) text += i + k <= bytes.size() ? kLetters[group >> (18 - 6 * k) & 63U] : '=';
  }
  return text;
}

}  // namespace searvins::examples
