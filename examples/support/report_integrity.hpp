// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// What the pages show about integrity: tables of bounds, shares and stretches, the wrong fixes, and the Stanford diagram.
///
/// The diagram's axes are both logarithmic and have the same range, so that e = B stays the diagonal and an error of a centimetre is as
/// visible as one of ten metres. Points beyond the range lie on its edge. How many epochs share a spot is told by the strength of its
/// colour.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include <searvins/io/text_fields.hpp>

#include "examples/support/html_text.hpp"
#include "examples/support/integrity.hpp"
#include "examples/support/json_writer.hpp"
#include "examples/support/table.hpp"
#include "examples/support/wrong_fixes.hpp"

namespace searvins::examples {

inline constexpr std::size_t kMaxReportWrongFixes = 100;  ///< lines of the list of wrong fixes on a page, for each run

inline constexpr const char* kReportStanford = R"js(
/* Stanford diagram: horizontal error to the right, its bound upwards. errors and bounds are parallel; color() is that of the points. */
const AREAS = ['nominal', 'unavailable', 'misleading', 'misleading, unavailable', 'hazardous'];
class StanfordView extends Layers {
  constructor(host, errors, bounds, range, color) {
    super(host, 318);
    this.color = color;
    [this.lo, this.hi] = range;
    this.limit = D.integrity.limit;
    this.points = [];
    this.counts = [0, 0, 0, 0, 0];
    for (let i = 0; i < errors.length; ++i)
      if (ok(errors[i]) && ok(bounds[i])) {
        this.points.push([errors[i], bounds[i]]);
        ++this.counts[this.area(errors[i], bounds[i])];
      }
    this.front.addEventListener('pointermove', e => {
      const r = this.box.getBoundingClientRect(), x = e.clientX - r.left, y = e.clientY - r.top;
      if (x < 52 || x > this.w - 12 || y < 10 || y > this.h - 36) return this.leave();
      const error = this.lo * Math.pow(this.hi / this.lo, (x - 52) / (this.w - 64)),
            bound = this.lo * Math.pow(this.hi / this.lo, (this.h - 36 - y) / (this.h - 46)), a = this.area(error, bound);
      showTip(e, AREAS[a], [
        ['epochs in this area', this.counts[a] + ' of ' + this.points.length], ['error here', metres(error)], ['bound here', metres(bound)]
      ]);
    });
    this.front.addEventListener('pointerleave', () => this.leave());
  }
  leave() { hideTip(); }
  area(e, b) { return b > this.limit ? (e > b ? 3 : 1) : e > this.limit ? 4 : e > b ? 2 : 0; }
  x(v) { return 52 + Math.log(Math.max(this.lo, Math.min(this.hi, v)) / this.lo) / Math.log(this.hi / this.lo) * (this.w - 64); }
  y(v) { return this.h - 36 - Math.log(Math.max(this.lo, Math.min(this.hi, v)) / this.lo) / Math.log(this.hi / this.lo) * (this.h - 46); }
  shape(color, alpha, corners) {
    const g = this.g;
    g.globalAlpha = alpha;
    g.fillStyle = color;
    g.beginPath();
    corners.forEach(([e, b], k) => k ? g.lineTo(this.x(e), this.y(b)) : g.moveTo(this.x(e), this.y(b)));
    g.closePath();
    g.fill();
    g.globalAlpha = 1;
  }
  /* Name and share of an area, inside it. */
  label(area, e, b, align, name) {
    const g = this.g, n = this.counts[area], share = n / Math.max(1, this.points.length);
    const percent = (100 * share).toFixed(share < 0.1 ? 2 : 1) + ' %',
          text = (name || AREAS[area]) + ' ' + (n === 0 ? '0' : share < 0.001 ? n + ' ep.' : percent);
    g.textAlign = align;
    g.textBaseline = 'middle';
    g.font = '600 11px system-ui, -apple-system, "Segoe UI", Roboto, Arial, sans-serif';
    g.lineWidth = 3;
    g.strokeStyle = C.card;
    g.strokeText(text, e, b);
    g.fillStyle = area === 4 && n ? C.status[3] : C.ink;
    g.fillText(text, e, b);
  }
  draw() {
    const g = this.g = this.prepare(this.back), lo = this.lo, hi = this.hi, a = this.limit;
    if (this.w < 100) return;
    const x0 = this.x(lo), x1 = this.x(hi), y0 = this.y(lo), y1 = this.y(hi), xa = this.x(a), ya = this.y(a);
    if (a < hi) {
      this.shape(C.muted, 0.13, [[lo, a], [a, a], [hi, hi], [lo, hi]]);
      this.shape(C.status[1], 0.1, [[a, a], [hi, a], [hi, hi]]);
      this.shape(C.status[3], 0.17, [[a, lo], [hi, lo], [hi, a], [a, a]]);
    }
    this.shape(C.status[1], 0.16, [[lo, lo], [Math.min(a, hi), lo], [Math.min(a, hi), Math.min(a, hi)]]);
    g.lineWidth = 1;
    g.font = '11px system-ui, -apple-system, "Segoe UI", Roboto, Arial, sans-serif';
    for (let d = lo; d < hi * 1.01; d *= 10) {
      const x = Math.round(this.x(d)) + 0.5, y = Math.round(this.y(d)) + 0.5;
      g.strokeStyle = C.grid;
      g.beginPath();
      g.moveTo(x, y0);
      g.lineTo(x, y1);
      g.moveTo(x0, y);
      g.lineTo(x1, y);
      g.stroke();
      g.fillStyle = C.muted;
      g.textAlign = d < hi * 0.99 ? 'center' : 'right';
      g.textBaseline = 'alphabetic';
      g.fillText(axisMetres(d), d < hi * 0.99 ? x : x + 6, this.h - 21);
      g.textAlign = 'right';
      g.textBaseline = 'middle';
      g.fillText(axisMetres(d), x0 - 6, y);
    }
    g.textAlign = 'center';
    g.textBaseline = 'alphabetic';
    g.fillText('horizontal error; upwards: its bound', (x0 + x1) / 2, this.h - 5);
    /* Points: spots of 3 pixels, the more epochs the stronger. */
    const spots = new Map();
    for (const [e, b] of this.points) {
      const key = Math.floor(this.x(e) / 3) * 4096 + Math.floor(this.y(b) / 3);
      spots.set(key, (spots.get(key) || 0) + 1);
    }
    const peak = Math.max(1, ...spots.values());
    g.fillStyle = this.color();
    for (const [key, n] of spots) {
      g.globalAlpha = 0.35 + 0.65 * Math.log(1 + n) / Math.log(1 + peak);
      g.fillRect(Math.floor(key / 4096) * 3, key % 4096 * 3, 3, 3);
    }
    g.globalAlpha = 1;
    g.strokeStyle = C.ink;
    g.beginPath();
    g.moveTo(x0, y0);
    g.lineTo(x1, y1);
    g.stroke();
    if (a < hi) {
      g.setLineDash([4, 3]);
      g.strokeStyle = C.status[3];
      g.beginPath();
      g.moveTo(xa + 0.5, y0);
      g.lineTo(xa + 0.5, y1);
      g.moveTo(x0, ya + 0.5);
      g.lineTo(x1, ya + 0.5);
      g.stroke();
      g.setLineDash([]);
    }
    this.label(0, x0 + 6, Math.min(ya + 13, y0 - 8), 'left');
    this.label(2, Math.min(xa, x1) - 6, y0 - 10, 'right');
    if (a < hi) {
      this.label(1, x0 + 6, y1 + 9, 'left');
      this.label(3, x1 - 5, ya - 10, 'right', 'misl.');
      this.label(4, x1 - 5, y0 - 26, 'right');
    }
  }
}
/* One range for all diagrams of a page: whole decades that hold errors, bounds and the alert limit. */
function stanfordRange(lists) {
  const all = sorted([].concat(...lists)).filter(v => v > 0);
  if (!all.length) return [0.01, 10];
  const lo = Math.max(1e-3, Math.min(quantile(all, 0.02), D.integrity.limit / 10)), hi = Math.max(quantile(all, 1), D.integrity.limit * 3);
  return [Math.pow(10, Math.floor(Math.log10(lo))), Math.pow(10, Math.ceil(Math.log10(hi) - 1e-9))];
}
const stanfordNote = () =>
    'bound: ' + D.integrity.k.toFixed(2) + ' sigma, risk ' + D.integrity.risk_text + '; alert limit ' + metres(D.integrity.limit);
)js";

/// The JSON object that the diagram's script reads.
[[nodiscard]] inline std::string integrity_data(const IntegrityOptions& options) {
  return "{\"risk\":" + json_literal(options.risk) + ",\"risk_text\":" + json_literal(std::string_view{risk_text(options.risk)}) +
         ",\"k\":" + json_literal(horizontal_bound_factor(options.risk)) + ",\"limit\":" + json_literal(options.alert_limit_m) + '}';
}

/// A run of the integrity tables.
struct IntegrityEntry {
  const std::string& name;
  const Evaluation& evaluation;
  const Integrity& integrity;
  const std::vector<WrongFix>& wrong_fixes;
};

namespace detail {

using HtmlCells = std::vector<std::string>;

/// A table of several runs, one a line; cells are HTML.
[[nodiscard]] inline std::string runs_table_html(const HtmlCells& header, const std::vector<HtmlCells>& lines, const char* kind = "") {
  const auto line = [](const HtmlCells& cells, const char* tag) {
    std::string text = "<tr>";
    for (const std::string& c : cells) text += std::string{"<"} + tag + '>' + c + "</" + tag + '>';
    return text + "</tr>";
  };
  std::string text = std::string{"<div class=\"scroll\"><table class=\"runs"} + kind + "\">" + line(header, "th");
  for (const HtmlCells& cells : lines) text += line(cells, "td");
  return text + "</table></div>";
}

/// A share, marked when it is larger than an honest covariance would let it be by more than chance allows (four standard deviations of a
/// binomial, and one epoch).
[[nodiscard]] inline std::string marked_share(const Exceedance& e) {
  const double n = static_cast<double>(e.epochs), p = e.expected_pct / 100, most = n * p + 4 * std::sqrt(n * p * (1 - p)) + 1;
  const std::string text = html_text(cell(e.share_pct(), 2));
  return static_cast<double>(e.over) > most ? "<b class=\"over-share\">" + text + "</b>" : text;
}

[[nodiscard]] inline std::string stretch_html(const std::vector<Stretch>& stretches) {
  if (stretches.empty()) return "none";
  const Stretch s = longest_of(stretches);
  std::string text = io::fixed_text(s.length_s, s.length_s < 10 ? 1 : 0) + " s from sow " + io::fixed_text(s.from.sow(), 1);
  if (std::isfinite(s.max_error_m)) text += ", to " + io::fixed_text(s.max_error_m, 2) + " m";
  if (s.without_error) text += ", " + std::to_string(s.without_error) + " without estimate";
  return text;
}

[[nodiscard]] inline std::string wrong_fixes_html(const IntegrityEntry& run) {
  if (run.wrong_fixes.empty()) return {};
  std::vector<HtmlCells> lines;
  const auto count = [](int n) { return n < 0 ? std::string{"&ndash;"} : std::to_string(n); };
  for (std::size_t k = 0; k < std::min(kMaxReportWrongFixes, run.wrong_fixes.size()); ++k) {
    const WrongFix& f = run.wrong_fixes[k];
    lines.push_back({io::fixed_text(f.time.sow(), 1), std::to_string(f.event + 1), cell(f.horizontal_m, 2),
                     cell(f.error_enu_m.x(), 2) + ", " + cell(f.error_enu_m.y(), 2) + ", " + cell(f.error_enu_m.z(), 2), cell(f.sigma_m, 3),
                     count(f.n_sat), count(f.n_dd), cell(f.success_rate, 4), cell(f.ratio, 1), name_of(f.cause),
                     html_text(explanation_of(f))});
  }
  std::string text = "<details" + std::string{run.wrong_fixes.size() <= 20 ? " open" : ""} + "><summary>" + html_text(run.name) + ": " +
                     std::to_string(run.wrong_fixes.size()) + ", events: " + std::to_string(events_of(run.wrong_fixes));
  if (run.wrong_fixes.size() > kMaxReportWrongFixes) text += ", the first " + std::to_string(kMaxReportWrongFixes);
  return text + "</summary>" +
         runs_table_html({"sow", "event", "error m", "east, north, up", "sigma m", "satellites", "differences", "success rate", "ratio",
                          "cause", "what goes with it"},
                         lines, " list") +
         "</details>";
}

}  // namespace detail

/// The section "Integrity": tables, and (if wanted, and where any run has covariances) an element `stanford` that the page's script fills
/// with diagrams. At least one run, all with the same options.
[[nodiscard]] inline std::string integrity_html(const std::vector<IntegrityEntry>& runs, bool with_diagrams = true) {
  const Integrity& first = runs.front().integrity;
  std::vector<detail::HtmlCells> consistency, bounds, ladder, stretches;
  detail::HtmlCells ladder_header{"risk per epoch"}, ladder_expected{"at most"};
  for (const double risk : kRiskLadder) ladder_header.push_back(risk_text(risk)), ladder_expected.push_back(risk_text(100 * risk));
  ladder.push_back(ladder_expected);
  bool any_wrong = false;
  for (const IntegrityEntry& run : runs) {
    const Integrity& i = run.integrity;
    const std::string name = html_text(run.name);
    const auto area = [&i](StanfordArea a) { return i.count(a); };
    const auto share = [&i](std::size_t n) { return cell(detail::share_pct(n, i.with_bound), 2); };
    consistency.push_back({name, detail::marked_share(i.east_3sigma), detail::marked_share(i.north_3sigma),
                           detail::marked_share(i.up_3sigma), detail::marked_share(i.horizontal_3sigma),
                           detail::marked_share(i.spatial_3sigma), cell(i.mean_nees_horizontal, 2), cell(run.evaluation.mean_nees, 2),
                           "&times; " + cell(i.sigma_scale, 2)});
    bounds.push_back({name, cell(i.stated.median_horizontal_m, 3), cell(i.stated.p95_horizontal_m, 3),
                      detail::marked_share(i.stated.horizontal), cell(i.stated.largest_ratio, 2), cell(i.stated.median_vertical_m, 3),
                      detail::marked_share(i.stated.vertical), share(area(StanfordArea::nominal)), share(area(StanfordArea::unavailable)),
                      share(area(StanfordArea::misleading) + area(StanfordArea::misleading_unavailable)),
                      share(area(StanfordArea::hazardous))});
    detail::HtmlCells line{name};
    for (const BoundCheck& check : i.ladder) line.push_back(detail::marked_share(check.horizontal));
    ladder.push_back(line);
    stretches.push_back({name, detail::stretch_html(i.above_1p0), detail::stretch_html(i.above_1p5), detail::stretch_html(i.beyond_bound)});
    any_wrong = any_wrong || !run.wrong_fixes.empty();
  }
  std::string text =
      "<section class=\"card integrity\"><div class=\"head\"><h2>Integrity</h2><span class=\"note\">how far the reported covariance may be "
      "trusted; marked: more than chance explains</span></div><h3>Errors beyond 3 sigma, % of epochs (0.27 belong there), and NEES</h3>" +
      detail::runs_table_html({"run", "east", "north", "up", "horizontal", "3-D", "NEES H (2)", "NEES 3-D (3)", "fitting sigma"},
                              consistency) +
      "<h3>Bounds at a risk of " + risk_text(first.options.risk) + " an epoch: " + io::fixed_text(first.stated.k_horizontal, 2) +
      " sigma horizontally, " + io::fixed_text(first.stated.k_vertical, 2) + " vertically; alert limit " +
      io::fixed_text(first.options.alert_limit_m, 2) + " m</h3>" +
      detail::runs_table_html({"run", "H bound P50 m", "P95 m", "error beyond %", "largest ratio", "up bound P50 m", "error beyond %",
                               "nominal %", "unavailable %", "misleading %", "hazardous %"},
                              bounds) +
      "<h3>Horizontal error beyond its bound, % of epochs</h3>" + detail::runs_table_html(ladder_header, ladder) +
      "<h3>The longest stretches</h3>" +
      detail::runs_table_html({"run", "1.0 m or more", "1.5 m or more", "error beyond bound"}, stretches) + "</section>\n";
  if (with_diagrams && std::any_of(runs.begin(), runs.end(), [](const IntegrityEntry& r) { return r.integrity.with_bound > 0; }))
    text += "<section class=\"three\" id=\"stanford\"></section>\n";
  if (!any_wrong) return text;
  text +=
      "<section class=\"card\"><div class=\"head\"><h2>Wrong fixes</h2><span class=\"note\">horizontal error of 0.5 m or more; cause as "
      "far as "
      "the rows tell it</span></div>";
  for (const IntegrityEntry& run : runs) text += detail::wrong_fixes_html(run);
  return text + "</section>\n";
}

}  // namespace searvins::examples
