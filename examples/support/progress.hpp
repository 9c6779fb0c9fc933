// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// A progress line on stderr: rewritten in place on a terminal, a line every tenth of the way elsewhere.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <string>
#include <utility>

#if __has_include(<unistd.h>)
#include <unistd.h>
#endif

namespace searvins::examples {

/// True when stderr is a terminal.
[[nodiscard]] inline bool stderr_is_terminal() {
#if __has_include(<unistd.h>)
  return isatty(STDERR_FILENO) == 1;
#else
  return false;
#endif
}

/// Progress of a job of known size. Prints nothing for a job of size 0.
class Progress {
 public:
  /// `terminal` chooses between one rewritten line and a line every 10 %.
  Progress(std::string label, std::size_t total, bool terminal = stderr_is_terminal(), std::FILE* stream = stderr)
      : label_(std::move(label)), total_(total), terminal_(terminal), stream_(stream) {}

  /// Reports that `done` of the total are done; `note` follows the percentage.
  void update(std::size_t done, const std::string& note = {}) {
    if (total_ == 0) return;
    const auto percent = static_cast<int>(100 * std::min(done, total_) / total_);
    if (terminal_ ? percent == shown_ : percent / 10 == shown_ / 10 && shown_ >= 0) return;
    shown_ = percent;
    if (!terminal_) {
      std::fprintf(stream_, "%s: %d %%%s%s\n", label_.c_str(), percent, note.empty() ? "" : ", ", note.c_str());
      return;
    }
    const int filled = percent * 24 / 100;
    std::fprintf(stream_, "\r%s [%s%s] %3d %% %-40.40s", label_.c_str(), std::string(static_cast<std::size_t>(filled), '#').c_str(),
                 std::string(static_cast<std::size_t>(24 - filled), '.').c_str(), percent, note.c_str());
    std::fflush(stream_);
  }

  /// Clears the line of a terminal, so that what follows begins at its left edge.
  void finish() {
    if (terminal_ && shown_ >= 0) std::fprintf(stream_, "\r%*s\r", static_cast<int>(label_.size() + 76), "");
    if (terminal_) std::fflush(stream_);
  }

 private:
  std::string label_;
  std::size_t total_;
  bool terminal_;
  std::FILE* stream_;
  int shown_{-1};
};

}  // namespace searvins::examples
