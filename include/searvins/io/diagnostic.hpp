// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// What readers of recorded files report: one Diagnostic that ends the reading, and a log of what was skipped on the way.
///
/// A receiver's file is rarely perfect. What makes it unusable as a whole is a Diagnostic: file, line, what is wrong, what to do.
/// What spoils one epoch, satellite or number is a SkippedItem: the reading goes on, the reason is counted, the first place kept.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace searvins::io {

/// Why a file cannot be used.
struct Diagnostic {
  std::string file;     ///< as the caller named it
  long line{0};         ///< counted from 1; 0: the file as a whole
  std::string message;  ///< what is wrong
  std::string hint;     ///< what to do
};

/// "file:line: message. hint", without the parts that are not there.
[[nodiscard]] inline std::string to_string(const Diagnostic& d) {
  std::string text = d.file;
  if (d.line > 0) text += ':' + std::to_string(d.line);
  text += ": " + d.message;
  if (!d.hint.empty()) text += ". " + d.hint;
  return text;
}

/// Something that was left out, with how often and where first.
struct SkippedItem {
  std::string reason;  ///< what was wrong
  std::string hint;    ///< what to do; empty when nothing needs doing
  long count{0};
  long first_line{0};
};

/// Counts what was left out, by reason, in order of first appearance. At most kMaxReasons are told apart; the rest share one entry,
/// so a hostile file cannot make it grow.
class SkipLog {
 public:
  static constexpr std::size_t kMaxReasons = 48;

  void add(std::string_view reason, long line, std::string_view hint = {}) {
    for (SkippedItem& item : items_)
      if (item.reason == reason) {
        ++item.count;
        return;
      }
    if (items_.size() >= kMaxReasons && reason != kOther) return add(kOther, line);
    items_.push_back({std::string{reason}, std::string{hint}, 1, line});
  }

  [[nodiscard]] const std::vector<SkippedItem>& items() const { return items_; }

  /// The entry whose reason contains the text; nullptr when there is none.
  [[nodiscard]] const SkippedItem* find(std::string_view part_of_reason) const {
    for (const SkippedItem& item : items_)
      if (item.reason.find(part_of_reason) != std::string::npos) return &item;
    return nullptr;
  }

  /// How often a reason that contains the text was counted.
  [[nodiscard]] long count(std::string_view part_of_reason) const {
    long n = 0;
    for (const SkippedItem& item : items_)
      if (item.reason.find(part_of_reason) != std::string::npos) n += item.count;
    return n;
  }

  /// All counts together.
  [[nodiscard]] long total() const { return count({}); }

 private:
  static constexpr std::string_view kOther = "other reasons";
  std::vector<SkippedItem> items_;
};

/// A whole file, read: the value (as far as it went), what ended it, what was skipped.
template <class T>
struct [[nodiscard]] Parsed {
  T value{};
  std::optional<Diagnostic> error;
  SkipLog skipped;

  [[nodiscard]] bool ok() const { return !error.has_value(); }
  explicit operator bool() const { return ok(); }
};

}  // namespace searvins::io
