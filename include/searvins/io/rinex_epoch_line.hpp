// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The line that opens an epoch of a RINEX observation file.
///
///     RINEX 3, 4   > 2021 09 22 06 30 00.0000000  0 18       0.000000000000
///     RINEX 2       05  4  2  0  0  0.0000000  0  8G 3G 7G 8G11G19G20G24G28
///
/// Flag 0: observations, 1: the same after a power failure, 2..5: an event and as many special records as the count says (the date
/// may be blank), 6: cycle slip records in the shape of observations.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string_view>

#include <searvins/io/fixed_field.hpp>
#include <searvins/io/rinex_common.hpp>

namespace searvins::io {

/// What the line says. The line is taken as an epoch line only when all of it makes sense.
struct EpochLine {
  CivilEpoch civil{};
  bool dated{false};  ///< the date is there and exists
  int flag{0};        ///< 0 .. 6
  int count{0};       ///< satellites or special records; negative or absurd values are for the reader to judge
  std::optional<double> clock_offset_s;

  [[nodiscard]] bool is_event() const { return flag >= 2 && flag <= 5; }
};

namespace detail {

/// Fills date and time from six fields; false when one is malformed, or missing while others are there.
[[nodiscard]] inline bool read_civil(const std::array<std::string_view, 6>& parts, bool two_digit_year, EpochLine& out) {
  int* const targets[] = {&out.civil.year, &out.civil.month, &out.civil.day, &out.civil.hour, &out.civil.minute};
  int there = 0;
  for (std::size_t i = 0; i < 5; ++i) {
    const FieldState state = read_integer(parts[i], *targets[i]);
    if (state == FieldState::malformed) return false;
    there += state == FieldState::number ? 1 : 0;
  }
  const FieldState seconds = read_nanoseconds(parts[5], out.civil.second_ns);
  if (seconds == FieldState::malformed) return false;
  there += seconds == FieldState::number ? 1 : 0;
  if (there == 0) return true;
  if (there != 6) return false;
  if (two_digit_year) {
    if (out.civil.year < 0 || out.civil.year > 99) return false;
    out.civil.year = full_year(out.civil.year);
  }
  out.dated = out.civil.valid();
  return out.dated;
}

/// Fills flag, count and clock offset; a blank flag is not accepted, a blank count is none.
[[nodiscard]] inline bool read_flag_and_count(std::string_view flag, std::string_view count, std::string_view offset, EpochLine& out) {
  if (read_integer(flag, out.flag) != FieldState::number || out.flag < 0 || out.flag > 6) return false;
  if (read_integer(count, out.count) == FieldState::malformed) return false;
  double seconds = 0;
  const FieldState state = read_fixed(offset, seconds);
  if (state == FieldState::number) out.clock_offset_s = seconds;
  return out.dated || out.is_event();
}

/// The same line with fields taken as words: for writers that shift columns or write `>>`.
[[nodiscard]] inline bool read_epoch_words(std::string_view line, EpochLine& out) {
  while (!line.empty() && line.front() == '>') line.remove_prefix(1);
  std::array<std::string_view, 9> words{};
  for (std::string_view& word : words) {
    line = without_blanks(line);
    word = line.substr(0, line.find(' '));
    line.remove_prefix(word.size());
  }
  out = {};
  if (words[7].empty() || !read_civil({words[0], words[1], words[2], words[3], words[4], words[5]}, false, out)) return false;
  return read_flag_and_count(words[6], words[7], words[8], out);
}

}  // namespace detail

/// Reads a RINEX 3 or 4 epoch line; nothing when it is none.
[[nodiscard]] inline std::optional<EpochLine> read_epoch_line_3(std::string_view line) {
  EpochLine e;
  if (column(line, 0) != '>') return std::nullopt;
  const bool fixed = detail::read_civil({field(line, 2, 4), field(line, 7, 2), field(line, 10, 2), field(line, 13, 2), field(line, 16, 2),
                                         field(line, 18, 11)},
                                        false, e) &&
                     detail::read_flag_and_count(field(line, 29, 3), field(line, 32, 3), field(line, 41, 15), e);
  if (!fixed && !detail::read_epoch_words(line, e)) return std::nullopt;
  return e;
}

/// Reads a RINEX 2 epoch line; nothing when it is none. Strict in its separators, because no mark tells it from an observation line.
[[nodiscard]] inline std::optional<EpochLine> read_epoch_line_2(std::string_view line) {
  EpochLine e;
  for (const std::size_t blank : {0U, 3U, 6U, 9U, 12U, 26U, 27U})
    if (column(line, blank) != ' ') return std::nullopt;
  if (!detail::read_civil(
          {field(line, 1, 2), field(line, 4, 2), field(line, 7, 2), field(line, 10, 2), field(line, 13, 2), field(line, 15, 11)}, true, e))
    return std::nullopt;
  if (!detail::read_flag_and_count(field(line, 28, 1), field(line, 29, 3), field(line, 68, 12), e)) return std::nullopt;
  return e;
}

}  // namespace searvins::io
