// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Tables for a terminal: plain ASCII, columns as wide as their longest cell, numbers to the right.
#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <searvins/io/text_fields.hpp>

namespace searvins::examples {

/// A cell for a number with `decimals` digits; "-" when it is not finite.
[[nodiscard]] inline std::string cell(double value, int decimals) {
  std::string text;
  io::append_fixed(text, value, decimals);
  return text.empty() ? "-" : text;
}

/// A table: the first column is aligned left, the others right.
class Table {
 public:
  explicit Table(std::vector<std::string> header) : header_(std::move(header)) {}

  /// Appends a row; missing cells are blank, surplus ones are dropped.
  void row(std::vector<std::string> cells) {
    cells.resize(header_.size());
    rows_.push_back(std::move(cells));
  }

  /// The table as text: header, rule, rows.
  [[nodiscard]] std::string text() const {
    std::vector<std::size_t> widths;
    for (std::size_t c = 0; c < header_.size(); ++c) {
      widths.push_back(header_[c].size());
      for (const auto& row : rows_) widths[c] = std::max(widths[c], row[c].size());
    }
    std::string out = line(header_, widths);
    for (std::size_t c = 0; c < widths.size(); ++c) out += std::string(c > 0 ? 2 : 0, ' ') + std::string(widths[c], '-');
    out += '\n';
    for (const auto& row : rows_) out += line(row, widths);
    return out;
  }

 private:
  [[nodiscard]] static std::string line(const std::vector<std::string>& cells, const std::vector<std::size_t>& widths) {
    std::string out;
    for (std::size_t c = 0; c < cells.size(); ++c) {
      const std::string pad(widths[c] - cells[c].size(), ' ');
      if (c > 0) out += "  ";
      out += c == 0 ? cells[c] + pad : pad + cells[c];
    }
    while (!out.empty() && out.back() == ' ') out.pop_back();
    return out + '\n';
  }

  std::vector<std::string> header_;
  std::vector<std::vector<std::string>> rows_;
};

}  // namespace searvins::examples
