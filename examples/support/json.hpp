// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// JSON [RFC 8259]: a small strict reader, bounded in depth and size, and a writer.
///
/// Strict means: one value and nothing after it, no comments, no trailing commas, no duplicate keys, no NaN, no leading zeros, valid
/// UTF-8 only. Every value keeps the line and column where it began, so that whoever uses it can point at it.
#pragma once

#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <searvins/io/file_result.hpp>
#include <searvins/io/text_fields.hpp>

namespace searvins::examples {

/// A JSON value. Only the member that `kind` names is meaningful.
struct Json {
  enum class Kind : std::uint8_t { null, boolean, number, string, array, object };
  Kind kind{Kind::null};
  bool boolean{false};
  double number{0};
  std::string string{};
  std::vector<Json> elements{};     ///< of an array, or of an object beside `keys`
  std::vector<std::string> keys{};  ///< of an object, in the order of the file
  std::size_t line{0}, column{0};   ///< where the value began

  [[nodiscard]] bool is(Kind k) const { return kind == k; }
  /// The member of an object, nullptr when there is none (or this is no object).
  [[nodiscard]] const Json* find(std::string_view key) const {
    for (std::size_t i = 0; i < keys.size(); ++i)
      if (keys[i] == key) return &elements[i];
    return nullptr;
  }
};

/// Word for a kind, for messages.
[[nodiscard]] constexpr const char* name_of(Json::Kind kind) {
  constexpr const char* names[] = {"null", "true or false", "a number", "a string", "an array", "an object"};
  return names[static_cast<std::size_t>(kind)];
}

/// Bounds of the reader.
struct JsonLimits {
  std::size_t max_depth{64};          ///< arrays and objects inside one another
  std::size_t max_bytes{64U << 20U};  ///< size of the text
};

namespace detail {

/// Length of the UTF-8 sequence at the front of `text`, 0 when it is malformed (overlong, surrogate, beyond U+10FFFF, cut).
[[nodiscard]] inline std::size_t utf8_length(std::string_view text) {
  const auto byte = [&text](std::size_t i) { return i < text.size() ? static_cast<unsigned char>(text[i]) : 0U; };
  const unsigned first = byte(0);
  if (first < 0x80) return 1;
  const std::size_t length = first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : 2;
  if (first < 0xC2 || first > 0xF4) return 0;
  for (std::size_t i = 1; i < length; ++i)
    if ((byte(i) & 0xC0U) != 0x80) return 0;
  if ((first == 0xE0 && byte(1) < 0xA0) || (first == 0xED && byte(1) >= 0xA0)) return 0;
  if ((first == 0xF0 && byte(1) < 0x90) || (first == 0xF4 && byte(1) >= 0x90)) return 0;
  return length;
}

/// Appends a code point as UTF-8.
inline void append_utf8(std::string& text, std::uint32_t code) {
  const auto put = [&text](std::uint32_t byte) { text += static_cast<char>(static_cast<unsigned char>(byte)); };
  if (code < 0x80) return put(code);
  if (code < 0x800) return put(0xC0U | (code >> 6U)), put(0x80U | (code & 0x3FU));
  if (code < 0x10000) return put(0xE0U | (code >> 12U)), put(0x80U | ((code >> 6U) & 0x3FU)), put(0x80U | (code & 0x3FU));
  put(0xF0U | (code >> 18U)), put(0x80U | ((code >> 12U) & 0x3FU)), put(0x80U | ((code >> 6U) & 0x3FU)), put(0x80U | (code & 0x3FU));
}

/// Recursive-descent reader. Every method returns false once `error` is set.
class JsonReader {
 public:
  JsonReader(std::string_view text, const JsonLimits& limits) : text_(text), limits_(limits) {}

  [[nodiscard]] bool read_document(Json& value) {
    if (text_.size() > limits_.max_bytes) return fail("text is longer than " + std::to_string(limits_.max_bytes) + " bytes");
    skip_blanks();
    if (!read_value(value, 0)) return false;
    skip_blanks();
    return at_ == text_.size() || fail("text after the end of the value");
  }

  [[nodiscard]] const std::string& error() const { return error_; }
  [[nodiscard]] std::size_t line() const { return line_; }
  [[nodiscard]] std::size_t column() const { return at_ - line_start_ + 1; }

 private:
  [[nodiscard]] bool fail(std::string what) {
    if (error_.empty()) error_ = std::move(what);
    return false;
  }
  [[nodiscard]] char peek() const { return at_ < text_.size() ? text_[at_] : '\0'; }
  [[nodiscard]] bool accept(char c) { return at_ < text_.size() && text_[at_] == c ? (++at_, true) : false; }

  void skip_blanks() {
    for (; at_ < text_.size(); ++at_) {
      const char c = text_[at_];
      if (c == '\n')
        ++line_, line_start_ = at_ + 1;
      else if (c != ' ' && c != '\t' && c != '\r')
        return;
    }
  }

  [[nodiscard]] bool read_value(Json& value, std::size_t depth) {
    value.line = line_, value.column = column();
    if (at_ == text_.size()) return fail("the text ends where a value should be");
    switch (peek()) {
      case '{': return read_object(value, depth);
      case '[': return read_array(value, depth);
      case '"': value.kind = Json::Kind::string; return read_string(value.string);
      case 't':
        value.kind = Json::Kind::boolean;
        value.boolean = true;
        return read_word("true");
      case 'f': value.kind = Json::Kind::boolean; return read_word("false");
      case 'n': return read_word("null");
      case '/': return fail("comments are not allowed in JSON");
      default: return read_number(value);
    }
  }

  [[nodiscard]] bool read_word(std::string_view word) {
    if (text_.substr(at_, word.size()) != word) return fail("not a value: expected " + std::string{word});
    at_ += word.size();
    return true;
  }

  [[nodiscard]] bool read_digits() {
    const std::size_t begin = at_;
    while (peek() >= '0' && peek() <= '9') ++at_;
    return at_ > begin;
  }

  [[nodiscard]] bool read_number(Json& value) {
    const std::size_t begin = at_;
    value.kind = Json::Kind::number;
    (void)accept('-');
    const bool zero = peek() == '0';
    const std::size_t digits = at_;
    if (!read_digits()) return fail("not a value");
    if (zero && at_ - digits > 1) return fail("a number must not begin with a zero");
    if (accept('.') && !read_digits()) return fail("a digit must follow the decimal point");
    if (peek() == 'e' || peek() == 'E') {
      ++at_;
      if (peek() == '+' || peek() == '-') ++at_;
      if (!read_digits()) return fail("a digit must follow the exponent sign");
    }
    const auto [end, code] = std::from_chars(text_.data() + begin, text_.data() + at_, value.number);
    if (code == std::errc::result_out_of_range && !is_tiny(text_.substr(begin, at_ - begin)))
      return fail("the number does not fit a double");
    if (code == std::errc::result_out_of_range) value.number = 0;
    return true;
  }

  /// A number that from_chars refuses is out of range either way; below the smallest double it is zero, above it is an error.
  [[nodiscard]] static bool is_tiny(std::string_view digits) {
    const std::size_t e = digits.find_first_of("eE");
    if (e != std::string_view::npos) return digits[e + 1] == '-';
    return digits.substr(digits.front() == '-' ? 1 : 0, 2) == "0.";
  }

  [[nodiscard]] bool read_hex4(std::uint32_t& code) {
    code = 0;
    for (int i = 0; i < 4; ++i, ++at_) {
      const char c = peek();
      const std::uint32_t digit = c >= '0' && c <= '9'   ? static_cast<std::uint32_t>(c - '0')
                                  : c >= 'a' && c <= 'f' ? static_cast<std::uint32_t>(c - 'a' + 10)
                                  : c >= 'A' && c <= 'F' ? static_cast<std::uint32_t>(c - 'A' + 10)
                                                         : 16U;
      if (digit == 16) return fail("four hexadecimal digits must follow \\u");
      code = code * 16 + digit;
    }
    return true;
  }

  [[nodiscard]] bool read_escape(std::string& out) {
    constexpr std::string_view letters = "\"\\/bfnrt", meanings = "\"\\/\b\f\n\r\t";
    const char c = peek();
    if (const std::size_t i = letters.find(c); i != std::string_view::npos && at_ < text_.size()) {
      ++at_;
      out += meanings[i];
      return true;
    }
    if (!accept('u')) return fail("unknown escape after \\");
    std::uint32_t code = 0, low = 0;
    if (!read_hex4(code)) return false;
    if (code >= 0xDC00 && code < 0xE000) return fail("a low surrogate without its high one");
    if (code >= 0xD800 && code < 0xDC00) {
      if (!accept('\\') || !accept('u') || !read_hex4(low)) return fail("a high surrogate without its low one");
      if (low < 0xDC00 || low >= 0xE000) return fail("a high surrogate without its low one");
      code = 0x10000 + ((code - 0xD800) << 10U) + (low - 0xDC00);
    }
    append_utf8(out, code);
    return true;
  }

  [[nodiscard]] bool read_string(std::string& out) {
    ++at_;  // the opening quote
    while (at_ < text_.size()) {
      const char c = text_[at_];
      if (c == '"') return ++at_, true;
      if (static_cast<unsigned char>(c) < 0x20) return fail("a control character inside a string: write it as an escape");
      if (c == '\\') {
        ++at_;
        if (!read_escape(out)) return false;
        continue;
      }
      const std::size_t length = utf8_length(text_.substr(at_));
      if (length == 0) return fail("not valid UTF-8");
      out.append(text_.substr(at_, length));
      at_ += length;
    }
    return fail("the text ends inside a string");
  }

  [[nodiscard]] bool read_array(Json& value, std::size_t depth) {
    if (depth >= limits_.max_depth) return fail("nested deeper than " + std::to_string(limits_.max_depth) + " levels");
    value.kind = Json::Kind::array;
    ++at_;
    skip_blanks();
    if (accept(']')) return true;
    for (;;) {
      skip_blanks();
      if (!read_value(value.elements.emplace_back(), depth + 1)) return false;
      skip_blanks();
      if (accept(']')) return true;
      if (!accept(',')) return fail("expected , or ] in an array");
    }
  }

  [[nodiscard]] bool read_object(Json& value, std::size_t depth) {
    if (depth >= limits_.max_depth) return fail("nested deeper than " + std::to_string(limits_.max_depth) + " levels");
    value.kind = Json::Kind::object;
    ++at_;
    skip_blanks();
    if (accept('}')) return true;
    for (;;) {
      skip_blanks();
      if (peek() != '"') return fail("expected a key in quotes");
      std::string key;
      if (!read_string(key)) return false;
      if (value.find(key)) return fail("the key \"" + key + "\" stands twice");
      value.keys.push_back(std::move(key));
      skip_blanks();
      if (!accept(':')) return fail("expected : after a key");
      skip_blanks();
      if (!read_value(value.elements.emplace_back(), depth + 1)) return false;
      skip_blanks();
      if (accept('}')) return true;
      if (!accept(',')) return fail("expected , or } in an object");
    }
  }

  std::string_view text_;
  JsonLimits limits_;
  std::size_t at_{0}, line_{1}, line_start_{0};
  std::string error_;
};

}  // namespace detail

/// Reads a JSON text; `name` is the file's name in errors.
[[nodiscard]] inline io::FileResult<Json> parse_json(std::string_view text, const std::string& name, const JsonLimits& limits = {}) {
  detail::JsonReader reader{text, limits};
  Json value;
  if (!reader.read_document(value))
    return io::Diagnostic{name, static_cast<long>(reader.line()), "column " + std::to_string(reader.column()) + ": " + reader.error(), {}};
  return value;
}

/// Reads a JSON file.
[[nodiscard]] inline io::FileResult<Json> read_json(const std::string& path, const JsonLimits& limits = {}) {
  const io::FileResult<std::string> text = io::read_text_file(path, limits.max_bytes);
  if (!text) return text.error();
  return parse_json(*text, path, limits);
}

}  // namespace searvins::examples
