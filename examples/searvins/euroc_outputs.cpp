// SPDX-License-Identifier: BSD-3-Clause
// What a stereo-inertial run leaves behind: the table in the terminal and the files in the folder.
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <functional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <searvins/io/text_fields.hpp>
#include <searvins/version.hpp>

#include "examples/searvins/euroc_job.hpp"
#include "examples/searvins/euroc_page.hpp"
#include "examples/support/evaluation.hpp"
#include "examples/support/json_writer.hpp"
#include "examples/support/report.hpp"
#include "examples/support/table.hpp"
#include "examples/support/tum_trajectory.hpp"

namespace searvins::examples {
namespace {

using Counts = std::vector<Count>;

std::vector<double> of_frames(const EurocOutcome& out, const std::function<double(const EurocFrame&)>& value) {
  std::vector<double> values;
  for (const EurocFrame& frame : out.frames) values.push_back(value(frame));
  return values;
}

double mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double v : values) sum += v;
  return values.empty() ? io::kUnknown : sum / static_cast<double>(values.size());
}

std::string three(const std::vector<double>& values, int decimals, const char* unit) {
  return cell(percentile(values, 0.5), decimals) + " / " + cell(percentile(values, 0.95), decimals) + " / " +
         cell(percentile(values, 1), decimals) + ' ' + unit;
}

std::string vector_text(const Eigen::Vector3d& v, int decimals) {
  return io::fixed_text(v.x(), decimals) + ", " + io::fixed_text(v.y(), decimals) + ", " + io::fixed_text(v.z(), decimals);
}

std::size_t count_if(const EurocOutcome& out, bool EurocFrame::*is) {
  return static_cast<std::size_t>(std::count_if(out.frames.begin(), out.frames.end(), [is](const EurocFrame& f) { return f.*is; }));
}

double since_start_s(const EurocOutcome& out, GpsTime t) { return out.frames.empty() ? 0 : seconds_between(out.frames.front().time, t); }

std::string alignment_text(const EurocOutcome& out) {
  if (out.alignment.empty()) return "never: waited for " + out.waits_for;
  std::string text;
  for (const auto& [time, is_aligned] : out.alignment) {
    const double t_s = since_start_s(out, time);
    text += std::string{text.empty() ? "" : "; "} + (is_aligned ? "" : "lost ") +
            (t_s <= 0 ? "before the first frame" : io::fixed_text(t_s, 1) + " s after the first frame");
  }
  return text;
}

std::string metres(double m) { return std::abs(m) < 0.1 ? io::fixed_text(1000 * m, 1) + " mm" : io::fixed_text(m, 3) + " m"; }

std::string errors_text(const AbsoluteError& e) {
  return metres(e.position_m.rmse) + " / " + metres(e.position_m.max) + (e.alignment.by_attitude ? " (turned by the attitudes)" : "");
}

void append_errors(const EurocErrors& e, std::vector<ReportEntry>& lines) {
  lines.emplace_back("compared poses", std::to_string(e.pairs.size()) + ", way " + metres(e.way_m));
  lines.emplace_back("ATE, yaw and position aligned, RMSE / max", errors_text(e.yaw));
  lines.emplace_back("ATE, pose aligned, RMSE / max", errors_text(e.pose));
  if (e.way_m > 1) lines.emplace_back("ATE RMSE of the way", io::fixed_text(100 * e.yaw.position_m.rmse / e.way_m, 3) + " %");
  lines.emplace_back("tilt / heading error, RMSE",
                     io::fixed_text(e.yaw.tilt_deg.rmse, 3) + " / " + io::fixed_text(e.yaw.heading_deg.rmse, 3) + " deg");
  for (const RelativeError& r : e.over_distance)
    lines.emplace_back("RPE over " + io::fixed_text(r.over, 0) + " m, mean",
                       io::fixed_text(r.translation_pct.mean, 3) + " %, " + io::fixed_text(r.rotation_deg.mean, 3) + " deg");
  for (const RelativeError& r : e.over_time)
    lines.emplace_back("RPE over " + io::fixed_text(r.over, 0) + " s, mean",
                       metres(r.translation_m.mean) + ", " + io::fixed_text(r.rotation_deg.mean, 3) + " deg");
}

/// The lines of table and report.
std::vector<ReportEntry> figures(const EurocOutcome& out) {
  std::vector<ReportEntry> lines;
  const std::size_t states = count_if(out, &EurocFrame::has_state);
  lines.emplace_back("frames", std::to_string(out.frames.size()) + ", with a pose " + std::to_string(states));
  lines.emplace_back("points a frame, offered / admitted",
                     io::fixed_text(mean(of_frames(out, [](const EurocFrame& f) { return static_cast<double>(f.offered); })), 1) + " / " +
                         io::fixed_text(mean(of_frames(out, [](const EurocFrame& f) { return static_cast<double>(f.admitted); })), 1));
  if (out.stereo) {
    const vision::AdmissionCounts& c = out.stereo->counts;
    lines.emplace_back("landmarks",
                       std::to_string(c.landmarks) + ", " + std::to_string(out.stereo->dropped_landmarks) + " dropped as moving");
    lines.emplace_back("frames with the stop cue", std::to_string(c.still_frames));
  }
  lines.emplace_back("frames held at rest", std::to_string(count_if(out, &EurocFrame::is_at_rest)));
  lines.emplace_back("rest at the beginning", out.rest_s > 0 ? io::fixed_text(out.rest_s, 1) + " s" : "none");
  lines.emplace_back("aligned", alignment_text(out));
  lines.emplace_back("accelerometer bias at the end", vector_text(out.accel_bias_mps2, 4) + " m/s^2");
  lines.emplace_back("gyroscope bias at the end", vector_text(out.gyro_bias_radps, 5) + " rad/s");
  lines.emplace_back("way of the trajectory", metres(out.way_m));
  if (out.errors) append_errors(*out.errors, lines);
  lines.emplace_back("frontend P50 / P95 / max", three(of_frames(out, [](const EurocFrame& f) { return f.frontend_ms; }), 1, "ms"));
  lines.emplace_back("estimator P50 / P95 / max", three(of_frames(out, [](const EurocFrame& f) { return f.solve_ms; }), 1, "ms"));
  lines.emplace_back("whole run", io::fixed_text(out.wall_s, 2) + " s");
  return lines;
}

std::vector<ReportEntry> settings(const EurocRequest& request, const EurocOutcome& out) {
  std::vector<ReportEntry> s;
  s.emplace_back("recording", out.folder);
  s.emplace_back("frames", request.tracks.empty() ? "pictures, ORB frontend" : request.tracks);
  s.emplace_back("frame rate", io::fixed_text(out.frame_period_s > 0 ? 1 / out.frame_period_s : 0, 1) + " Hz");
  s.emplace_back("readings",
                 std::to_string(out.readings) + " at " + io::fixed_text(out.imu_interval_s > 0 ? 1 / out.imu_interval_s : 0, 1) + " Hz");
  s.emplace_back("truth", out.truth_source.empty() ? "none" : out.truth_source);
  s.emplace_back("window", io::fixed_text(request.lag_s, 1) + " s");
  s.emplace_back("frames that share a landmark", std::to_string(request.max_arc));
  std::string without;
  for (const std::string& part : request.without) (without += without.empty() ? "" : ", ") += part;
  if (!without.empty()) s.emplace_back("screening without", without);
  return s;
}

std::vector<std::string> notes(const EurocOutcome& out) {
  std::vector<std::string> lines = out.notes;
  for (const auto& [what, n] : out.incidents) lines.push_back(std::to_string(n) + " times " + what);
  return lines;
}

Counts frame_fates(const EurocOutcome& out) {
  Counts counts;
  for (std::size_t f = 0; out.stereo && f < vision::kFrameFates; ++f)
    if (const std::size_t n = out.stereo->counts.frames[f])
      counts.emplace_back(vision::name_of(static_cast<vision::FrameFate>(f)), static_cast<long>(n));
  return counts;
}
Counts observation_fates(const EurocOutcome& out) {
  Counts counts;
  for (std::size_t f = 0; out.stereo && f < vision::kObservationFates; ++f)
    if (const std::size_t n = out.stereo->counts.observations[f])
      counts.emplace_back(vision::name_of(static_cast<vision::ObservationFate>(f)), static_cast<long>(n));
  return counts;
}

void append_counts(std::string& text, const char* title, const Counts& counts) {
  if (counts.empty()) return;
  Table table{{title, "count"}};
  for (const auto& [what, n] : counts) table.row({what, std::to_string(n)});
  text += '\n' + table.text();
}

void member_counts(JsonWriter& json, const char* key, const Counts& counts) {
  json.begin_object(key);
  for (const auto& [what, n] : counts) json.member(what, n);
  json.end_object();
}

void member_absolute(JsonWriter& json, const char* key, const AbsoluteError& e) {
  json.begin_object(key).member("rmse_m", e.position_m.rmse).member("mean_m", e.position_m.mean).member("max_m", e.position_m.max);
  json.member("tilt_rmse_deg", e.tilt_deg.rmse).member("heading_rmse_deg", e.heading_deg.rmse);
  json.member("turned_by_attitudes", e.alignment.by_attitude).end_object();
}

void member_relative(JsonWriter& json, const char* key, const char* over, const std::vector<RelativeError>& errors) {
  json.begin_array(key);
  for (const RelativeError& r : errors)
    json.begin_object()
        .member(over, r.over)
        .member("stretches", r.translation_m.count)
        .member("translation_mean_m", r.translation_m.mean)
        .member("translation_mean_pct", r.translation_pct.mean)
        .member("rotation_mean_deg", r.rotation_deg.mean)
        .end_object();
  json.end_array();
}

std::string summary_json(const EurocRequest& request, const EurocOutcome& out) {
  JsonWriter json;
  json.begin_object().member("schema", 1).member("program", std::string{"searvins "} + kVersionString).member("command", request.command);
  json.begin_object("settings");
  for (const auto& [label, value] : settings(request, out)) json.member(label, value);
  json.end_object();
  json.member("frames", out.frames.size())
      .member("poses", count_if(out, &EurocFrame::has_state))
      .member("pose_at_end", out.is_solved_at_end());
  json.member("frames_at_rest", count_if(out, &EurocFrame::is_at_rest)).member("first_rest_s", out.rest_s).member("way_m", out.way_m);
  json.begin_array("alignment");
  for (const auto& [time, is_aligned] : out.alignment)
    json.begin_object().member("since_first_frame_s", since_start_s(out, time)).member("aligned", is_aligned).end_object();
  json.end_array();
  if (const auto& e = out.errors) {
    json.begin_object("errors").member("poses", e->pairs.size()).member("way_m", e->way_m);
    member_absolute(json, "yaw_and_position_aligned", e->yaw), member_absolute(json, "pose_aligned", e->pose);
    member_relative(json, "relative_over_distance", "length_m", e->over_distance);
    member_relative(json, "relative_over_time", "duration_s", e->over_time);
    json.end_object();
  }
  if (out.stereo) {
    json.member("landmarks", out.stereo->counts.landmarks).member("dropped_landmarks", out.stereo->dropped_landmarks);
    json.member("stop_cue_frames", out.stereo->counts.still_frames);
  }
  member_counts(json, "frame_fates", frame_fates(out)), member_counts(json, "observation_fates", observation_fates(out));
  member_counts(json, "incidents", out.incidents);
  json.member("frontend_median_ms", percentile(of_frames(out, [](const EurocFrame& f) { return f.frontend_ms; }), 0.5));
  json.member("estimator_median_ms", percentile(of_frames(out, [](const EurocFrame& f) { return f.solve_ms; }), 0.5))
      .member("wall_s", out.wall_s);
  json.begin_array("notes");
  for (const std::string& note : out.notes) json.value(note);
  return json.end_array().end_object().text();
}

/// The arrays that the page draws.
class PageData {
 public:
  explicit PageData(const EurocOutcome& out) : out_(out) {}

  [[nodiscard]] std::string json() {
    using Frame = EurocFrame;
    const GpsTime start = out_.frames.front().time;
    text_ = "{\"sow\":" + json_literal(start.sow());
    column("t", 3, [&](const Frame& f) { return seconds_between(start, f.time); });
    column("s", 0, [](const Frame& f) { return f.is_at_rest ? 2 : f.has_state && f.admitted > 0 ? 0 : 4; });
    const RigidMotion move = out_.errors ? out_.errors->yaw.alignment.truth_from_estimate : RigidMotion{};
    for (int k = 0; k < 3; ++k)
      column(std::array{"e", "n", "u"}[static_cast<std::size_t>(k)], 4,
             [&](const Frame& f) { return f.has_state ? (move * f.pose.p_w_m)[k] : io::kUnknown; });
    column("speed", 3, [](const Frame& f) { return f.has_state ? f.v_w_mps.norm() : io::kUnknown; });
    column("sigma", 4, [](const Frame& f) { return f.has_state ? f.sigma_m.norm() : io::kUnknown; });
    column("offered", 0, [](const Frame& f) { return static_cast<double>(f.offered); });
    column("admitted", 0, [](const Frame& f) { return static_cast<double>(f.admitted); });
    column("fe", 2, [](const Frame& f) { return f.frontend_ms; });
    column("ms", 2, [](const Frame& f) { return f.has_state ? f.solve_ms : io::kUnknown; });
    if (out_.errors) add_errors(move);
    return text_ + '}';
  }

 private:
  void array(const std::string& values) { text_ += '[' + values + ']'; }
  static void append(std::string& list, double value, int decimals) {
    if (!list.empty()) list += ',';
    const std::size_t before = list.size();
    io::append_fixed(list, value, decimals);
    if (list.size() == before) list += "null";
  }
  void column(const char* name, int decimals, const std::function<double(const EurocFrame&)>& value) {
    std::string list;
    for (const EurocFrame& frame : out_.frames) append(list, value(frame), decimals);
    text_ += std::string{",\""} + name + "\":";
    array(list);
  }
  void add_errors(const RigidMotion& move) {
    const std::vector<PosePair>& pairs = out_.errors->pairs;
    const auto error_of = [&](const EurocFrame& f) -> Eigen::Vector3d {
      const auto at =
          std::lower_bound(pairs.begin(), pairs.end(), f.time, [](const PosePair& p, GpsTime t) { return p.estimate.time < t; });
      if (at == pairs.end() || at->estimate.time != f.time) return Eigen::Vector3d::Constant(io::kUnknown);
      return move * at->estimate.p_w_m - at->truth.p_w_m;
    };
    for (int k = 0; k < 3; ++k)
      column(std::array{"ee", "en", "eu"}[static_cast<std::size_t>(k)], 4, [&](const EurocFrame& f) { return error_of(f)[k]; });
    column("h", 4, [&](const EurocFrame& f) { return error_of(f).head<2>().norm(); });
    column("d", 4, [&](const EurocFrame& f) { return error_of(f).norm(); });
    text_ += ",\"truth\":{";
    for (int k = 0; k < 2; ++k) {
      std::string list;
      for (const PosePair& p : pairs) append(list, p.truth.p_w_m[k], 4);
      text_ += k == 0 ? "\"e\":" : ",\"n\":";
      array(list);
    }
    text_ += '}';
  }

  const EurocOutcome& out_;
  std::string text_;
};

std::string tiles_html(const EurocOutcome& out) {
  using detail::tile;
  std::string text = "<section class=\"tiles\">\n";
  text += tile(std::to_string(count_if(out, &EurocFrame::has_state)), "poses of " + std::to_string(out.frames.size()) + " frames");
  if (const auto& e = out.errors) {
    text += tile(detail::length_text(e->yaw.position_m.rmse), "ATE RMSE, yaw and position aligned");
    text += tile(detail::length_text(e->pose.position_m.rmse), "ATE RMSE, pose aligned");
    if (e->way_m > 1) text += tile(detail::percent_text(100 * e->yaw.position_m.rmse / e->way_m), "ATE RMSE of the way");
    if (!e->over_distance.empty())
      text += tile(detail::percent_text(e->over_distance.back().translation_pct.mean),
                   "RPE over " + io::fixed_text(e->over_distance.back().over, 0) + " m");
  }
  text += tile(detail::length_text(out.way_m), "way");
  if (!out.frames.empty()) text += tile(detail::duration_text(since_start_s(out, out.frames.back().time)), "duration");
  text += tile(io::fixed_text(mean(of_frames(out, [](const EurocFrame& f) { return static_cast<double>(f.admitted); })), 0),
               "points admitted a frame");
  text +=
      tile(io::fixed_text(mean(of_frames(out, [](const EurocFrame& f) { return f.frontend_ms + f.solve_ms; })), 1) + "<small>ms</small>",
           "a frame, mean");
  return text + "</section>\n";
}

std::string report_html(const EurocRequest& request, const EurocOutcome& out) {
  const std::string title = html_text(std::filesystem::path{request.folder}.lexically_normal().filename().string());
  RunReport side;  // for the parts that pages share
  side.settings = settings(request, out), side.notes = notes(out), side.command = request.command;
  std::string text =
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width, "
      "initial-scale=1\">\n<title>" +
      title + "</title>\n<style>" + kReportStyle +
      "</style>\n</head>\n<body>\n<main>\n<header><div class=\"over\">searvins report</div><h1>" + title +
      "</h1><p class=\"sub\">Stereo-inertial, without GNSS: " + std::to_string(out.frames.size()) + " frames</p>";
  if (!request.command.empty()) text += "<p class=\"command\"><code>" + html_text(request.command) + "</code></p>";
  text += "</header>\n" + tiles_html(out);
  text +=
      "<section class=\"columns\">\n<div class=\"card mapcard\"><div class=\"head\"><h2>Path</h2><span class=\"buttons\" "
      "id=\"mapbuttons\"><button "
      "data-do=\"in\" aria-label=\"zoom in\">+</button><button data-do=\"out\" aria-label=\"zoom out\">&minus;</button><button "
      "data-do=\"all\">all</button></span><span class=\"note hint\">from above; drag to move; click, then turn the wheel to "
      "zoom</span><span "
      "id=\"maplegend\" style=\"margin-left:auto\"></span></div><div class=\"grow\" id=\"maphost\" role=\"img\" aria-label=\"path from "
      "above\"></div></div>\n<div class=\"card\"><div class=\"head\"><h2>Figures</h2></div>" +
      detail::table_html("", figures(out), true) + "</div>\n</section>\n";
  text +=
      "<section class=\"card\"><div class=\"head\"><h2>Over time</h2></div><div id=\"time\"></div></section>\n" + strip_section(out.strip);
  std::vector<ReportEntry> fates;
  for (const Counts& counts : {frame_fates(out), observation_fates(out)})
    for (const auto& [what, n] : counts) fates.emplace_back(what, std::to_string(n));
  text +=
      "<section class=\"card\"><div class=\"head\"><h2>Frames and points</h2><span class=\"note\">what became of them</span></div><div "
      "class=\"settings\">" +
      detail::table_html("", fates) + "</div></section>\n" + detail::settings_html(side);
  text += std::string{"<footer>searvins "} + kVersionString +
          "</footer>\n</main>\n<div id=\"tip\" role=\"status\"></div>\n<noscript><p style=\"padding:24px\">The charts need JavaScript; the "
          "figures "
          "above do not.</p></noscript>\n";
  if (out.frames.empty()) return text + "</body>\n</html>\n";
  return text + "<script type=\"application/json\" id=\"run-data\">" + PageData{out}.json() + "</script>\n<script>(() => {" +
         kReportScales + kReportCharts + kReportMap + kEurocPage + "})();</script>\n</body>\n</html>\n";
}

}  // namespace

std::string summary_text(const EurocRequest&, const EurocOutcome& out) {
  Table table{{"figure", "value"}};
  for (const auto& [label, value] : figures(out)) table.row({label, value});
  std::string text = table.text();
  append_counts(text, "stereo frames", frame_fates(out));
  append_counts(text, "stereo observations", observation_fates(out));
  const std::vector<std::string> lines = notes(out);
  if (!lines.empty()) text += "\nnotes\n";
  for (const std::string& line : lines) text += "  " + line + '\n';
  return text;
}

std::string write_outputs(const std::string& folder, const EurocRequest& request, const EurocOutcome& out) {
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (failed) return "the folder cannot be made: " + failed.message();
  const std::vector<TimedPose> poses = out.trajectory();
  const std::string world = "body (the recording's IMU) in a level world that begins at the first rest; stamps as recorded";
  std::vector<std::pair<const char*, std::string>> files{{"trajectory.tum", tum_text(poses, world)},
                                                         {"summary.txt", summary_text(request, out)},
                                                         {"summary.json", summary_json(request, out)},
                                                         {"report.html", report_html(request, out)}};
  if (out.errors) {
    std::vector<TimedPose> truth;
    for (const PosePair& p : out.errors->pairs) truth.push_back(p.truth);
    files.emplace_back("truth.tum", tum_text(truth, "the truth at the times of the trajectory, in its own world"));
  }
  for (const auto& [name, text] : files)
    if (std::string wrong = io::write_text_file((std::filesystem::path{folder} / name).string(), text); !wrong.empty()) return wrong;
  return {};
}

}  // namespace searvins::examples
