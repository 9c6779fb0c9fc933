// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Writes JSON text, value by value: commas, quotes and indentation are its business.
///
///     JsonWriter json;
///     json.begin_object().member("epochs", 180).begin_array("fix").value(0.5).end_array().end_object();
///
/// Doubles are written with the fewest digits that read back to the same value; what is not finite becomes null.
#pragma once

#include <charconv>
#include <cmath>
#include <concepts>
#include <string>
#include <string_view>
#include <vector>

#include "examples/support/json.hpp"

namespace searvins::examples {

/// A string as a JSON literal, quotes included. `<` is escaped too, so that the text may stand inside an HTML script element;
/// bytes that are not UTF-8 become U+FFFD.
[[nodiscard]] inline std::string json_literal(std::string_view text) {
  std::string out = "\"";
  while (!text.empty()) {
    const auto c = static_cast<unsigned char>(text.front());
    std::size_t length = detail::utf8_length(text);
    if (length == 0)
      out += "\xEF\xBF\xBD", length = 1;
    else if (c == '"' || c == '\\')
      (out += '\\') += text.front();
    else if (c == '\n')
      out += "\\n";
    else if (c == '\t')
      out += "\\t";
    else if (c < 0x20 || c == '<' || c == 0x7F) {
      constexpr const char* hex = "0123456789abcdef";
      out += "\\u00";
      out += hex[c >> 4U];
      out += hex[c & 15U];
    } else
      out += text.substr(0, length);
    text.remove_prefix(length);
  }
  return out + '"';
}

/// A number as JSON text.
[[nodiscard]] inline std::string json_literal(double value) {
  if (!std::isfinite(value)) return "null";
  char buffer[32];
  const auto [end, code] = std::to_chars(buffer, buffer + sizeof buffer, value);
  return {buffer, end};
}

/// Streaming writer. Calls that do not nest correctly give wrong text: the caller's structure is the text's structure.
class JsonWriter {
 public:
  /// With `indent` 0 everything stands on one line.
  explicit JsonWriter(int indent = 2) : indent_(indent) {}

  JsonWriter& begin_object(std::string_view key = {}) { return open(key, '{'); }
  JsonWriter& begin_array(std::string_view key = {}) { return open(key, '['); }
  JsonWriter& end_object() { return close('}'); }
  JsonWriter& end_array() { return close(']'); }

  template <class T>
  JsonWriter& member(std::string_view key, const T& value) {
    prefix(key);
    append(value);
    return *this;
  }
  template <class T>
  JsonWriter& value(const T& value) {
    return member({}, value);
  }

  /// The text, with a line end.
  [[nodiscard]] std::string text() const { return text_ + '\n'; }

 private:
  void prefix(std::string_view key) {
    if (!first_.empty()) {
      if (!first_.back()) text_ += ',';
      first_.back() = false;
      new_line();
    }
    if (!key.empty()) text_ += json_literal(key) + (indent_ > 0 ? ": " : ":");
  }
  void new_line() {
    if (indent_ > 0) text_ += '\n' + std::string(first_.size() * static_cast<std::size_t>(indent_), ' ');
  }
  JsonWriter& open(std::string_view key, char bracket) {
    prefix(key);
    text_ += bracket;
    first_.push_back(true);
    return *this;
  }
  JsonWriter& close(char bracket) {
    const bool empty = first_.empty() || first_.back();
    if (!first_.empty()) first_.pop_back();
    if (!empty) new_line();
    text_ += bracket;
    return *this;
  }
  void append(bool value) { text_ += value ? "true" : "false"; }
  void append(double value) { text_ += json_literal(value); }
  void append(std::integral auto value) { text_ += std::to_string(value); }
  void append(std::string_view value) { text_ += json_literal(value); }
  void append(const char* value) { text_ += json_literal(std::string_view{value}); }
  void append(const std::string& value) { text_ += json_literal(std::string_view{value}); }

  int indent_;
  std::vector<bool> first_;
  std::string text_;
};

}  // namespace searvins::examples
