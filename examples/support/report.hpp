// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// report.html: one self-contained page about a run, from a plain RunReport. Nothing is fetched, so it can be mailed and archived.
///
/// The figures are computed here, from every row; the charts draw embedded data (report_data.hpp). Text from outside is escaped.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include <searvins/io/text_fields.hpp>
#include <searvins/io/trajectory.hpp>
#include <searvins/version.hpp>

#include "examples/support/evaluation.hpp"
#include "examples/support/html_text.hpp"
#include "examples/support/report_charts.hpp"
#include "examples/support/report_data.hpp"
#include "examples/support/report_distributions.hpp"
#include "examples/support/report_integrity.hpp"
#include "examples/support/report_map.hpp"
#include "examples/support/report_page.hpp"
#include "examples/support/report_scales.hpp"
#include "examples/support/report_strip.hpp"
#include "examples/support/report_style.hpp"
#include "examples/support/run_report.hpp"
#include "examples/support/table.hpp"

namespace searvins::examples {

namespace detail {

/// A length in the unit that suits it.
[[nodiscard]] inline std::string length_text(double m) {
  if (!std::isfinite(m)) return "&ndash;";
  const auto unit = [](double value, int decimals, const char* name) {
    return io::fixed_text(value, decimals) + "<small>" + name + "</small>";
  };
  return m >= 10     ? unit(m, 1, "m")
         : m >= 1    ? unit(m, 2, "m")
         : m >= 0.1  ? unit(m * 100, 1, "cm")
         : m >= 0.01 ? unit(m * 100, 2, "cm")
                     : unit(m * 1000, 1, "mm");
}

[[nodiscard]] inline std::string percent_text(double pct) {
  return std::isfinite(pct) ? io::fixed_text(pct, pct > 0 && pct < 100 ? (pct > 99 || pct < 10 ? 2 : 1) : 0) + "<small>%</small>"
                            : "&ndash;";
}

[[nodiscard]] inline std::string tile(const std::string& value_html, const std::string& label, const char* kind = "") {
  return std::string{"<div class=\"tile "} + kind + "\"><b>" + value_html + "</b><span>" + html_text(label) + "</span></div>\n";
}

[[nodiscard]] inline std::string table_html(const std::string& caption, const std::vector<ReportEntry>& lines, bool wrap = false) {
  if (lines.empty()) return {};
  std::string text = "<table>";
  if (!caption.empty()) text += "<caption>" + html_text(caption) + "</caption>";
  for (const auto& [label, value] : lines)
    text += "<tr><th>" + html_text(label) + "</th><td" + (wrap ? " class=\"wrap\"" : "") + ">" + html_text(value) + "</td></tr>";
  return text + "</table>\n";
}

/// Rows by status, of all rows.
[[nodiscard]] inline std::array<std::size_t, io::kSolutionStatuses> count_by_status(const std::vector<io::TrajectoryRow>& rows) {
  std::array<std::size_t, io::kSolutionStatuses> counts{};
  for (const io::TrajectoryRow& row : rows) ++counts[static_cast<std::size_t>(row.status)];
  return counts;
}

[[nodiscard]] inline std::string duration_text(double s) {
  if (s < 120) return io::fixed_text(s, 0) + "<small>s</small>";
  const auto minutes = static_cast<long>(s / 60);
  return minutes < 120 ? std::to_string(minutes) + "<small>min</small> " + io::fixed_text(s - 60 * static_cast<double>(minutes), 0) +
                             "<small>s</small>"
                       : std::to_string(minutes / 60) + "<small>h</small> " + std::to_string(minutes % 60) + "<small>min</small>";
}

[[nodiscard]] inline std::string tiles_html(const RunReport& report) {
  const std::vector<io::TrajectoryRow>& rows = report.rows;
  const auto counts = count_by_status(rows);
  std::vector<double> solve_ms, sigma_m;
  for (const io::TrajectoryRow& row : rows) {
    if (std::isfinite(row.solve_ms)) solve_ms.push_back(row.solve_ms);
    if (row.sd_enu_m.allFinite()) sigma_m.push_back(std::hypot(row.sd_enu_m.x(), row.sd_enu_m.y()));
  }
  std::string text = "<section class=\"tiles\">\n";
  if (const auto& e = report.evaluation) {
    text += tile(percent_text(e->availability_pct), "available of " + std::to_string(e->epochs.size()) + " epochs",
                 e->availability_pct == 100 ? "" : "bad");
    text += tile(percent_text(e->fix_rate_pct), "fixed");
    text += tile(length_text(e->horizontal.rmse_m), "horizontal RMSE");
    text += tile(length_text(e->horizontal.p95_m), "horizontal, 95 %");
    text += tile(length_text(e->fixed_horizontal.rmse_m), "RMSE of fixed epochs");
    text += tile(std::to_string(e->wrong_fixes), "wrong fixes (0.5 m or more)", e->wrong_fixes ? "bad" : e->fixed ? "good" : "");
  } else {
    text += tile(std::to_string(rows.size()), "rows");
    text += tile(percent_text(share_pct(counts[0], rows.size())), "fixed");
    text += tile(percent_text(share_pct(counts[1], rows.size())), "float");
    if (!sigma_m.empty()) text += tile(length_text(percentile(sigma_m, 0.5)), "median reported sigma, horizontal");
  }
  if (!rows.empty()) text += tile(duration_text(seconds_between(rows.front().time, rows.back().time)), "duration");
  if (!solve_ms.empty()) text += tile(io::fixed_text(percentile(solve_ms, 0.5), 2) + "<small>ms</small>", "median solve time");
  return text + "</section>\n";
}

/// The longest outages, in the order of time.
[[nodiscard]] inline std::string outages_html(const RunReport& report) {
  constexpr std::size_t kShown = 12;
  std::vector<Outage> longest = report.outages;
  std::stable_sort(longest.begin(), longest.end(), [](const Outage& a, const Outage& b) { return a.length_s() > b.length_s(); });
  if (longest.size() > kShown) longest.resize(kShown);
  std::sort(longest.begin(), longest.end(), [](const Outage& a, const Outage& b) { return a.from < b.from; });
  std::vector<ReportEntry> lines;
  for (const Outage& o : longest) {
    std::string text = io::fixed_text(o.length_s(), 1) + " s";
    if (std::isfinite(o.horizontal_error_m)) text += ", error " + cell(o.horizontal_error_m, 2) + " m";
    if (std::isfinite(o.sigma_m)) text += ", sigma " + cell(o.sigma_m, 2) + " m";
    lines.emplace_back("from sow " + io::fixed_text(o.from.sow(), 1), text);
  }
  return table_html(report.outages.size() > kShown ? "Without GNSS, the longest" : "Without GNSS", lines);
}

[[nodiscard]] inline std::string figures_html(const RunReport& report) {
  const auto counts = count_by_status(report.rows);
  constexpr const char* names[] = {"fixed", "float", "code differences", "single point", "dead reckoning"};
  std::string text = "<div class=\"share\">";
  std::vector<ReportEntry> statuses;
  for (std::size_t s = 0; s < counts.size(); ++s) {
    if (!counts[s]) continue;
    const double pct = share_pct(counts[s], report.rows.size());
    text += std::string{"<i style=\"width:"} + io::fixed_text(pct, 3) + "%;background:var(--" +
            io::name_of(static_cast<io::SolutionStatus>(s)) + ")\"></i>";
    statuses.emplace_back(names[s], std::to_string(counts[s]) + "  (" + io::fixed_text(pct, 2) + " %)");
  }
  text += "</div>" + table_html({}, statuses);
  if (const auto& e = report.evaluation) {
    const auto triple = [](const ErrorFigures& f, int d) {
      return cell(f.rmse_m, d) + " / " + cell(f.p95_m, d) + " / " + cell(f.max_m, d);
    };
    text += table_html("Errors, metres",
                       {{"H RMSE / P95 / max", triple(e->horizontal, 3)},
                        {"3-D RMSE / P95 / max", triple(e->spatial, 3)},
                        {"up RMSE / P95 / max", triple(e->vertical, 3)},
                        {"below 1.0 m / 1.5 m, of all", cell(e->below_1p0_pct, 2) + " % / " + cell(e->below_1p5_pct, 2) + " %"}});
    text += table_html("Fixed epochs", {{"number / rate", std::to_string(e->fixed) + " / " + cell(e->fix_rate_pct, 2) + " %"},
                                        {"below 0.5 m", cell(e->fixed_below_0p5_pct, 2) + " %"},
                                        {"H RMSE / P95 / max", triple(e->fixed_horizontal, 4)}});
    if (e->with_nees)
      text += table_html("Covariance", {{"mean NEES, 3 expected", cell(e->mean_nees, 2)},
                                        {"within its 95 % region", cell(e->nees_within_95_pct, 1) + " %"}});
  }
  return text + table_html(report.figures.empty() ? "" : "Run", report.figures) + outages_html(report);
}

/// Integrity of a scored run; nothing without truth or covariance.
[[nodiscard]] inline std::string run_integrity_html(const RunReport& report) {
  if (!report.evaluation || report.evaluation->with_error == 0) return {};
  std::vector<double> ratios;
  if (report.epochs.size() == report.rows.size())
    for (const ReportEpoch& epoch : report.epochs) ratios.push_back(epoch.ratio);
  const std::string name = "this run";
  const Integrity integrity = assess_integrity(*report.evaluation, report.rows);
  const std::vector<WrongFix> wrong_fixes = wrong_fixes_of(*report.evaluation, report.rows, ratios);
  return integrity_html({{name, *report.evaluation, integrity, wrong_fixes}}, false);
}

[[nodiscard]] inline std::string settings_html(const RunReport& report) {
  std::string text;
  if (!report.notes.empty()) {
    text += "<section class=\"card\"><div class=\"head\"><h2>Notes</h2></div><ul class=\"notes\">";
    for (const std::string& note : report.notes) text += "<li>" + html_text(note) + "</li>";
    text += "</ul></section>\n";
  }
  if (report.settings.empty()) return text;
  text += "<section class=\"card\"><div class=\"head\"><h2>Settings</h2></div><div class=\"settings\">";
  const std::size_t third = (report.settings.size() + 2) / 3;  // three tables, so that columns do not cut one
  for (std::size_t begin = 0; begin < report.settings.size(); begin += third)
    text += table_html({},
                       {report.settings.begin() + static_cast<std::ptrdiff_t>(begin),
                        report.settings.begin() + static_cast<std::ptrdiff_t>(std::min(begin + third, report.settings.size()))},
                       true);
  return text + "</div></section>\n";
}

}  // namespace detail

/// The whole page.
[[nodiscard]] inline std::string report_html(const RunReport& report) {
  const std::string title = html_text(report.title);
  std::string text =
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width, "
      "initial-scale=1\">\n<title>" +
      title + "</title>\n<style>" + kReportStyle +
      "</style>\n</head>\n<body>\n<main>\n<header><div class=\"over\">searvins report</div><h1>" + title + "</h1>";
  if (!report.subtitle.empty()) text += "<p class=\"sub\">" + html_text(report.subtitle) + "</p>";
  if (!report.command.empty()) text += "<p class=\"command\"><code>" + html_text(report.command) + "</code></p>";
  text += "</header>\n" + detail::tiles_html(report);
  if (report.rows.empty())
    return text + "<section class=\"card\"><p>The run has no row.</p></section>\n" + strip_section(report.strip) +
           detail::settings_html(report) + "</main>\n</body>\n</html>\n";
  text +=
      "<section class=\"columns\">\n<div class=\"card mapcard\"><div class=\"head\"><h2>Track</h2><span class=\"buttons\" "
      "id=\"mapbuttons\"><button data-do=\"in\" aria-label=\"zoom in\">+</button>"
      "<button data-do=\"out\" aria-label=\"zoom out\">&minus;</button><button data-do=\"all\">all</button><button "
      "data-do=\"fix\">fixed</button></span>"
      "<span class=\"note hint\">drag to move; click, then turn the wheel to zoom</span><span id=\"maplegend\" "
      "style=\"margin-left:auto\"></span></div>"
      "<div class=\"grow\" id=\"maphost\" role=\"img\" aria-label=\"map of the track\"></div></div>\n<div class=\"card\"><div "
      "class=\"head\"><h2>Figures</h2></div>" +
      detail::figures_html(report) + "</div>\n</section>\n";
  text +=
      "<section class=\"card\"><div class=\"head\"><h2>Over time</h2><span class=\"note\">GPS time of day</span><span class=\"buttons\" "
      "id=\"timebuttons\" style=\"margin-left:auto\"></span></div><div id=\"time\"></div></section>\n";
  text += "<section class=\"three\" id=\"three\"></section>\n" + detail::run_integrity_html(report) + strip_section(report.strip) +
          detail::settings_html(report);
  text += std::string{"<footer>searvins "} + kVersionString +
          "</footer>\n</main>\n<div id=\"tip\" role=\"status\"></div>\n<noscript><p style=\"padding:24px\">The charts need JavaScript; the "
          "figures above do not.</p></noscript>\n";
  text += "<script type=\"application/json\" id=\"run-data\">" + detail::ReportData{report}.json() + "</script>\n<script>(() => {" +
          kReportScales + kReportCharts + kReportMap + kReportDistributions + kReportStanford + kReportPage + "})();</script>\n</body>\n</html>\n";
  return text;
}

/// Writes the page; an empty string on success, else what went wrong.
[[nodiscard]] inline std::string write_report(const std::string& path, const RunReport& report) {
  return io::write_text_file(path, report_html(report));
}

}  // namespace searvins::examples
