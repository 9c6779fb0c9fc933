// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Text in and out: whole files, lines, fields, numbers. Independent of the locale: a decimal point is always a point.
///
/// Numbers are read strictly: the whole field must be one finite number. They are written with a fixed count of decimals, and a
/// value that is not finite is written as an empty field, never as "nan".
#pragma once

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include <searvins/io/diagnostic.hpp>
#include <searvins/io/file_kind.hpp>
#include <searvins/io/file_result.hpp>

namespace searvins::io {

/// The text without blanks, tabs and carriage returns at its ends.
[[nodiscard]] inline std::string_view trimmed(std::string_view text) {
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  while (!text.empty() && blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && blank(text.back())) text.remove_suffix(1);
  return text;
}

/// Fields between separators, trimmed; an empty text has one empty field.
[[nodiscard]] inline std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> fields;
  for (std::size_t begin = 0;;) {
    const std::size_t end = text.find(separator, begin);
    fields.push_back(trimmed(text.substr(begin, end == std::string_view::npos ? end : end - begin)));
    if (end == std::string_view::npos) return fields;
    begin = end + 1;
  }
}

/// Words between runs of blanks and tabs.
[[nodiscard]] inline std::vector<std::string_view> split_words(std::string_view text) {
  std::vector<std::string_view> words;
  while (!(text = trimmed(text)).empty()) {
    const std::size_t end = std::min(text.size(), text.find_first_of(" \t\r"));
    words.push_back(text.substr(0, end));
    text.remove_prefix(end);
  }
  return words;
}

/// Reads a whole field as one finite number; false (and `out` untouched) otherwise.
[[nodiscard]] inline bool parse_number(std::string_view field, double& out) {
  if (field.size() > 1 && field.front() == '+' && field[1] != '-') field.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
  if (error != std::errc{} || end != field.data() + field.size() || !std::isfinite(value)) return false;
  out = value;
  return true;
}

/// Reads a whole field as one integer; false (and `out` untouched) otherwise.
[[nodiscard]] inline bool parse_integer(std::string_view field, std::int64_t& out) {
  if (field.size() > 1 && field.front() == '+' && field[1] != '-') field.remove_prefix(1);
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
  if (error != std::errc{} || end != field.data() + field.size()) return false;
  out = value;
  return true;
}

/// Appends a number with `decimals` digits after the point; nothing when it is not finite. Minus zero is written as zero.
inline void append_fixed(std::string& text, double value, int decimals) {
  if (!std::isfinite(value)) return;
  char buffer[400];
  const auto [end, error] = std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::fixed, decimals);
  if (error != std::errc{}) return;
  std::string_view digits{buffer, static_cast<std::size_t>(end - buffer)};
  if (digits.front() == '-' && digits.find_first_not_of("-0.") == std::string_view::npos) digits.remove_prefix(1);
  text += digits;
}

/// Appends a number in scientific notation with `digits` after the point; nothing when it is not finite.
inline void append_scientific(std::string& text, double value, int digits) {
  if (!std::isfinite(value)) return;
  char buffer[64];
  const auto [end, error] = std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::scientific, digits);
  if (error == std::errc{}) text.append(buffer, end);
}

/// A number with `decimals` digits, padded with blanks on the left to `width`.
[[nodiscard]] inline std::string fixed_text(double value, int decimals, std::size_t width = 0) {
  std::string text;
  append_fixed(text, value, decimals);
  return text.size() < width ? std::string(width - text.size(), ' ') + text : text;
}

/// The lines of a text, numbered, without their ends (LF or CR LF).
class LineReader {
 public:
  explicit LineReader(std::string_view text) : rest_(text) {
    if (rest_.substr(0, 3) == "\xEF\xBB\xBF") rest_.remove_prefix(3);  // the byte-order mark some editors write
  }

  /// Moves to the next line; false at the end.
  [[nodiscard]] bool next(std::string_view& line) {
    if (rest_.empty()) return false;
    const std::size_t end = rest_.find('\n');
    line = rest_.substr(0, end);
    rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + 1);
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    ++number_;
    return true;
  }

  /// Number of the line that next() gave last; the first is 1.
  [[nodiscard]] long number() const { return number_; }

 private:
  std::string_view rest_;
  long number_{0};
};

/// Reads a whole file. Missing, empty, too large and gzip-compressed files are errors that say what to do.
[[nodiscard]] inline FileResult<std::string> read_text_file(const std::string& path, std::uintmax_t max_bytes = std::uintmax_t{1} << 30) {
  std::error_code code;
  const auto status = std::filesystem::status(path, code);
  if (!std::filesystem::exists(status)) return Diagnostic{path, 0, "no such file", "check the path"};
  if (std::filesystem::is_directory(status)) return Diagnostic{path, 0, "is a folder, not a file", "name one of the files in it"};
  std::ifstream stream{path, std::ios::binary};
  if (!stream) return Diagnostic{path, 0, "the file cannot be opened", "check its permissions"};
  std::string text;
  char block[1 << 16];
  while (stream.read(block, sizeof block), stream.gcount() > 0) {
    text.append(block, static_cast<std::size_t>(stream.gcount()));
    if (text.size() > max_bytes)
      return Diagnostic{path, 0, "is larger than " + std::to_string(max_bytes) + " bytes: not a file of this kind", {}};
  }
  if (stream.bad()) return Diagnostic{path, 0, "the file cannot be read to its end", "check the disk"};
  if (text.empty()) return Diagnostic{path, 0, "the file is empty", "get it again, the transfer may have failed"};
  if (const auto packed = refuse_compressed(sniff_text(text).kind, path)) return *packed;
  return text;
}

/// Writes a whole file; an empty string on success, else what went wrong.
[[nodiscard]] inline std::string write_text_file(const std::string& path, std::string_view text) {
  std::ofstream stream{path, std::ios::binary | std::ios::trunc};
  stream.write(text.data(), static_cast<std::streamsize>(text.size()));
  stream.close();
  return stream ? std::string{} : path + ": could not be written: check the folder, its permissions and the space left";
}

}  // namespace searvins::io
