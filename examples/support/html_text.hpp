// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Text from outside for an HTML page.
#pragma once

#include <string>
#include <string_view>

namespace searvins::examples {

/// Text for HTML: markup characters become references.
[[nodiscard]] inline std::string html_text(std::string_view text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&': out += "&amp;"; break;
      case '<': out += "&lt;"; break;
      case '>': out += "&gt;"; break;
      case '"': out += "&quot;"; break;
      default: out += c;
    }
  }
  return out;
}

}  // namespace searvins::examples
