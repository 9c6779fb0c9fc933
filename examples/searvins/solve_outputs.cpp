// SPDX-License-Identifier: BSD-3-Clause
// What a run leaves behind: the table in the terminal and the files in the folder.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <string>
#include <system_error>
#include <vector>

#include <searvins/geodesy/local_frame.hpp>
#include <searvins/io/rtklib_solution.hpp>
#include <searvins/io/text_fields.hpp>
#include <searvins/io/trajectory_export.hpp>
#include <searvins/version.hpp>

#include "examples/searvins/solve_job.hpp"
#include "examples/support/angle_units.hpp"
#include "examples/support/assessment.hpp"
#include "examples/support/evaluation_tables.hpp"
#include "examples/support/json_writer.hpp"
#include "examples/support/report.hpp"
#include "examples/support/table.hpp"

namespace searvins::examples {
namespace {


std::string percent(std::size_t part, long whole) {
  return whole > 0 ? io::fixed_text(100.0 * static_cast<double>(part) / static_cast<double>(whole), 2) + " %" : "-";
}

std::vector<double> finite(const std::vector<double>& values) {
  std::vector<double> out;
  std::copy_if(values.begin(), values.end(), std::back_inserter(out), [](double v) { return std::isfinite(v); });
  return out;
}

std::vector<double> solve_times(const SolveOutcome& outcome) {
  std::vector<double> ms;
  for (const io::TrajectoryRow& row : outcome.rows) ms.push_back(row.solve_ms);
  return finite(ms);
}

std::string three(const std::vector<double>& values, int decimals, const char* unit) {
  if (values.empty()) return "-";
  return cell(percentile(values, 0.5), decimals) + " / " + cell(percentile(values, 0.95), decimals) + " / " +
         cell(percentile(values, 1), decimals) + ' ' + unit;
}

std::string position_text(const Eigen::Vector3d& p) {
  return io::fixed_text(p.x(), 4) + ", " + io::fixed_text(p.y(), 4) + ", " + io::fixed_text(p.z(), 4);
}

/// Rejected signals over the run, by reason, most frequent first.
std::vector<Count> rejections(const SolveOutcome& outcome) {
  std::vector<Count> counts;
  for (std::size_t r = 0; r < outcome.rejection_reasons.size(); ++r)
    for (const ReportEpoch& e : outcome.epochs)
      if (e.rejected[r] > 0) add_count(counts, outcome.rejection_reasons[r], e.rejected[r]);
  std::stable_sort(counts.begin(), counts.end(), [](const Count& a, const Count& b) { return a.second > b.second; });
  return counts;
}

/// Outcomes of the integer resolution over the run, "fixed" first.
std::vector<Count> outcomes(const SolveOutcome& outcome) {
  std::vector<Count> counts;
  for (std::size_t v = 0; v < outcome.fix_outcomes.size(); ++v) {
    const auto n = std::count_if(outcome.epochs.begin(), outcome.epochs.end(),
                                 [v](const ReportEpoch& e) { return e.fix_outcome == static_cast<int>(v); });
    if (n > 0) counts.emplace_back(outcome.fix_outcomes[v], n);
  }
  return counts;
}

/// Distance from the base at the first solution, kilometres.
double baseline_km(const SolveInputs& in, const SolveOutcome& outcome) {
  return in.base && !outcome.rows.empty() ? (outcome.rows.front().p_e_m - in.base_position_e_m).norm() / 1000 : io::kUnknown;
}

std::size_t status_count(const SolveOutcome& outcome, io::SolutionStatus status) {
  return static_cast<std::size_t>(
      std::count_if(outcome.rows.begin(), outcome.rows.end(), [status](const io::TrajectoryRow& r) { return r.status == status; }));
}

/// The file that the epochs come from.
const std::string& measurement_file(const SolveRequest& request) { return request.positions.empty() ? request.rover : request.positions; }

std::string formulation_text(const SolveRequest& request, const SolveInputs& in) {
  if (!in.positions.empty()) return "none: positions of another program";
  if (in.base) return request.formulation;
  return in.inertial ? request.formulation + ", rover alone (no base)" : "single point (no base)";
}

std::string mode_text(const SolveRequest& request) {
  switch (request.options.resolution.mode) {
    case ambiguity::ResolutionMode::full: return "full";
    case ambiguity::ResolutionMode::partial: return "partial";
    case ambiguity::ResolutionMode::off: return "float";
  }
  return {};
}

std::string continuity_text(const SolveRequest& request) {
  switch (request.options.continuity) {
    case ambiguity::ContinuityMode::constant: return "constant";
    case ambiguity::ContinuityMode::instantaneous: return "instantaneous";
    case ambiguity::ContinuityMode::hybrid: return "hybrid, " + std::to_string(request.options.arc_epochs) + " epochs";
  }
  return {};
}

/// The last row's diagnostics with biases; nullptr when there is none.
const ReportEpoch* last_aligned(const SolveOutcome& outcome) {
  const auto at = std::find_if(outcome.epochs.rbegin(), outcome.epochs.rend(), [](const ReportEpoch& e) { return e.accel_bias_mps2.allFinite(); });
  return at == outcome.epochs.rend() ? nullptr : &*at;
}

std::string vector_text(const Eigen::Vector3d& v, int decimals) {
  return io::fixed_text(v.x(), decimals) + ", " + io::fixed_text(v.y(), decimals) + ", " + io::fixed_text(v.z(), decimals);
}

/// Rows with an attitude.
std::size_t aligned_rows(const SolveOutcome& outcome) {
  return static_cast<std::size_t>(
      std::count_if(outcome.rows.begin(), outcome.rows.end(), [](const io::TrajectoryRow& r) { return std::isfinite(r.heading_deg); }));
}

/// Sigmas of a correction's axes.
Eigen::Vector4d sigmas_of(const vision::CameraCorrectionEstimate& found) { return found.covariance.diagonal().cwiseMax(0).cwiseSqrt(); }

void append_camera_correction(const vision::CameraCorrectionEstimate& found, std::vector<ReportEntry>& lines) {
  const Eigen::Vector4d sigma = sigmas_of(found);
  lines.emplace_back("camera time offset", io::fixed_text(1e3 * found.value.time_offset_s, 2) + " +- " + io::fixed_text(1e3 * sigma[0], 2) + " ms");
  lines.emplace_back("camera boresight (right, down, forward)",
                     vector_text(found.value.boresight_rad() * kDegPerRad, 3) + " +- " + vector_text(sigma.tail<3>() * kDegPerRad, 3) + " deg");
}

void append_stereo_figures(const SolveOutcome& outcome, std::vector<ReportEntry>& lines) {
  const vision::AdmissionCounts& c = outcome.stereo->counts;
  lines.emplace_back("stereo frames", std::to_string(outcome.frames));
  lines.emplace_back("observations admitted", percent(c.of(vision::ObservationFate::admitted), static_cast<long>(c.offered())) + " of " +
                                                  std::to_string(c.offered()));
  lines.emplace_back("landmarks", std::to_string(c.landmarks) + ", " + std::to_string(outcome.stereo->dropped_landmarks) + " dropped as moving");
  if (const auto& found = outcome.stereo->correction) append_camera_correction(*found, lines);
}

/// What became of frames and observations, in the order of the tests.
std::vector<Count> frame_fates(const SolveOutcome& outcome) {
  std::vector<Count> counts;
  for (std::size_t f = 0; outcome.stereo && f < vision::kFrameFates; ++f)
    if (const std::size_t n = outcome.stereo->counts.frames[f]) counts.emplace_back(vision::name_of(static_cast<vision::FrameFate>(f)), static_cast<long>(n));
  return counts;
}
std::vector<Count> observation_fates(const SolveOutcome& outcome) {
  std::vector<Count> counts;
  for (std::size_t f = 0; outcome.stereo && f < vision::kObservationFates; ++f)
    if (const std::size_t n = outcome.stereo->counts.observations[f])
      counts.emplace_back(vision::name_of(static_cast<vision::ObservationFate>(f)), static_cast<long>(n));
  return counts;
}

void append_inertial_figures(const SolveOutcome& outcome, std::vector<ReportEntry>& lines) {
  for (const AlignmentEvent& e : outcome.alignment)
    lines.emplace_back(e.aligned ? "aligned" : "alignment lost",
                       "sow " + io::fixed_text(e.time.sow(), 1) + ", after " + io::fixed_text(e.after_s, 1) + " s");
  lines.emplace_back("rows with attitude", percent(aligned_rows(outcome), static_cast<long>(outcome.rows.size())));
  if (const ReportEpoch* e = last_aligned(outcome)) {
    lines.emplace_back("accelerometer bias", vector_text(e->accel_bias_mps2, 4) + " m/s^2");
    lines.emplace_back("gyroscope bias", vector_text(e->gyro_bias_dps, 4) + " deg/s");
  }
  if (outcome.stereo) append_stereo_figures(outcome, lines);
  if (outcome.outages.empty()) return;
  const auto longest = std::max_element(outcome.outages.begin(), outcome.outages.end(),
                                        [](const Outage& a, const Outage& b) { return a.length_s() < b.length_s(); });
  lines.emplace_back("without GNSS", std::to_string(outcome.outages.size()) + " times, longest " + io::fixed_text(longest->length_s(), 1) + " s");
}

/// The lines of the summary; the report shows those that it does not compute itself.
std::vector<ReportEntry> run_figures(const SolveInputs& in, const SolveOutcome& outcome) {
  std::vector<ReportEntry> lines;
  long skipped = 0;
  for (const Count& c : outcome.skipped) skipped += c.second;
  lines.emplace_back(in.positions.empty() ? "rover epochs" : "positions", std::to_string(outcome.rover_epochs));
  lines.emplace_back("with a solution", percent(static_cast<std::size_t>(outcome.answered_epochs), outcome.rover_epochs));
  if (skipped) lines.emplace_back("skipped", std::to_string(skipped));
  if (in.base) {
    lines.emplace_back("baseline", cell(baseline_km(in, outcome), 2) + " km");
    lines.emplace_back("base age P50 / P95 / max", three(finite(outcome.ages_s), 2, "s"));
    lines.emplace_back("window restarts", std::to_string(outcome.restarts));
    lines.emplace_back("integers taken back", std::to_string(outcome.released_integers));
  }
  if (in.inertial) append_inertial_figures(outcome, lines);
  lines.emplace_back("update P50 / P95 / max", three(solve_times(outcome), 2, "ms"));
  lines.emplace_back("whole run", io::fixed_text(outcome.wall_s, 2) + " s");
  return lines;
}

std::vector<ReportEntry> settings(const SolveRequest& request, const SolveInputs& in) {
  std::vector<ReportEntry> s;
  const auto name = [](const std::string& path) { return std::filesystem::path{path}.filename().string(); };
  s.emplace_back(in.positions.empty() ? "rover" : "positions", name(measurement_file(request)));
  if (in.base)
    s.emplace_back("base", name(request.base)), s.emplace_back("base, ECEF m", position_text(in.base_position_e_m)),
        s.emplace_back("base position from", in.base_position_source);
  std::string navigation;
  for (const std::string& nav : request.nav) (navigation += navigation.empty() ? "" : ", ") += name(nav);
  if (!navigation.empty()) s.emplace_back("navigation", navigation);
  s.emplace_back("robust formulation", formulation_text(request, in));
  if (in.base) {
    s.emplace_back("ambiguities", mode_text(request));
    s.emplace_back("continuity", continuity_text(request));
    s.emplace_back("pivot handover", request.options.handover == estimator::PivotHandover::exact ? "exact" : "restart");
    s.emplace_back("window", io::fixed_text(request.options.lag_s, 1) + " s");
    s.emplace_back("least success rate", io::fixed_text(in.options.resolution.min_success_rate, 2));
    s.emplace_back("least ratio", io::fixed_text(in.options.resolution.min_ratio, 2));
    s.emplace_back("sigma profile", request.sigma_profile);
    s.emplace_back("elevation mask", io::fixed_text(in.options.differencing.screening.elevation_mask_rad * kDegPerRad, 1) + " deg");
    s.emplace_back("least C/N0", io::fixed_text(in.options.differencing.screening.min_cn0_dbhz, 1) + " dB-Hz");
  }
  if (in.inertial) {
    s.emplace_back("inertial unit", name(request.imu));
    s.emplace_back("readings", io::fixed_text(in.imu_interval_s > 0 ? 1 / in.imu_interval_s : 0, 1) + " Hz");
    if (!request.tracks.empty()) s.emplace_back("stereo tracks", name(request.tracks));
    if (request.calibrate_camera) s.emplace_back("camera", "time offset and boresight estimated");
    s.emplace_back("lever arm (right, forward, up)", vector_text(in.inertial->lever_arm_b_m, 3) + " m");
    if (request.heading_deg)
      s.emplace_back("heading given", io::fixed_text(*request.heading_deg, 1) + " +- " + io::fixed_text(request.heading_sigma_deg, 1) + " deg");
  }
  for (const auto& [label, list] : {std::pair{"switched off", &request.without}, std::pair{"switched on", &request.with}}) {
    std::string names;
    for (const std::string& part : *list) (names += names.empty() ? "" : ", ") += part;
    if (!names.empty()) s.emplace_back(label, names);
  }
  std::string wanted;
  for (const gnss::SignalCode& c : in.options.differencing.selection.wanted)
    (wanted += wanted.empty() ? "" : " ") += {gnss::letter_of(c.constellation), c.band, c.attribute};
  if (in.base) s.emplace_back("signals", wanted.empty() ? "best of every common carrier" : wanted);
  return s;
}

/// Notes on what was skipped or happened.
std::vector<std::string> notes(const SolveInputs& in, const SolveOutcome& outcome) {
  std::vector<std::string> lines;
  if (in.inertial && outcome.alignment.empty()) {
    std::string waits;
    for (const Count& c : outcome.alignment_waits) (waits += waits.empty() ? "" : "; ") += c.first + " (" + std::to_string(c.second) + " rows)";
    lines.push_back("the inertial unit was never aligned, so GNSS was solved alone; it waited for " + (waits.empty() ? "readings" : waits));
  }
  for (const Count& c : outcome.skipped) lines.push_back(std::to_string(c.second) + " rover epochs without a solution: " + c.first);
  if (outcome.stereo && outcome.stereo->refused_frames > 0)
    lines.push_back(std::to_string(outcome.stereo->refused_frames) + " stereo frames refused, the last: " + outcome.stereo->refusal);
  for (const Count& c : outcome.incidents) lines.push_back(std::to_string(c.second) + " times " + c.first);
  lines.insert(lines.end(), in.notes.begin(), in.notes.end());
  return lines;
}

std::string title_of(const SolveRequest& request) {
  const std::filesystem::path rover{measurement_file(request)};
  const std::string folder = std::filesystem::absolute(rover).parent_path().filename().string();
  return folder.empty() ? rover.filename().string() : folder;
}

std::string subtitle_of(const SolveRequest& request, const SolveInputs& in, const SolveOutcome& outcome) {
  const CivilTime c = civil_from_gps(in.start);
  char date[48];
  std::snprintf(date, sizeof date, "%04d-%02d-%02d %02d:%02d:%02.0f GPS time", c.year, c.month, c.day, c.hour, c.minute,
                std::floor(c.second));
  std::string text = std::string{date} + ", " + std::to_string(outcome.rover_epochs) + (in.positions.empty() ? " rover epochs" : " positions");
  if (in.interval_s > 0) text += " at " + io::fixed_text(1 / in.interval_s, in.interval_s > 1 ? 3 : 0) + " Hz";
  if (in.base)
    text += std::string{in.inertial ? ", with inertial unit" : ""} + ", base " + cell(baseline_km(in, outcome), 2) + " km away, " + request.formulation + " formulation, " + mode_text(request) +
            " ambiguity resolution";
  else if (in.inertial && in.positions.empty())
    text += ", with inertial unit, no base, " + request.formulation + " formulation";
  return text;
}

RunReport report_of(const SolveRequest& request, const SolveInputs& in, const SolveOutcome& outcome) {
  RunReport report;
  report.title = title_of(request), report.subtitle = subtitle_of(request, in, outcome), report.command = request.command;
  report.rows = outcome.rows, report.epochs = outcome.epochs;
  report.rejection_reasons = outcome.rejection_reasons, report.fix_outcomes = outcome.fix_outcomes;
  if (in.base && request.options.resolution.mode != ambiguity::ResolutionMode::off)
    report.success_rate_gate = in.options.resolution.min_success_rate;
  report.satellites = outcome.satellites, report.truth = in.truth, report.evaluation = outcome.evaluation;
  report.outages = outcome.outages, report.strip = outcome.strip;
  report.figures = run_figures(in, outcome), report.settings = settings(request, in), report.notes = notes(in, outcome);
  return report;
}

void member_counts(JsonWriter& json, const char* key, const std::vector<Count>& counts) {
  json.begin_object(key);
  for (const Count& c : counts) json.member(c.first, c.second);
  json.end_object();
}

void member_errors(JsonWriter& json, const char* key, const ErrorFigures& f) {
  json.begin_object(key).member("rmse", f.rmse_m).member("p50", f.p50_m).member("p95", f.p95_m).member("max", f.max_m).end_object();
}

void member_distribution(JsonWriter& json, const char* key, const std::vector<double>& v) {
  json.begin_object(key)
      .member("median", percentile(v, 0.5))
      .member("p95", percentile(v, 0.95))
      .member("max", percentile(v, 1))
      .end_object();
}

void member_vector(JsonWriter& json, const char* key, const Eigen::Vector3d& v) {
  json.begin_array(key).value(v.x()).value(v.y()).value(v.z()).end_array();
}

void member_inertial(JsonWriter& json, const SolveOutcome& outcome) {
  json.begin_object("inertial").member("rows_with_attitude", aligned_rows(outcome)).member("predicted_rows", outcome.predicted_rows.size());
  json.begin_array("alignment");
  for (const AlignmentEvent& e : outcome.alignment)
    json.begin_object().member("sow", e.time.sow()).member("aligned", e.aligned).member("after_s", e.after_s).end_object();
  json.end_array();
  member_counts(json, "waited_for", outcome.alignment_waits);
  if (const ReportEpoch* e = last_aligned(outcome)) {
    member_vector(json, "accel_bias_mps2", e->accel_bias_mps2);
    member_vector(json, "gyro_bias_dps", e->gyro_bias_dps);
  }
  json.begin_array("outages");
  for (const Outage& o : outcome.outages)
    json.begin_object()
        .member("start_sow", o.from.sow())
        .member("length_s", o.length_s())
        .member("horizontal_error_m", o.horizontal_error_m)
        .member("horizontal_sigma_m", o.sigma_m)
        .end_object();
  json.end_array().end_object();
}

void member_camera_correction(JsonWriter& json, const vision::CameraCorrectionEstimate& found) {
  const Eigen::Vector4d sigma = sigmas_of(found);
  json.begin_object("camera_correction").member("time_offset_s", found.value.time_offset_s).member("time_offset_sigma_s", sigma[0]);
  member_vector(json, "boresight_deg", found.value.boresight_rad() * kDegPerRad);
  member_vector(json, "boresight_sigma_deg", sigma.tail<3>() * kDegPerRad);
  json.end_object();
}

std::string summary_json(const SolveRequest& request, const SolveInputs& in, const SolveOutcome& outcome) {
  JsonWriter json;
  json.begin_object().member("schema", 1).member("program", std::string{"searvins "} + kVersionString).member("command", request.command);
  json.begin_object("settings");
  for (const auto& [label, value] : settings(request, in)) json.member(label, value);
  json.end_object();
  json.member("rover_epochs", outcome.rover_epochs)
      .member("solutions", outcome.rows.size())
      .member("solution_at_end", outcome.solved_at_end);
  json.begin_object("status");
  for (std::size_t s = 0; s < io::kSolutionStatuses; ++s) {
    const auto status = static_cast<io::SolutionStatus>(s);
    json.member(io::name_of(status), status_count(outcome, status));
  }
  json.end_object();
  if (const auto& e = outcome.evaluation) {
    json.begin_object("errors_m").member("epochs", e->epochs.size()).member("availability_pct", e->availability_pct);
    json.member("below_1p0_pct", e->below_1p0_pct).member("below_1p5_pct", e->below_1p5_pct);
    member_errors(json, "horizontal", e->horizontal), member_errors(json, "spatial", e->spatial),
        member_errors(json, "vertical", e->vertical);
    json.member("fixed", e->fixed).member("correct_fixes", e->fixed - e->wrong_fixes).member("wrong_fixes", e->wrong_fixes);
    json.member("fix_rate_pct", e->fix_rate_pct);
    member_errors(json, "fixed_horizontal", e->fixed_horizontal);
    json.member("mean_nees", e->mean_nees).member("nees_within_95_pct", e->nees_within_95_pct).end_object();
    member_assessment(json, *e, outcome.rows, outcome.ratios);
  }
  member_counts(json, "skipped_epochs", outcome.skipped), member_counts(json, "incidents", outcome.incidents);
  member_counts(json, "rejected_signals", rejections(outcome)), member_counts(json, "integer_resolution", outcomes(outcome));
  member_distribution(json, "base_age_s", finite(outcome.ages_s)), member_distribution(json, "solve_ms", solve_times(outcome));
  json.member("restarts", outcome.restarts).member("released_integers", outcome.released_integers).member("wall_s", outcome.wall_s);
  if (in.inertial) member_inertial(json, outcome);
  if (outcome.stereo) {
    json.begin_object("stereo").member("frames", outcome.frames).member("landmarks", outcome.stereo->counts.landmarks);
    json.member("dropped_landmarks", outcome.stereo->dropped_landmarks);
    member_counts(json, "frame_fates", frame_fates(outcome)), member_counts(json, "observation_fates", observation_fates(outcome));
    if (const auto& found = outcome.stereo->correction) member_camera_correction(json, *found);
    json.end_object();
  }
  json.begin_array("notes");
  for (const std::string& note : in.notes) json.value(note);
  return json.end_array().end_object().text();
}

void append_counts(std::string& text, const char* title, const std::vector<Count>& counts) {
  if (counts.empty()) return;
  Table table{{title, "count"}};
  for (const Count& c : counts) table.row({c.first, std::to_string(c.second)});
  text += '\n' + table.text();
}

/// Solutions and the rows between them, in the order of time.
std::vector<io::TrajectoryRow> with_predictions(const SolveOutcome& outcome) {
  std::vector<io::TrajectoryRow> rows;
  rows.reserve(outcome.rows.size() + outcome.predicted_rows.size());
  std::merge(outcome.rows.begin(), outcome.rows.end(), outcome.predicted_rows.begin(), outcome.predicted_rows.end(), std::back_inserter(rows),
             [](const io::TrajectoryRow& a, const io::TrajectoryRow& b) { return a.time < b.time; });
  return rows;
}

}  // namespace

std::string summary_text(const SolveRequest& request, const SolveInputs& in, const SolveOutcome& outcome) {
  Table table{{"figure", "value"}};
  table.row({"formulation", formulation_text(request, in)});
  if (in.base) table.row({"base position from", in.base_position_source});
  for (const auto& [label, value] : run_figures(in, outcome)) table.row({label, value});
  for (std::size_t s = 0; s < io::kSolutionStatuses; ++s) {
    const auto status = static_cast<io::SolutionStatus>(s);
    if (const std::size_t n = status_count(outcome, status))
      table.row({io::name_of(status), std::to_string(n) + "  " + percent(n, static_cast<long>(outcome.rows.size()))});
  }
  if (const auto& e = outcome.evaluation) {
    const auto errors = [](const ErrorFigures& f, int d) {
      return cell(f.rmse_m, d) + " / " + cell(f.p95_m, d) + " / " + cell(f.max_m, d) + " m";
    };
    table.row({"scored epochs", std::to_string(e->epochs.size())});
    table.row({"H RMSE / P95 / max", errors(e->horizontal, 3)});
    table.row({"3-D RMSE / P95 / max", errors(e->spatial, 3)});
    table.row({"H below 1.0 m / 1.5 m", cell(e->below_1p0_pct, 2) + " / " + cell(e->below_1p5_pct, 2) + " %"});
    table.row({"fixed H RMSE / P95 / max", errors(e->fixed_horizontal, 4)});
    table.row({"correct fixes / wrong (>= 0.5 m)", std::to_string(e->fixed - e->wrong_fixes) + " / " + std::to_string(e->wrong_fixes)});
  }
  std::string text = table.text();
  append_counts(text, "signals not used, signal epochs", rejections(outcome));
  append_counts(text, "integer resolution, epochs", outcomes(outcome));
  append_counts(text, "stereo frames", frame_fates(outcome));
  append_counts(text, "stereo observations", observation_fates(outcome));
  const std::vector<std::string> lines = notes(in, outcome);
  if (!lines.empty()) text += "\nnotes\n";
  for (const std::string& line : lines) text += "  " + line + '\n';
  return text;
}

std::string write_outputs(const std::string& folder, const SolveRequest& request, const SolveInputs& in, const SolveOutcome& outcome) {
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (failed) return "the folder cannot be made: " + failed.message();
  const auto write = [&folder](const char* name, const std::string& text) {
    return io::write_text_file((std::filesystem::path{folder} / name).string(), text);
  };
  io::RtklibHeader header;
  header.program = std::string{"searvins "} + kVersionString;
  header.input_files.push_back(measurement_file(request));
  if (in.base) header.input_files.push_back(request.base), header.reference = position_text(in.base_position_e_m);
  header.input_files.insert(header.input_files.end(), request.nav.begin(), request.nav.end());
  const Eigen::Vector3d origin_e_m = outcome.rows.empty() ? Eigen::Vector3d{6378137, 0, 0} : outcome.rows.front().p_e_m;
  const std::pair<const char*, std::string> files[] = {
      {"trajectory.csv", io::trajectory_csv(outcome.predicted_rows.empty() ? outcome.rows : with_predictions(outcome))},
      {"trajectory_lagged.csv", io::trajectory_csv(outcome.lagged_rows)},
      {"solution.pos", io::rtklib_solution(outcome.rows, header, outcome.ratios, outcome.ages_s)},
      {"trajectory.kml", io::trajectory_kml(outcome.rows)},
      {"trajectory_tum.txt", io::trajectory_tum(outcome.rows, origin_e_m)},
      {"summary.json", summary_json(request, in, outcome)},
      {"report.html", report_html(report_of(request, in, outcome))}};
  for (const auto& [name, text] : files)
    if (std::string wrong = write(name, text); !wrong.empty()) return wrong;
  return {};
}

}  // namespace searvins::examples
