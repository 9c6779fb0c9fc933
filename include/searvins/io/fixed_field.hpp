// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Numbers in fixed columns, as FORTRAN wrote them and RINEX keeps them: a field is a place in a line, not a word.
///
///     I   integer, blanks around it
///     F   decimal without exponent:  "  20576396.770"
///     D   exponent D, d, E or e:     "-.468854D-01"
///
/// A field that lies beyond the end of the line is blank. A blank inside a number is an error: it is the mark of a shifted column.
/// Nothing here depends on the locale, and "nan" and "inf" are text, not numbers.
#pragma once

#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <system_error>

namespace searvins::io {

/// What stands in a field.
enum class FieldState : std::uint8_t { blank, number, malformed };

/// The part of the line that the field covers; shorter or empty when the line ends before.
[[nodiscard]] constexpr std::string_view field(std::string_view line, std::size_t at, std::size_t width) {
  return at < line.size() ? line.substr(at, width) : std::string_view{};
}

/// The character in a column, a blank beyond the end of the line.
[[nodiscard]] constexpr char column(std::string_view line, std::size_t at) { return at < line.size() ? line[at] : ' '; }

/// The text without blanks at its ends.
[[nodiscard]] constexpr std::string_view without_blanks(std::string_view text) {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  return text;
}

/// Whether a character is one of 0..9, whatever the locale.
[[nodiscard]] constexpr bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// An I field. `out` changes only for a number; at most nine digits.
[[nodiscard]] constexpr FieldState read_integer(std::string_view text, int& out) {
  text = without_blanks(text);
  if (text.empty()) return FieldState::blank;
  const bool negative = text.front() == '-';
  if (negative || text.front() == '+') text.remove_prefix(1);
  if (text.empty() || text.size() > 9) return FieldState::malformed;
  int value = 0;
  for (const char c : text) {
    if (!is_digit(c)) return FieldState::malformed;
    value = 10 * value + (c - '0');
  }
  out = negative ? -value : value;
  return FieldState::number;
}

/// A decimal number as an integer mantissa and its count of decimals: -20576396.770 is {-20576396770, 3}.
struct Decimal {
  std::int64_t mantissa{0};
  int decimals{0};
};

/// An F field, exactly. At most 18 digits; `out` changes only for a number.
[[nodiscard]] constexpr FieldState read_decimal(std::string_view text, Decimal& out) {
  text = without_blanks(text);
  if (text.empty()) return FieldState::blank;
  const bool negative = text.front() == '-';
  if (negative || text.front() == '+') text.remove_prefix(1);
  Decimal d;
  int digits = 0;
  bool point = false;
  for (const char c : text) {
    if (c == '.' && !point) {
      point = true;
      continue;
    }
    if (!is_digit(c) || ++digits > 18) return FieldState::malformed;
    d.mantissa = 10 * d.mantissa + (c - '0');
    d.decimals += point ? 1 : 0;
  }
  if (digits == 0) return FieldState::malformed;
  if (negative) d.mantissa = -d.mantissa;
  out = d;
  return FieldState::number;
}

/// An F field as a double: the nearest one, for up to 15 digits (mantissa and power of ten are exact then, and one division rounds once).
[[nodiscard]] constexpr FieldState read_fixed(std::string_view text, double& out) {
  constexpr double power[] = {1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18};
  Decimal d;
  const FieldState state = read_decimal(text, d);
  if (state == FieldState::number) out = static_cast<double>(d.mantissa) / power[d.decimals];
  return state;
}

/// An F field in seconds as whole nanoseconds, exactly; digits beyond the ninth decimal are cut.
[[nodiscard]] constexpr FieldState read_nanoseconds(std::string_view text, std::int64_t& out) {
  Decimal d;
  const FieldState state = read_decimal(text, d);
  if (state != FieldState::number) return state;
  for (; d.decimals > 9; --d.decimals) d.mantissa /= 10;
  for (; d.decimals < 9; ++d.decimals) {
    if (d.mantissa > 1'000'000'000'000'000 || d.mantissa < -1'000'000'000'000'000) return FieldState::malformed;
    d.mantissa *= 10;
  }
  out = d.mantissa;
  return state;
}

/// A D field, finite. `out` changes only for a number.
[[nodiscard]] inline FieldState read_exponential(std::string_view text, double& out) {
  text = without_blanks(text);
  if (text.empty()) return FieldState::blank;
  const bool plus = text.front() == '+';
  if (plus) text.remove_prefix(1);
  char buffer[40];
  if (text.empty() || text.size() > sizeof buffer || (plus && text.front() == '-')) return FieldState::malformed;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (!is_digit(c) && std::string_view{"+-.dDeE"}.find(c) == std::string_view::npos) return FieldState::malformed;
    buffer[i] = c == 'D' || c == 'd' ? 'e' : c;
  }
  double value = 0;
  const auto [end, error] = std::from_chars(buffer, buffer + text.size(), value);
  if (error != std::errc{} || end != buffer + text.size() || !std::isfinite(value)) return FieldState::malformed;
  out = value;
  return FieldState::number;
}

}  // namespace searvins::io
