// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The paper's two tables from scored runs, its own rows beside them if wanted (paper_results.hpp): as text, Markdown, CSV and HTML.
///
/// Columns, their order and units are the paper's: method; GNSS, vision, IMU; horizontal RMSE and maximum (m), shares below 1.0 m and 1.5 m
/// (% of all epochs), P95 (m); 3-D RMSE, maximum, P95 (m); availability (%). The second: epochs with an applied integer solution, their
/// rate (% of all epochs), and of these the share below 0.5 m (%), the number at 0.5 m or more, RMSE and maximum (m), horizontal.
///
/// The CSV has one line a method with the columns of both tables, and says in `source` whether it is a `run` or the `paper`.
#pragma once

#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include <searvins/io/text_fields.hpp>

#include "examples/support/evaluation.hpp"
#include "examples/support/html_text.hpp"
#include "examples/support/paper_results.hpp"
#include "examples/support/run_details.hpp"
#include "examples/support/table.hpp"

namespace searvins::examples {

/// A line of either table, as texts. An empty text: the method has no such figure.
struct PaperTableRow {
  std::string method{}, gnss{}, vision{}, imu{};  ///< vision "no": none; all three empty: not known
  std::array<std::string, 9> position{};
  std::array<std::string, 6> fixed{};
  bool is_paper{false}, has_position{true}, has_fixed{true};
};

/// A figure of the paper as it prints it: 4.95, >1e4.
[[nodiscard]] inline std::string paper_figure_text(const PaperFigure& figure, int decimals) {
  if (!figure.is_above) return io::fixed_text(figure.value, decimals);
  char text[32];
  const int exponent = static_cast<int>(std::floor(std::log10(figure.value) + 1e-9));
  std::snprintf(text, sizeof text, ">%.0fe%d", figure.value / std::pow(10.0, exponent), exponent);
  return text;
}

/// The line of a scored run, with `decimals` of its metres; percentages have the paper's digits.
[[nodiscard]] inline PaperTableRow paper_table_row(const std::string& name, const SensorConfiguration& sensors, const Evaluation& e,
                                                   int decimals = 2) {
  const auto text = [](double value, int digits) {
    std::string out;
    io::append_fixed(out, value, digits);
    return out;
  };
  PaperTableRow row;
  row.method = name;
  if (sensors.is_known)
    row.gnss = sensors.gnss.empty() ? "no" : sensors.gnss, row.vision = sensors.vision.empty() ? "no" : sensors.vision,
    row.imu = sensors.has_imu ? "yes" : "no";
  row.position = {text(e.horizontal.rmse_m, decimals),
                  text(e.horizontal.max_m, decimals),
                  text(e.below_1p0_pct, 2),
                  text(e.below_1p5_pct, 2),
                  text(e.horizontal.p95_m, decimals),
                  text(e.spatial.rmse_m, decimals),
                  text(e.spatial.max_m, decimals),
                  text(e.spatial.p95_m, decimals),
                  text(e.availability_pct, 1)};
  row.fixed = {std::to_string(e.fixed),
               text(e.fix_rate_pct, 2),
               text(e.fixed_below_0p5_pct, 2),
               std::to_string(e.wrong_fixes),
               text(e.fixed_horizontal.rmse_m, decimals),
               text(e.fixed_horizontal.max_m, decimals)};
  return row;
}

/// The paper's own lines, in its order.
[[nodiscard]] inline std::vector<PaperTableRow> paper_rows() {
  constexpr int decimals[9] = {2, 2, 2, 2, 2, 2, 2, 2, 1};
  std::vector<PaperTableRow> rows;
  for (const PaperPositionRow& p : kPaperPositions) {
    PaperTableRow& row = rows.emplace_back();
    row.method = p.method, row.gnss = p.gnss, row.vision = *p.vision ? p.vision : "no", row.imu = p.has_imu ? "yes" : "no";
    row.is_paper = true, row.has_fixed = false;
    for (std::size_t i = 0; i < 9; ++i) row.position[i] = paper_figure_text(p.figures[i], decimals[i]);
    for (const PaperFixRow& f : kPaperFixes) {
      if (row.method != f.method) continue;
      row.has_fixed = true;
      row.fixed = {std::to_string(f.used_fix_epochs), io::fixed_text(f.fix_rate_pct, 2), io::fixed_text(f.below_0p5_pct, 2),
                   std::to_string(f.from_0p5_epochs), io::fixed_text(f.rmse_m, 2),       io::fixed_text(f.max_m, 2)};
    }
  }
  return rows;
}

namespace detail {

inline constexpr std::array kPositionColumns{"GNSS",     "vision",  "IMU",       "H RMSE m", "H max m",  "<1.0 m %",
                                             "<1.5 m %", "H P95 m", "3D RMSE m", "3D max m", "3D P95 m", "avail. %"};
inline constexpr std::array kFixedColumns{"used-fix epochs", "fix rate %", "<0.5 m %", ">=0.5 m epochs", "H RMSE m", "H max m"};
inline constexpr const char* kPositionCaption = "Position (the paper's first table)";
inline constexpr const char* kFixedCaption = "Epochs with applied integers (the paper's second table)";

[[nodiscard]] inline std::string method_text(const PaperTableRow& row) { return row.method + (row.is_paper ? " [paper]" : ""); }
[[nodiscard]] inline std::string or_dash(const std::string& text) { return text.empty() ? "-" : text; }

/// Method and cells of a line, of the first or second table.
[[nodiscard]] inline std::vector<std::string> table_cells(const PaperTableRow& row, bool fixed) {
  std::vector<std::string> cells{method_text(row)};
  if (fixed) {
    for (const std::string& text : row.fixed) cells.push_back(or_dash(text));
    return cells;
  }
  for (const std::string* text : {&row.gnss, &row.vision, &row.imu}) cells.push_back(or_dash(*text));
  for (const std::string& text : row.position) cells.push_back(or_dash(text));
  return cells;
}

[[nodiscard]] inline std::vector<std::string> table_header(bool fixed) {
  std::vector<std::string> header{"method"};
  if (fixed)
    header.insert(header.end(), kFixedColumns.begin(), kFixedColumns.end());
  else
    header.insert(header.end(), kPositionColumns.begin(), kPositionColumns.end());
  return header;
}

[[nodiscard]] inline std::string markdown_line(const std::vector<std::string>& cells) {
  std::string line = "|";
  for (const std::string& cell : cells) {
    line += ' ';
    for (const char c : cell) {
      if (c == '|') line += '\\';
      line += c;
    }
    line += " |";
  }
  return line + '\n';
}

[[nodiscard]] inline std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) (out += c == '"' ? "\"" : "") += c;
  return out + '"';
}

/// One of the two tables with the paper's two-line head.
[[nodiscard]] inline std::string paper_html_table(const std::vector<PaperTableRow>& rows, bool fixed) {
  std::string text = "<div class=\"scroll\"><table class=\"runs paper\"><tr>";
  text +=
      fixed
          ? "<th rowspan=\"2\">method</th><th rowspan=\"2\">used-fix epochs</th><th rowspan=\"2\">fix rate %</th><th class=\"group\" "
            "colspan=\"4\">horizontal error</th></tr><tr><th>&lt; 0.5 m %</th><th>&ge; 0.5 m epochs</th><th>RMSE m</th><th>max m</th></tr>"
          : "<th rowspan=\"2\">method</th><th class=\"group\" colspan=\"3\">configuration</th><th class=\"group\" colspan=\"5\">horizontal "
            "error</th><th class=\"group\" colspan=\"3\">3-D error</th><th rowspan=\"2\">avail. "
            "%</th></tr><tr><th>GNSS</th><th>vision</th><th>IMU</th><th>RMSE m</th><th>max m</th><th>&lt; 1.0 m %</th><th>&lt; 1.5 m "
            "%</th><th>P95 m</th><th>RMSE m</th><th>max m</th><th>P95 m</th></tr>";
  for (const PaperTableRow& row : rows) {
    if (!(fixed ? row.has_fixed : row.has_position)) continue;
    const std::vector<std::string> cells = table_cells(row, fixed);
    text += row.is_paper ? "<tr class=\"of-paper\">" : "<tr>";
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const bool is_sensor = !fixed && i >= 1 && i <= 3;
      text += "<td>" +
              (is_sensor && cells[i] == "no"    ? std::string{"&times;"}
               : is_sensor && cells[i] == "yes" ? std::string{"&check;"}
               : i == 0                         ? html_text(row.method) + (row.is_paper ? "<small>paper</small>" : "")
               : cells[i] == "-"                ? std::string{"&ndash;"}
                                                : html_text(cells[i])) +
              "</td>";
    }
    text += "</tr>";
  }
  return text + "</table></div>";
}

}  // namespace detail

/// Both tables for a terminal, plain ASCII.
[[nodiscard]] inline std::string paper_table_text(const std::vector<PaperTableRow>& rows) {
  std::string text;
  for (const bool fixed : {false, true}) {
    Table table{detail::table_header(fixed)};
    for (const PaperTableRow& row : rows)
      if (fixed ? row.has_fixed : row.has_position) table.row(detail::table_cells(row, fixed));
    text += std::string{fixed ? "\n" : ""} + (fixed ? detail::kFixedCaption : detail::kPositionCaption) + '\n' + table.text();
  }
  return text;
}

/// Both tables for a Markdown file.
[[nodiscard]] inline std::string paper_table_markdown(const std::vector<PaperTableRow>& rows) {
  std::string text;
  for (const bool fixed : {false, true}) {
    const std::vector<std::string> header = detail::table_header(fixed);
    text += std::string{fixed ? "\n" : ""} + "**" + (fixed ? detail::kFixedCaption : detail::kPositionCaption) + "**\n\n" +
            detail::markdown_line(header) + "|---|";
    for (std::size_t i = 1; i < header.size(); ++i) text += !fixed && i <= 3 ? ":-:|" : "--:|";
    text += '\n';
    for (const PaperTableRow& row : rows)
      if (fixed ? row.has_fixed : row.has_position) text += detail::markdown_line(detail::table_cells(row, fixed));
  }
  return text;
}

/// One line a method with the columns of both tables; a figure that does not exist is an empty field.
[[nodiscard]] inline std::string paper_table_csv(const std::vector<PaperTableRow>& rows) {
  std::string text =
      "method,source,gnss,vision,imu,h_rmse_m,h_max_m,h_below_1p0_pct,h_below_1p5_pct,h_p95_m,d3_rmse_m,d3_max_m,d3_p95_m,availability_pct,"
      "used_fix_epochs,fix_rate_pct,fix_below_0p5_pct,fix_from_0p5_epochs,fix_h_rmse_m,fix_h_max_m\n";
  for (const PaperTableRow& row : rows) {
    text += detail::csv_field(row.method) + (row.is_paper ? ",paper" : ",run");
    for (const std::string* field : {&row.gnss, &row.vision, &row.imu}) text += ',' + detail::csv_field(*field);
    for (const std::string& field : row.position) text += ',' + field;
    for (const std::string& field : row.fixed) text += ',' + field;
    text += '\n';
  }
  return text;
}

/// Both tables for a page.
[[nodiscard]] inline std::string paper_table_html(const std::vector<PaperTableRow>& rows) {
  return "<section class=\"card\"><div class=\"head\"><h2>Position</h2><span class=\"note\">the paper's first table; shares are of all "
         "epochs</span></div>" +
         detail::paper_html_table(rows, false) +
         "</section>\n<section class=\"card\"><div class=\"head\"><h2>Epochs with applied integers</h2><span class=\"note\">the paper's "
         "second "
         "table</span></div>" +
         detail::paper_html_table(rows, true) + "</section>\n";
}

}  // namespace searvins::examples
