// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Lines of a text file or of a text in memory, streamed: memory is bounded by the block size whatever the size of the file.
///
/// A line comes without its LF or CR LF and without blanks at its end: writers differ in both, and fixed-column formats mean the same
/// with and without. A byte-order mark at the start is dropped. A line longer than kMaxLine (no text format here has such) is
/// delivered in pieces.
#pragma once

#include <cstddef>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include <searvins/io/diagnostic.hpp>

namespace searvins::io {

/// Reads lines forward, with one line of put-back.
class TextReader {
 public:
  static constexpr std::size_t kBlock = std::size_t{1} << 18;    ///< bytes read at once
  static constexpr std::size_t kMaxLine = std::size_t{1} << 20;  ///< bytes of one line at most

  /// Opens a file. Missing, unreadable and empty files and folders are told apart.
  [[nodiscard]] std::optional<Diagnostic> open(const std::filesystem::path& path) {
    reset(path.string());
    std::error_code code;
    const std::filesystem::file_status status = std::filesystem::status(path, code);
    if (!std::filesystem::exists(status)) return problem("no such file", "check the path");
    if (std::filesystem::is_directory(status)) return problem("is a folder, not a file", "name one of the files in it");
    stream_.open(path, std::ios::binary);
    if (!stream_.is_open()) return problem("the file cannot be opened", "check its permissions");
    fill();
    if (stream_.bad()) return problem("the file cannot be read", "check the disk and the permissions");
    if (begin_ == buffer_.size()) return problem("the file is empty", "get the recording again, the transfer may have failed");
    drop_byte_order_mark();
    return std::nullopt;
  }

  /// Reads from a text; `name` stands for the file in messages.
  [[nodiscard]] std::optional<Diagnostic> open_text(std::string text, std::string name) {
    reset(std::move(name));
    buffer_ = std::move(text);
    if (buffer_.empty()) return problem("the file is empty", "get the recording again, the transfer may have failed");
    drop_byte_order_mark();
    return std::nullopt;
  }

  /// The first bytes of what is still to be read (at least 1024, or all there is), to tell kinds of files apart.
  [[nodiscard]] std::string_view head() const { return std::string_view{buffer_}.substr(begin_); }

  /// Moves on to the next line; false at the end. The view lives until the next call.
  [[nodiscard]] bool next(std::string_view& line) {
    if (begin_ < buffer_.size() || fill()) {
      std::size_t length = 0;
      while (!find_end(length))
        if (!fill()) break;
      take(length, line);
      return true;
    }
    return false;
  }

  /// Puts the line that next() gave last back: next() gives it again. Once a line.
  void unread() {
    if (number_ == 0 || begin_ == line_begin_) return;
    begin_ = line_begin_;
    --number_;
  }

  /// Number of the line that next() gave last, counted from 1; 0 before the first.
  [[nodiscard]] long line_number() const { return number_; }
  /// False when the line that next() gave last is the file's last and has no line end: the file may have been cut there.
  [[nodiscard]] bool line_is_terminated() const { return terminated_; }
  /// The name for messages.
  [[nodiscard]] const std::string& name() const { return name_; }

 private:
  [[nodiscard]] Diagnostic problem(std::string message, std::string hint) const { return {name_, 0, std::move(message), std::move(hint)}; }

  void reset(std::string name) {
    stream_.close();
    stream_.clear();
    name_ = std::move(name);
    buffer_.clear();
    begin_ = line_begin_ = 0;
    number_ = 0;
    terminated_ = true;
  }

  void drop_byte_order_mark() {
    if (head().substr(0, 3) == "\xEF\xBB\xBF") begin_ = line_begin_ = 3;
  }

  /// Appends a block; what was read before the current line goes. False when nothing came.
  bool fill() {
    if (!stream_.is_open() || !stream_) return false;
    buffer_.erase(0, begin_);
    begin_ = line_begin_ = 0;
    const std::size_t before = buffer_.size();
    buffer_.resize(before + kBlock);
    stream_.read(buffer_.data() + before, static_cast<std::streamsize>(kBlock));
    buffer_.resize(before + static_cast<std::size_t>(stream_.gcount()));
    return buffer_.size() > before;
  }

  /// Length of the line at begin_, when its end (or the limit) is in the buffer.
  [[nodiscard]] bool find_end(std::size_t& length) const {
    const std::size_t there = buffer_.size() - begin_;
    const void* end = std::memchr(buffer_.data() + begin_, '\n', there);
    length = end ? static_cast<std::size_t>(static_cast<const char*>(end) - (buffer_.data() + begin_)) : there;
    return end != nullptr || there >= kMaxLine;
  }

  void take(std::size_t length, std::string_view& line) {
    line_begin_ = begin_;
    line = std::string_view{buffer_}.substr(begin_, length);
    begin_ += length;
    terminated_ = begin_ < buffer_.size();
    if (terminated_ && buffer_[begin_] == '\n') ++begin_;
    while (!line.empty() && (line.back() == ' ' || line.back() == '\r')) line.remove_suffix(1);
    ++number_;
  }

  std::ifstream stream_;
  std::string name_;
  std::string buffer_;         ///< what was read and not yet delivered starts at begin_
  std::size_t begin_{0};       ///< first byte of the next line
  std::size_t line_begin_{0};  ///< first byte of the line delivered last
  long number_{0};
  bool terminated_{true};
};

}  // namespace searvins::io
