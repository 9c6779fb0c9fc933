// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// One self-contained page that lays several scored runs over one another: tables, tracks, errors over time, distributions.
///
/// Time is that of the evaluation epochs, which runs scored against one truth share; a run without an estimate at one has a hole there. The
/// charts are those of report.html (report_charts.hpp), with a colour a run instead of a colour a status.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include <searvins/geodesy/local_frame.hpp>
#include <searvins/io/text_fields.hpp>
#include <searvins/io/trajectory.hpp>

#include "examples/support/assessment.hpp"
#include "examples/support/evaluation.hpp"
#include "examples/support/json_writer.hpp"
#include "examples/support/paper_table.hpp"
#include "examples/support/report.hpp"
#include "examples/support/report_integrity.hpp"
#include "examples/support/street_data.hpp"
#include "examples/support/table.hpp"

namespace searvins::examples {

/// A run of the page.
using ComparedRun = AssessedRun;

/// Everything the page shows.
struct Comparison {
  std::string title{"searvins comparison"};
  std::string command{};
  std::vector<ComparedRun> runs{};  ///< at least one, scored against one truth
  std::vector<imu::CentrelinePoint> streets{};  ///< drawn below the tracks
  std::vector<PaperTableRow> table{};  ///< the paper's tables; empty: none
};

namespace detail {

inline constexpr std::size_t kRunColors = 8;  ///< of the style sheet; runs beyond begin anew

inline constexpr const char* kCompareMap = R"js(
/* Tracks of all runs, one colour each; the first on top. */
class TracksView extends MapView {
  draw() {
    this.shown.fill(false);
    super.draw();
    const g = this.back.getContext('2d');
    for (let k = D.runs.length - 1; k >= 0; --k) {
      const r = D.runs[k];
      g.strokeStyle = C.cat[k % 8];
      g.lineWidth = 1.8;
      g.globalAlpha = 0.9;
      g.beginPath();
      let pen = false;
      for (let i = 0; i < N; ++i) {
        if (!ok(r.e[i])) {
          pen = false;
          continue;
        }
        const x = this.X(r.e[i]), y = this.Y(r.n[i]);
        pen ? g.lineTo(x, y) : g.moveTo(x, y);
        pen = true;
      }
      g.stroke();
      g.globalAlpha = 1;
    }
  }
}
)js";

inline constexpr const char* kComparePage = R"js(
const $ = id => document.getElementById(id);
const legend = entries => '<div class="legend">' +
    entries.map(e => '<span><i class="thin" style="background:' + e[1] + '"></i>' + esc(e[0]) + '</span>').join('') + '</div>';
const refreshers = [], color = k => C.cat[k % 8], names = () => D.runs.map((r, k) => [r.name, color(k)]);
function headed(host, box, title, note, entries, tag) {
  const head = el('div', 'head');
  host.append(box);
  box.append(head);
  const write = () => {
    head.innerHTML = '<' + tag + '>' + esc(title) + '</' + tag + '>' + (note ? '<span class="note">' + esc(note) + '</span>' : '') +
        (entries ? legend(entries()) : '');
  };
  write();
  refreshers.push(write);
  return box;
}
const panel = (title, note, entries, options) =>
    new TimeChart(headed($('time'), el('div', 'panel'), title, note, entries, 'h3'), options);
D.runs.forEach((r, k) => panel(r.name, k ? '' : 'status', k ? null : () => STATUS_TEXT.map((n, s) => [n, C.status[s]]), {
  height: 26,
  ticks: [],
  axis: false,
  range: () => [0, 1],
  paint: c => c.ribbon(r.s, C.status),
  rows: i => [[r.name, ok(r.s[i]) ? STATUS_TEXT[r.s[i]] : 'nothing', ok(r.s[i]) ? C.status[r.s[i]] : null]]
}));
[['Horizontal error', 'h'], ['Vertical error', 'v'], ['NEES of the position', 'q']].forEach(([title, key]) => {
  const all = sorted([].concat(...D.runs.map(r => r[key] || []))).filter(v => v > 0);
  if (!all.length) return;
  const lo = Math.max(1e-4, quantile(all, 0.01) * 0.7), hi = Math.max(quantile(all, 1) * 1.4, 10 * lo), nees = key === 'q';
  panel(title, nees ? 'shaded: where 95 % belong' : 'estimate against truth, logarithmic', names, {
    height: nees ? 130 : 190,
    scale: 'log',
    format: nees ? short : axisMetres,
    range: () => [lo, hi],
    paint: c => {
      if (nees) c.stripe(0.2158, 9.3484, C.band);
      for (let k = D.runs.length - 1; k >= 0; --k)
        c.dots((D.runs[k][key] || []).map(v => ok(v) ? Math.max(v, lo) : null), () => color(k), 1.7);
    },
    rows: i => D.runs.map((r, k) => [r.name, r[key] && ok(r[key][i]) ? (nees ? r[key][i].toFixed(2) : metres(r[key][i])) : '–', color(k)])
  });
});
if (D.integrity && D.runs.some(r => has(r.b))) {
  const all = sorted([].concat(...D.runs.map(r => r.b))), lo = Math.max(1e-4, quantile(all, 0.01) * 0.7);
  panel('Horizontal bound', stanfordNote(), names, {
    height: 130,
    scale: 'log',
    format: axisMetres,
    range: () => [lo, Math.max(quantile(all, 1), D.integrity.limit) * 1.4],
    paint: c => {
      c.mark(D.integrity.limit, C.status[3]);
      for (let k = D.runs.length - 1; k >= 0; --k) c.dots(D.runs[k].b.map(v => ok(v) ? Math.max(v, lo) : null), () => color(k), 1.5);
    },
    rows: i => D.runs.map((r, k) => [r.name, metres(r.b[i]), color(k)])
  });
  if ($('stanford')) {
    const range = stanfordRange([].concat(...D.runs.map(r => [r.h, r.b])));
    D.runs.forEach((r, k) => {
      if (has(r.b))
        new StanfordView(
            headed($('stanford'), el('div', 'card'), r.name, 'Stanford diagram', null, 'h2'), r.h, r.b, range, () => color(k));
    });
  }
}
const map = new TracksView($('maphost'));
$('mapbuttons').querySelectorAll('button').forEach(b => b.onclick = () => {
  if (b.dataset.do === 'all') {
    map.fit(-1);
    map.draw();
  } else
    map.zoom(b.dataset.do === 'in' ? 1.6 : 1 / 1.6);
});
const mapLegend = () => {
  $('maplegend').innerHTML = legend(names());
};
mapLegend();
refreshers.push(mapLegend);
[['Horizontal error', 'h'], ['Vertical error', 'v'], ['3-D error', 'd']].forEach(([title, key]) => {
  const sets = D.runs.map((r, k) => [r.name, r[key] || [], () => color(k)]);
  if (!sets.some(s => has(s[1]))) return;
  new CdfView(headed($('three'), el('div', 'card'), title, 'share of all epochs', names, 'h2'), sets, () => D.t.length);
});
matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => {
  readColors();
  refreshers.forEach(f => f());
  shared.charts.forEach(c => c.draw());
});
)js";

/// The page's data: one time column, and columns of every run over it.
[[nodiscard]] inline std::string compare_json(const Comparison& comparison) {
  std::vector<GpsTime> times;
  for (const ComparedRun& run : comparison.runs)
    for (const ScoredEpoch& epoch : run.evaluation.epochs) times.push_back(epoch.time);
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  const GpsTime start = times.empty() ? GpsTime{} : times.front();
  const std::vector<io::TrajectoryRow>& first = comparison.runs.front().rows;
  const auto placed = std::find_if(first.begin(), first.end(), [](const io::TrajectoryRow& r) { return r.p_e_m.allFinite(); });
  const geodesy::LocalFrame w = geodesy::LocalFrame::at(placed == first.end() ? Eigen::Vector3d{6378137, 0, 0} : placed->p_e_m);

  const auto list = [&times](const std::vector<const ScoredEpoch*>& epochs, int decimals, const std::function<double(const ScoredEpoch&)>& value) {
    std::string text;
    for (std::size_t i = 0; i < times.size(); ++i) {
      const double v = epochs[i] ? value(*epochs[i]) : io::kUnknown;
      text += (text.empty() ? "" : ",") + (std::isfinite(v) ? io::fixed_text(v, decimals) : std::string{"null"});
    }
    return '[' + text + ']';
  };
  const IntegrityOptions& options = comparison.runs.front().integrity.options;
  std::string runs, overall_s, overall_e, overall_n;
  for (const ComparedRun& run : comparison.runs) {
    std::vector<const ScoredEpoch*> at(times.size(), nullptr);
    std::size_t k = 0;
    for (const ScoredEpoch& epoch : run.evaluation.epochs) {
      while (times[k] < epoch.time) ++k;
      if (epoch.available) at[k] = &epoch;
    }
    const auto local = [&](const ScoredEpoch& e) { return w.to_local(run.rows[e.row].p_e_m); };
    const std::string s = list(at, 0, [](const ScoredEpoch& e) { return static_cast<double>(e.status); });
    const std::string e = list(at, 3, [&](const ScoredEpoch& x) { return local(x).x(); });
    const std::string n = list(at, 3, [&](const ScoredEpoch& x) { return local(x).y(); });
    if (runs.empty()) overall_s = s, overall_e = e, overall_n = n;
    runs += (runs.empty() ? "{\"name\":" : ",{\"name\":") + json_literal(std::string_view{run.name}) + ",\"s\":" + s + ",\"e\":" + e + ",\"n\":" + n +
            ",\"h\":" + list(at, 4, [](const ScoredEpoch& x) { return x.horizontal_m(); }) +
            ",\"v\":" + list(at, 4, [](const ScoredEpoch& x) { return std::abs(x.error_enu_m.z()); }) +
            ",\"d\":" + list(at, 4, [](const ScoredEpoch& x) { return x.spatial_m(); }) +
            ",\"q\":" + list(at, 3, [](const ScoredEpoch& x) { return x.nees; }) +
            ",\"b\":" + list(at, 4, [&](const ScoredEpoch& x) { return horizontal_bound_m(x, run.rows, options.risk); }) + '}';
  }
  std::string t;
  for (const GpsTime time : times) t += (t.empty() ? "" : ",") + io::fixed_text(seconds_between(start, time), 3);
  return "{\"sow\":" + json_literal(start.sow()) + ",\"t\":[" + t + "]" + street_member(comparison.streets, w) + ",\"s\":" + overall_s + ",\"e\":" + overall_e + ",\"n\":" + overall_n +
         ",\"integrity\":" + integrity_data(options) + ",\"runs\":[" + runs + "]}";
}

[[nodiscard]] inline std::string compare_table(const Comparison& comparison) {
  constexpr std::array heads{"run", "H RMSE m", "H P95 m", "H max m", "3-D RMSE m", "< 1.5 m %", "available %", "fixed %", "wrong fixes", "fixed H RMSE m", "mean NEES (3)"};
  std::string text = "<div class=\"scroll\"><table class=\"runs\"><tr>";
  for (const char* head : heads) text += "<th>" + html_text(head) + "</th>";
  text += "</tr>";
  for (std::size_t k = 0; k < comparison.runs.size(); ++k) {
    const Evaluation& e = comparison.runs[k].evaluation;
    text += "<tr><td><i style=\"background:var(--c" + std::to_string(k % kRunColors) + ")\"></i>" + html_text(comparison.runs[k].name) + "</td>";
    for (const std::string& value : {cell(e.horizontal.rmse_m, 3), cell(e.horizontal.p95_m, 3), cell(e.horizontal.max_m, 3), cell(e.spatial.rmse_m, 3),
                                     cell(e.below_1p5_pct, 2), cell(e.availability_pct, 2), cell(e.fix_rate_pct, 2), std::to_string(e.wrong_fixes),
                                     cell(e.fixed_horizontal.rmse_m, 4), cell(e.mean_nees, 2)})
      text += "<td>" + value + "</td>";
    text += "</tr>";
  }
  return text + "</table></div>";
}

}  // namespace detail

/// The whole page.
[[nodiscard]] inline std::string compare_html(const Comparison& comparison) {
  const std::string title = html_text(comparison.title);
  std::string text =
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width, "
      "initial-scale=1\">\n<title>" +
      title + "</title>\n<style>" + kReportStyle +
      "</style>\n</head>\n<body>\n<main>\n<header><div class=\"over\">searvins comparison</div><h1>" + title + "</h1>";
  if (!comparison.command.empty()) text += "<p class=\"command\"><code>" + html_text(comparison.command) + "</code></p>";
  text += "</header>\n<section class=\"card\"><div class=\"head\"><h2>Figures</h2></div>" + detail::compare_table(comparison) + "</section>\n";
  if (!comparison.table.empty()) text += paper_table_html(comparison.table);
  text += "<section class=\"three\" id=\"three\"></section>\n";
  text +=
      "<section class=\"card\"><div class=\"head\"><h2>Over time</h2><span class=\"note\">GPS time of day; drag to zoom, double click to see it "
      "all</span></div><div id=\"time\"></div></section>\n";
  text +=
      "<section class=\"card mapcard\"><div class=\"head\"><h2>Tracks</h2><span class=\"buttons\" id=\"mapbuttons\"><button data-do=\"in\" "
      "aria-label=\"zoom in\">+</button><button data-do=\"out\" aria-label=\"zoom out\">&minus;</button><button "
      "data-do=\"all\">all</button></span><span id=\"maplegend\" style=\"margin-left:auto\"></span></div><div class=\"grow\" id=\"maphost\" "
      "role=\"img\" aria-label=\"map of the tracks\"></div></section>\n";
  std::vector<IntegrityEntry> entries;
  for (const ComparedRun& run : comparison.runs) entries.push_back({run.name, run.evaluation, run.integrity, run.wrong_fixes});
  text += integrity_html(entries);
  text += std::string{"<footer>searvins "} + kVersionString +
          "</footer>\n</main>\n<div id=\"tip\" role=\"status\"></div>\n<noscript><p style=\"padding:24px\">The charts need JavaScript; the "
          "figures above do not.</p></noscript>\n";
  return text + "<script type=\"application/json\" id=\"run-data\">" + detail::compare_json(comparison) + "</script>\n<script>(() => {" +
         kReportScales + kReportCharts + kReportMap + detail::kCompareMap + kReportDistributions + kReportStanford + detail::kComparePage +
         "})();</script>\n</body>\n</html>\n";
}

}  // namespace searvins::examples
