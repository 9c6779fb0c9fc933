// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The data that report.html draws, as JSON: arrays by column, numbers with few digits, columns without any value left out.
///
/// Above kMaxReportRows rows every n-th is kept, and always the ends of each stretch of one status, so that no change is lost.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <searvins/geodesy/local_frame.hpp>
#include <searvins/io/text_fields.hpp>

#include "examples/support/integrity.hpp"
#include "examples/support/json_writer.hpp"
#include "examples/support/report_integrity.hpp"
#include "examples/support/run_report.hpp"
#include "examples/support/street_data.hpp"

namespace searvins::examples {

inline constexpr std::size_t kMaxReportRows = 20'000;
inline constexpr std::size_t kMaxSkyPoints = 60;  ///< per satellite

namespace detail {

/// Builds the JSON that the page draws: arrays by column, numbers with few digits.
class ReportData {
 public:
  explicit ReportData(const RunReport& report) : report_(report), kept_(kept_rows(report.rows)) {}

  [[nodiscard]] std::string json() {
    const std::vector<io::TrajectoryRow>& rows = report_.rows;
    const GpsTime start = rows.empty() ? GpsTime{} : rows.front().time;
    const geodesy::LocalFrame w = geodesy::LocalFrame::at(origin());
    text_ = "{\"sow\":" + json_literal(start.sow());
    column("t", 3, [&](std::size_t i) { return seconds_between(start, rows[i].time); });
    column("s", 0, [&](std::size_t i) { return static_cast<double>(rows[i].status); });
    for (int k = 0; k < 3; ++k)
      column(std::array{"e", "n", "u"}[static_cast<std::size_t>(k)], 3, [&](std::size_t i) { return w.to_local(rows[i].p_e_m)[k]; });
    for (int k = 0; k < 3; ++k)
      column(std::array{"se", "sn", "su"}[static_cast<std::size_t>(k)], 4, [&](std::size_t i) { return rows[i].sd_enu_m[k]; });
    column("cen", 6, [&](std::size_t i) { return rows[i].cov_en_m2; });
    column("speed", 2, [&](std::size_t i) { return rows[i].v_enu_mps.norm(); });
    for (int k = 0; k < 3; ++k)
      column(std::array{"ve", "vn", "vu"}[static_cast<std::size_t>(k)], 3, [&](std::size_t i) { return rows[i].v_enu_mps[k]; });
    column("roll", 3, [&](std::size_t i) { return rows[i].roll_deg; });
    column("pitch", 3, [&](std::size_t i) { return rows[i].pitch_deg; });
    column("hdg", 3, [&](std::size_t i) { return rows[i].heading_deg; });
    column("sr", 4, [&](std::size_t i) { return rows[i].success_rate; });
    column("ms", 3, [&](std::size_t i) { return rows[i].solve_ms; });
    add_errors();
    add_diagnostics();
    add_outages(start);
    add_truth(w);
    text_ += street_member(report_.streets, w);
    add_scores();
    add_sky();
    return text_ + "}";
  }

 private:
  /// Rows to draw: all, or every n-th and the ends of each stretch of one status.
  [[nodiscard]] static std::vector<std::size_t> kept_rows(const std::vector<io::TrajectoryRow>& rows) {
    const std::size_t stride = 1 + (rows.empty() ? 0 : (rows.size() - 1) / kMaxReportRows);
    std::vector<std::size_t> kept;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const bool edge = i + 1 == rows.size() || rows[i].status != rows[i + 1].status || (i > 0 && rows[i].status != rows[i - 1].status);
      if (i % stride == 0 || edge) kept.push_back(i);
    }
    return kept;
  }

  [[nodiscard]] Eigen::Vector3d origin() const {
    if (report_.truth && !report_.truth->points.empty() && report_.truth->is_static) return report_.truth->points.front().p_e_m;
    for (const io::TrajectoryRow& row : report_.rows)
      if (row.p_e_m.allFinite()) return row.p_e_m;
    return {geodesy::kSemiMajorAxisM, 0, 0};
  }

  static void append_number(std::string& out, double value, int decimals) {
    const std::size_t before = out.size();
    io::append_fixed(out, value, decimals);
    if (out.size() == before)
      out += "null";
    else if (decimals > 0) {  // 1.500 -> 1.5, 2.000 -> 2
      out.erase(out.find_last_not_of('0') + 1);
      if (out.back() == '.') out.pop_back();
    }
  }

  /// Adds a column of the kept rows; nothing when it has no value at all.
  void column(const char* name, int decimals, const std::function<double(std::size_t)>& value) {
    std::string list;
    bool any = false;
    for (const std::size_t i : kept_) {
      const double v = value(i);
      any = any || std::isfinite(v);
      append_number(list += list.empty() ? "" : ",", v, decimals);
    }
    if (any || std::string_view{name} == "t" || std::string_view{name} == "s") text_ += std::string{",\""} + name + "\":[" + list + ']';
  }

  void add_errors() {
    if (!report_.truth) return;
    std::vector<Eigen::Vector3d> errors(report_.rows.size(), Eigen::Vector3d::Constant(io::kUnknown));
    std::vector<double> nees(report_.rows.size(), io::kUnknown);
    for (const std::size_t i : kept_) {
      ScoredEpoch epoch;
      score_row(report_.rows[i], *report_.truth, {}, epoch);
      errors[i] = epoch.error_enu_m, nees[i] = epoch.nees;
    }
    for (int k = 0; k < 3; ++k)
      column(std::array{"ee", "en", "eu"}[static_cast<std::size_t>(k)], 4, [&](std::size_t i) { return errors[i][k]; });
    column("nees", 3, [&](std::size_t i) { return nees[i]; });
    column("h", 4, [&](std::size_t i) { return std::hypot(errors[i].x(), errors[i].y()); });
  }

  void add_diagnostics() {
    const std::vector<ReportEpoch>& epochs = report_.epochs;
    const auto count = [](int n) { return n < 0 ? io::kUnknown : static_cast<double>(n); };
    if (epochs.size() != report_.rows.size()) return column("used", 0, [&](std::size_t i) { return count(report_.rows[i].n_sat); });
    column("seen", 0, [&](std::size_t i) { return count(epochs[i].satellites_seen); });
    column("used", 0,
           [&](std::size_t i) { return count(epochs[i].satellites_used < 0 ? report_.rows[i].n_sat : epochs[i].satellites_used); });
    column("cn0", 1, [&](std::size_t i) { return epochs[i].mean_cn0_dbhz; });
    column("wc", 3, [&](std::size_t i) { return epochs[i].weight_code; });
    column("wp", 3, [&](std::size_t i) { return epochs[i].weight_phase; });
    column("outcome", 0, [&](std::size_t i) { return count(epochs[i].fix_outcome); });
    column("ratio", 2, [&](std::size_t i) { return epochs[i].ratio; });
    column("age", 2, [&](std::size_t i) { return epochs[i].base_age_s; });
    add_motion_diagnostics();
    text_ += ",\"reasons\":" + names(report_.rejection_reasons) + ",\"outcomes\":" + names(report_.fix_outcomes);
    if (report_.success_rate_gate) text_ += ",\"gate\":" + json_literal(*report_.success_rate_gate);
    std::string lists;
    for (std::size_t r = 0; r < report_.rejection_reasons.size(); ++r) {
      std::string list;
      for (const std::size_t i : kept_)
        list += (list.empty() ? "" : ",") + std::to_string(r < epochs[i].rejected.size() ? epochs[i].rejected[r] : 0);
      lists += (lists.empty() ? "[" : ",[") + list + ']';
    }
    text_ += ",\"rejected\":[" + lists + ']';
  }

  /// Sigmas of velocity and attitude, biases.
  void add_motion_diagnostics() {
    const std::vector<ReportEpoch>& epochs = report_.epochs;
    const auto vector = [&](std::array<const char*, 3> names, int decimals, Eigen::Vector3d ReportEpoch::*member) {
      for (int k = 0; k < 3; ++k)
        column(names[static_cast<std::size_t>(k)], decimals, [&](std::size_t i) { return (epochs[i].*member)[k]; });
    };
    vector({"sve", "svn", "svu"}, 4, &ReportEpoch::sd_velocity_enu_mps);
    vector({"sroll", "spitch", "shdg"}, 4, &ReportEpoch::sd_attitude_deg);
    vector({"bax", "bay", "baz"}, 5, &ReportEpoch::accel_bias_mps2);
    vector({"bgx", "bgy", "bgz"}, 5, &ReportEpoch::gyro_bias_dps);
  }

  /// Stretches without GNSS, as pairs of times.
  void add_outages(GpsTime start) {
    std::string list;
    for (const Outage& outage : report_.outages) {
      append_number(list += list.empty() ? "[" : ",[", seconds_between(start, outage.from), 2);
      append_number(list += ',', seconds_between(start, outage.to), 2);
      list += ']';
    }
    if (!list.empty()) text_ += ",\"outages\":[" + list + ']';
  }

  [[nodiscard]] static std::string names(const std::vector<std::string>& words) {
    std::string list;
    for (const std::string& word : words) list += (list.empty() ? "" : ",") + json_literal(std::string_view{word});
    return '[' + list + ']';
  }

  /// The truth of the run's time, thinned; a null breaks the line at a gap.
  void add_truth(const geodesy::LocalFrame& w) {
    if (!report_.truth || report_.truth->points.empty() || report_.rows.empty()) return;
    const std::vector<TruthPoint>& points = report_.truth->points;
    const GpsTime first = report_.rows.front().time.plus_seconds(-1), last = report_.rows.back().time.plus_seconds(1);
    const std::size_t stride = 1 + points.size() / kMaxReportRows;
    std::string east, north;
    std::optional<GpsTime> previous;
    for (std::size_t i = 0; i < points.size(); i += stride) {
      if (!report_.truth->is_static && (points[i].time < first || points[i].time > last)) continue;
      if (previous && seconds_between(*previous, points[i].time) > 30 + static_cast<double>(stride)) east += ",null", north += ",null";
      previous = points[i].time;
      const Eigen::Vector3d p_w_m = w.to_local(points[i].p_e_m);
      append_number(east += east.empty() ? "" : ",", p_w_m.x(), 3);
      append_number(north += north.empty() ? "" : ",", p_w_m.y(), 3);
    }
    if (!east.empty()) text_ += ",\"truth\":{\"e\":[" + east + "],\"n\":[" + north + "]}";
  }

  /// Errors of the evaluation epochs, for their distribution.
  void add_scores() {
    if (!report_.evaluation) return;
    std::string horizontal, spatial, fixed, bounds;
    const IntegrityOptions options;
    const std::vector<ScoredEpoch>& epochs = report_.evaluation->epochs;
    for (const ScoredEpoch& epoch : epochs) {
      if (!epoch.has_error()) continue;
      append_number(horizontal += horizontal.empty() ? "" : ",", epoch.horizontal_m(), 4);
      append_number(spatial += spatial.empty() ? "" : ",", epoch.spatial_m(), 4);
      append_number(bounds += bounds.empty() ? "" : ",", horizontal_bound_m(epoch, report_.rows, options.risk), 4);
      if (epoch.status == io::SolutionStatus::fix) append_number(fixed += fixed.empty() ? "" : ",", epoch.horizontal_m(), 4);
    }
    text_ += ",\"scored\":{\"n\":" + std::to_string(epochs.size()) + ",\"h\":[" + horizontal + "],\"d\":[" + spatial + "],\"b\":[" + bounds +
             "],\"f\":[" + fixed + "]}";
    text_ += ",\"integrity\":" + integrity_data(options);
  }

  void add_sky() {
    std::string list;
    for (const ReportSatellite& satellite : report_.satellites) {
      if (satellite.points.empty()) continue;
      const std::size_t stride = 1 + (satellite.points.size() - 1) / kMaxSkyPoints;
      std::string points;
      for (std::size_t i = 0; i < satellite.points.size(); i += stride) {
        const ReportSkyPoint& p = satellite.points[i];
        append_number(points += points.empty() ? "[" : ",[", p.azimuth_deg, 1);
        append_number(points += ',', p.elevation_deg, 1);
        append_number(points += ',', p.cn0_dbhz, 1);
        append_number(points += ',', p.rejected_share, 2);
        points += ']';
      }
      list += (list.empty() ? "{\"n\":" : ",{\"n\":") + json_literal(std::string_view{satellite.name}) + ",\"p\":[" + points + "]}";
    }
    text_ += ",\"sky\":[" + list + ']';
  }

  const RunReport& report_;
  std::vector<std::size_t> kept_;
  std::string text_;
};

}  // namespace detail

}  // namespace searvins::examples
