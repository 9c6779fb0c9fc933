// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// A run scored in every respect: accuracy, integrity, wrong fixes; as tables for a terminal and as JSON.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <searvins/io/text_fields.hpp>
#include <searvins/io/trajectory.hpp>
#include <searvins/version.hpp>

#include "examples/support/evaluation.hpp"
#include "examples/support/integrity.hpp"
#include "examples/support/json_writer.hpp"
#include "examples/support/run_details.hpp"
#include "examples/support/table.hpp"
#include "examples/support/wrong_fixes.hpp"

namespace searvins::examples {

/// A scored run with everything that is said about it.
struct AssessedRun {
  std::string name;
  SensorConfiguration sensors{};
  std::vector<io::TrajectoryRow> rows{};  ///< those that were scored
  Evaluation evaluation{};
  Integrity integrity{};
  std::vector<WrongFix> wrong_fixes{};
};

/// Assesses a scored run. `ratios`: as many as rows, or none.
[[nodiscard]] inline AssessedRun assess(std::string name, std::vector<io::TrajectoryRow> rows, Evaluation evaluation,
                                        const IntegrityOptions& options = {}, const std::vector<double>& ratios = {}) {
  AssessedRun run;
  run.name = std::move(name), run.rows = std::move(rows), run.evaluation = std::move(evaluation);
  run.integrity = assess_integrity(run.evaluation, run.rows, options);
  run.wrong_fixes = wrong_fixes_of(run.evaluation, run.rows, ratios);
  return run;
}

namespace detail {

[[nodiscard]] inline std::string share_of_epochs(std::size_t part, std::size_t whole) { return cell(share_pct(part, whole), 2); }

/// "  12 s from sow 553990.000, up to 2.31 m", or "none".
[[nodiscard]] inline std::string stretch_text(const std::vector<Stretch>& stretches) {
  if (stretches.empty()) return "none";
  const Stretch s = longest_of(stretches);
  std::string text = io::fixed_text(s.length_s, s.length_s < 10 ? 1 : 0) + " s from sow " + io::fixed_text(s.from.sow(), 3);
  if (std::isfinite(s.max_error_m)) text += ", up to " + io::fixed_text(s.max_error_m, 2) + " m";
  if (s.without_error) text += ", " + std::to_string(s.without_error) + " without estimate";
  return text;
}

}  // namespace detail

/// How many epochs there are and what their status is.
[[nodiscard]] inline std::string epochs_table(const std::vector<AssessedRun>& runs) {
  Table table{{"run", "epochs", "fix", "float", "dgnss", "spp", "dr", "none"}};
  for (const AssessedRun& run : runs) {
    const Evaluation& e = run.evaluation;
    std::vector<std::string> cells{run.name, std::to_string(e.epochs.size())};
    for (const std::size_t count : e.by_status) cells.push_back(std::to_string(count));
    cells.push_back(std::to_string(e.epochs.size() - e.available));
    table.row(std::move(cells));
  }
  return table.text();
}

/// Shares of errors beyond three sigma, and NEES.
[[nodiscard]] inline std::string consistency_table(const std::vector<AssessedRun>& runs) {
  Table table{{"run", "epochs", "east %", "north %", "up %", "horizontal %", "3-D %", "NEES H (2)", "NEES 3-D (3)", "fitting sigma"}};
  for (const AssessedRun& run : runs) {
    const Integrity& i = run.integrity;
    table.row({run.name, std::to_string(i.with_bound), cell(i.east_3sigma.share_pct(), 2), cell(i.north_3sigma.share_pct(), 2),
               cell(i.up_3sigma.share_pct(), 2), cell(i.horizontal_3sigma.share_pct(), 2), cell(i.spatial_3sigma.share_pct(), 2),
               cell(i.mean_nees_horizontal, 2), cell(run.evaluation.mean_nees, 2), "x " + cell(i.sigma_scale, 2)});
  }
  return table.text();
}

/// Bounds at the stated risk: how large, how often exceeded, and the areas of the Stanford diagram.
[[nodiscard]] inline std::string bound_table(const std::vector<AssessedRun>& runs) {
  Table table{{"run", "H bound P50 m", "P95 m", "beyond %", "largest ratio", "up bound P50 m", "beyond %", "nominal %", "unavailable %",
               "misleading %", "hazardous %"}};
  for (const AssessedRun& run : runs) {
    const Integrity& i = run.integrity;
    const BoundCheck& b = i.stated;
    table.row({run.name, cell(b.median_horizontal_m, 3), cell(b.p95_horizontal_m, 3), cell(b.horizontal.share_pct(), 2),
               cell(b.largest_ratio, 2), cell(b.median_vertical_m, 3), cell(b.vertical.share_pct(), 2),
               detail::share_of_epochs(i.count(StanfordArea::nominal), i.with_bound),
               detail::share_of_epochs(i.count(StanfordArea::unavailable), i.with_bound),
               detail::share_of_epochs(i.count(StanfordArea::misleading) + i.count(StanfordArea::misleading_unavailable), i.with_bound),
               detail::share_of_epochs(i.count(StanfordArea::hazardous), i.with_bound)});
  }
  return table.text();
}

/// Share of epochs beyond the horizontal bound, for a ladder of risks.
[[nodiscard]] inline std::string ladder_table(const std::vector<AssessedRun>& runs) {
  std::vector<std::string> header{"H error > bound, % of epochs, at a risk of"};
  for (const double risk : kRiskLadder) header.push_back(risk_text(risk));
  Table table{header};
  std::vector<std::string> expected{"at most, if the covariance is right"};
  for (const double risk : kRiskLadder) expected.push_back(risk_text(100 * risk));
  table.row(expected);
  for (const AssessedRun& run : runs) {
    std::vector<std::string> cells{run.name};
    for (const BoundCheck& check : run.integrity.ladder) cells.push_back(cell(check.horizontal.share_pct(), 2));
    table.row(std::move(cells));
  }
  return table.text();
}

/// The longest stretches above the limits and beyond the bound.
[[nodiscard]] inline std::string stretch_table(const std::vector<AssessedRun>& runs) {
  std::string text;
  for (const AssessedRun& run : runs) {
    const Integrity& i = run.integrity;
    text += run.name + "\n  longest above 1.0 m    " + detail::stretch_text(i.above_1p0) + "\n  longest above 1.5 m    " +
            detail::stretch_text(i.above_1p5) + "\n  longest beyond bound   " + detail::stretch_text(i.beyond_bound) + '\n';
  }
  return text;
}

/// The wrong fixes of one run, at most `limit` lines; empty when there is none.
[[nodiscard]] inline std::string wrong_fix_table(const AssessedRun& run, std::size_t limit = 20) {
  if (run.wrong_fixes.empty()) return {};
  Table table{{"  sow", "H error m", "east", "north", "up", "sigma m", "sat", "dd", "success", "ratio", "cause", "more"}};
  const auto count = [](int n) { return n < 0 ? std::string{"-"} : std::to_string(n); };
  for (std::size_t k = 0; k < std::min(limit, run.wrong_fixes.size()); ++k) {
    const WrongFix& f = run.wrong_fixes[k];
    table.row({"  " + io::fixed_text(f.time.sow(), 3), cell(f.horizontal_m, 2), cell(f.error_enu_m.x(), 2), cell(f.error_enu_m.y(), 2),
               cell(f.error_enu_m.z(), 2), cell(f.sigma_m, 3), count(f.n_sat), count(f.n_dd), cell(f.success_rate, 4), cell(f.ratio, 1),
               name_of(f.cause), explanation_of(f)});
  }
  std::string text = run.name + ": wrong fixes (horizontal error of 0.5 m or more): " + std::to_string(run.wrong_fixes.size()) +
                     ", events: " + std::to_string(events_of(run.wrong_fixes)) + '\n' + table.text();
  if (run.wrong_fixes.size() > limit) text += "  ... and " + std::to_string(run.wrong_fixes.size() - limit) + " more\n";
  return text;
}

/// Everything but the paper's tables, for a terminal. At least one run, all with the same options.
[[nodiscard]] inline std::string assessment_text(const std::vector<AssessedRun>& runs) {
  const IntegrityOptions& options = runs.front().integrity.options;
  std::string text = "Status, epochs\n" + epochs_table(runs) +
                     "\nErrors beyond 3 sigma (0.27 % expected of each), NEES (its expectation), and the factor on sigma that fits\n" +
                     consistency_table(runs) + "\nBounds at a risk of " + risk_text(options.risk) + " an epoch (horizontal " +
                     io::fixed_text(runs.front().integrity.stated.k_horizontal, 2) + ", vertical " +
                     io::fixed_text(runs.front().integrity.stated.k_vertical, 2) + " sigma), alert limit " +
                     io::fixed_text(options.alert_limit_m, 2) + " m\n" + bound_table(runs) + '\n' + ladder_table(runs) + "\nStretches\n" +
                     stretch_table(runs);
  for (const AssessedRun& run : runs) {
    if (const std::size_t without = run.evaluation.available - run.evaluation.with_error)
      text += '\n' + run.name + ": " + std::to_string(without) +
              " estimates lie at times that the truth does not cover; they count as failures\n";
    if (!run.wrong_fixes.empty()) text += '\n' + wrong_fix_table(run);
  }
  return text;
}

namespace detail {

inline void member_errors(JsonWriter& json, const char* key, const ErrorFigures& f) {
  json.begin_object(key).member("rmse", f.rmse_m).member("p50", f.p50_m).member("p95", f.p95_m).member("max", f.max_m).end_object();
}

inline void member_exceedance(JsonWriter& json, const char* key, const Exceedance& e) {
  json.begin_object(key).member("epochs", e.epochs).member("over", e.over).member("share_pct", e.share_pct());
  json.member("expected_pct", e.expected_pct).end_object();
}

inline void member_bound(JsonWriter& json, std::string_view key, const BoundCheck& b) {
  json.begin_object(key).member("risk", b.risk).member("k_horizontal", b.k_horizontal).member("k_vertical", b.k_vertical);
  json.member("median_horizontal_m", b.median_horizontal_m).member("p95_horizontal_m", b.p95_horizontal_m);
  json.member("median_vertical_m", b.median_vertical_m).member("largest_error_over_bound", b.largest_ratio);
  json.member("largest_sow", b.horizontal.epochs ? b.largest_ratio_time.sow() : io::kUnknown);
  member_exceedance(json, "horizontal", b.horizontal), member_exceedance(json, "vertical", b.vertical);
  json.end_object();
}

inline void member_stretches(JsonWriter& json, const char* key, const std::vector<Stretch>& stretches) {
  std::size_t epochs = 0;
  for (const Stretch& s : stretches) epochs += s.epochs;
  json.begin_object(key).member("stretches", stretches.size()).member("epochs", epochs);
  if (!stretches.empty()) {
    const Stretch s = longest_of(stretches);
    json.begin_object("longest").member("from_sow", s.from.sow()).member("to_sow", s.to.sow()).member("length_s", s.length_s);
    json.member("epochs", s.epochs).member("without_error", s.without_error).member("max_error_m", s.max_error_m).end_object();
  }
  json.end_object();
}

}  // namespace detail

/// Adds the member "errors_m": the figures of the paper's tables and the NEES, as in a run's summary.json.
inline void member_errors(JsonWriter& json, const Evaluation& e) {
  json.begin_object("errors_m").member("epochs", e.epochs.size()).member("availability_pct", e.availability_pct);
  json.member("below_1p0_pct", e.below_1p0_pct).member("below_1p5_pct", e.below_1p5_pct);
  detail::member_errors(json, "horizontal", e.horizontal), detail::member_errors(json, "spatial", e.spatial);
  detail::member_errors(json, "vertical", e.vertical);
  json.member("fixed", e.fixed).member("correct_fixes", e.fixed - e.wrong_fixes).member("wrong_fixes", e.wrong_fixes);
  json.member("fix_rate_pct", e.fix_rate_pct).member("fixed_below_0p5_pct", e.fixed_below_0p5_pct);
  detail::member_errors(json, "fixed_horizontal", e.fixed_horizontal);
  json.member("mean_nees", e.mean_nees).member("nees_within_95_pct", e.nees_within_95_pct).end_object();
}

/// Adds the member "integrity".
inline void member_integrity(JsonWriter& json, const Integrity& i) {
  json.begin_object("integrity").member("alert_limit_m", i.options.alert_limit_m).member("epochs", i.with_bound);
  json.member("mean_nees_horizontal", i.mean_nees_horizontal).member("sigma_scale", i.sigma_scale);
  json.begin_object("beyond_3_sigma");
  detail::member_exceedance(json, "east", i.east_3sigma), detail::member_exceedance(json, "north", i.north_3sigma);
  detail::member_exceedance(json, "up", i.up_3sigma), detail::member_exceedance(json, "horizontal", i.horizontal_3sigma);
  detail::member_exceedance(json, "spatial", i.spatial_3sigma);
  json.end_object();
  detail::member_bound(json, "bound", i.stated);
  json.begin_object("stanford");
  for (std::size_t a = 0; a < kStanfordAreas; ++a) json.member(name_of(static_cast<StanfordArea>(a)), i.areas[a]);
  json.end_object().begin_array("bounds_by_risk");
  for (const BoundCheck& check : i.ladder) detail::member_bound(json, {}, check);
  json.end_array();
  detail::member_stretches(json, "above_1p0_m", i.above_1p0), detail::member_stretches(json, "above_1p5_m", i.above_1p5);
  detail::member_stretches(json, "beyond_bound", i.beyond_bound);
  json.end_object();
}

/// Adds the member "wrong_fixes": all of them, and how many of each cause.
inline void member_wrong_fixes(JsonWriter& json, const std::vector<WrongFix>& fixes) {
  json.begin_object("wrong_fixes").member("number", fixes.size()).member("events", events_of(fixes)).begin_object("causes");
  const std::array<std::size_t, kWrongFixCauses> causes = causes_of(fixes);
  for (std::size_t c = 0; c < kWrongFixCauses; ++c) json.member(name_of(static_cast<WrongFixCause>(c)), causes[c]);
  json.end_object().begin_array("list");
  const auto count = [](int n) { return n < 0 ? io::kUnknown : static_cast<double>(n); };
  for (const WrongFix& f : fixes) {
    json.begin_object()
        .member("week", f.time.week())
        .member("sow", f.time.sow())
        .member("event", f.event)
        .member("horizontal_m", f.horizontal_m);
    json.begin_array("error_enu_m").value(f.error_enu_m.x()).value(f.error_enu_m.y()).value(f.error_enu_m.z()).end_array();
    json.member("sigma_m", f.sigma_m).member("n_sat", count(f.n_sat)).member("n_dd", count(f.n_dd));
    json.member("success_rate", f.success_rate).member("ratio", f.ratio).member("cause", name_of(f.cause));
    json.member("error_before_m", f.before_m).member("step_m", f.step_m).member("within_3_sigma", f.is_admitted);
    json.member("explanation", explanation_of(f)).end_object();
  }
  json.end_array().end_object();
}

/// Adds "integrity" and "wrong_fixes" of a scored run with the default risk and limit. `ratios`: as many as rows, or none.
inline void member_assessment(JsonWriter& json, const Evaluation& evaluation, const std::vector<io::TrajectoryRow>& rows,
                              const std::vector<double>& ratios = {}) {
  member_integrity(json, assess_integrity(evaluation, rows));
  member_wrong_fixes(json, wrong_fixes_of(evaluation, rows, ratios));
}

/// What `searvins evaluate --json` writes.
[[nodiscard]] inline std::string assessment_json(const std::vector<AssessedRun>& runs, std::string_view command) {
  JsonWriter json;
  json.begin_object()
      .member("schema", 1)
      .member("program", std::string{"searvins "} + kVersionString)
      .member("command", command)
      .begin_array("runs");
  for (const AssessedRun& run : runs) {
    json.begin_object().member("name", run.name);
    if (run.sensors.is_known) {
      json.begin_object("sensors").member("gnss", run.sensors.gnss).member("vision", run.sensors.vision);
      json.member("imu", run.sensors.has_imu).end_object();
    }
    json.member("step_s", run.evaluation.step_s).begin_object("status");
    for (std::size_t s = 0; s < io::kSolutionStatuses; ++s)
      json.member(io::name_of(static_cast<io::SolutionStatus>(s)), run.evaluation.by_status[s]);
    json.end_object();
    member_errors(json, run.evaluation), member_integrity(json, run.integrity), member_wrong_fixes(json, run.wrong_fixes);
    json.end_object();
  }
  return json.end_array().end_object().text();
}

}  // namespace searvins::examples
