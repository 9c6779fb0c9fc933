// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// trajectory.csv: what a run writes and what everything else reads, one row per state.
///
///     week, sow                  GPS time of the state, nine decimals: exactly the nanoseconds of GpsTime
///     ecef_*_m                   antenna position, frame e
///     sd_*_m, cov_*_m2           standard deviations and covariances of that position in east, north, up at the position itself
///     lat_deg, lon_deg, height_m the same position, WGS-84 ellipsoid
///     vel_*_mps                  antenna velocity in east, north, up
///     roll, pitch, heading       of the body as forward-right-down angles, heading clockwise from north, degrees
///
/// A field that is unknown is empty in the file and NaN (counts: -1) in the row.
#pragma once

#include <Eigen/Core>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

#include <searvins/core/time.hpp>
#include <searvins/geodesy/wgs84.hpp>
#include <searvins/io/text_fields.hpp>

namespace searvins::io {

/// How a row came about. `fix` only when an integer vector was accepted at this very epoch.
enum class SolutionStatus : std::uint8_t {
  fix,     ///< integers accepted and the window re-optimised with them at this epoch
  float_,  ///< carrier phase with real-valued ambiguities, or riding on earlier fixes
  dgnss,   ///< code-only double differences
  spp,     ///< single point
  dr,      ///< dead reckoning: no GNSS used
};
inline constexpr std::size_t kSolutionStatuses = 5;  ///< number of SolutionStatus values

/// The word in the file.
[[nodiscard]] constexpr const char* name_of(SolutionStatus status) {
  constexpr const char* names[kSolutionStatuses] = {"fix", "float", "dgnss", "spp", "dr"};
  return names[static_cast<std::size_t>(status)];
}

/// Reads the word; false for any other.
[[nodiscard]] inline bool status_from_text(std::string_view text, SolutionStatus& out) {
  for (std::size_t i = 0; i < kSolutionStatuses; ++i) {
    const auto status = static_cast<SolutionStatus>(i);
    if (text == name_of(status)) return out = status, true;
  }
  return false;
}

inline constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();  ///< a number that a row does not have

/// One state of a trajectory.
struct TrajectoryRow {
  GpsTime time{};
  Eigen::Vector3d p_e_m{Eigen::Vector3d::Constant(kUnknown)};  ///< antenna, ECEF
  SolutionStatus status{SolutionStatus::dr};
  Eigen::Vector3d sd_enu_m{Eigen::Vector3d::Constant(kUnknown)};  ///< 1-sigma of the position
  double cov_en_m2{kUnknown}, cov_eu_m2{kUnknown}, cov_nu_m2{kUnknown};
  Eigen::Vector3d v_enu_mps{Eigen::Vector3d::Constant(kUnknown)};  ///< antenna velocity
  double roll_deg{kUnknown}, pitch_deg{kUnknown}, heading_deg{kUnknown};
  int n_sat{-1}, n_dd{-1}, n_tracks{-1};  ///< satellites, double differences, stereo tracks used
  double success_rate{kUnknown};          ///< of the integer vector, 0..1
  double solve_ms{kUnknown};              ///< wall-clock time of the update

  /// Position covariance in east, north, up, m^2; NaN where the row has none.
  [[nodiscard]] Eigen::Matrix3d covariance_enu_m2() const {
    Eigen::Matrix3d c;
    const Eigen::Vector3d variance = sd_enu_m.cwiseAbs2();
    c << variance.x(), cov_en_m2, cov_eu_m2,  //
        cov_en_m2, variance.y(), cov_nu_m2,   //
        cov_eu_m2, cov_nu_m2, variance.z();
    return c;
  }

  /// Sets the covariance fields from a position covariance in east, north, up.
  void set_covariance_enu_m2(const Eigen::Matrix3d& c) {
    sd_enu_m = c.diagonal().cwiseMax(0.0).cwiseSqrt();
    cov_en_m2 = c(0, 1), cov_eu_m2 = c(0, 2), cov_nu_m2 = c(1, 2);
  }
};

/// Names of the columns, in the order of the file.
inline constexpr std::array<std::string_view, 26> kTrajectoryColumns = {
    "week",      "sow",       "ecef_x_m",    "ecef_y_m", "ecef_z_m", "status",   "sd_e_m",       "sd_n_m",    "sd_u_m",
    "cov_en_m2", "cov_eu_m2", "cov_nu_m2",   "lat_deg",  "lon_deg",  "height_m", "vel_e_mps",    "vel_n_mps", "vel_u_mps",
    "roll_deg",  "pitch_deg", "heading_deg", "n_sat",    "n_dd",     "n_tracks", "success_rate", "solve_ms"};

/// The header line, without its end.
[[nodiscard]] inline std::string trajectory_header() {
  std::string line;
  for (const std::string_view column : kTrajectoryColumns) (line += line.empty() ? "" : ",") += column;
  return line;
}

namespace detail {

/// Seconds of week with nine decimals, exact.
inline void append_sow(std::string& text, GpsTime time) {
  const std::string fraction = std::to_string(time.ns_of_week() % kNanosecondsPerSecond);
  text += std::to_string(time.ns_of_week() / kNanosecondsPerSecond);
  text += '.' + std::string(9 - fraction.size(), '0') + fraction;
}

inline void append_count(std::string& text, int count) {
  if (count >= 0) text += std::to_string(count);
}

}  // namespace detail

/// Appends one row as a line of trajectory.csv.
inline void append_trajectory_row(std::string& text, const TrajectoryRow& row) {
  const auto number = [&text](double value, int decimals) { append_fixed(text += ',', value, decimals); };
  text += std::to_string(row.time.week()) + ',';
  detail::append_sow(text, row.time);
  for (int i = 0; i < 3; ++i) number(row.p_e_m[i], 5);
  (text += ',') += name_of(row.status);
  for (int i = 0; i < 3; ++i) number(row.sd_enu_m[i], 5);
  for (const double covariance : {row.cov_en_m2, row.cov_eu_m2, row.cov_nu_m2}) append_scientific(text += ',', covariance, 6);
  const geodesy::Geodetic g = geodesy::geodetic_from_ecef(row.p_e_m);
  number(g.lat_rad * 180 / std::numbers::pi, 10);
  number(g.lon_rad * 180 / std::numbers::pi, 10);
  number(g.height_m, 5);
  for (int i = 0; i < 3; ++i) number(row.v_enu_mps[i], 5);
  for (const double angle : {row.roll_deg, row.pitch_deg, row.heading_deg}) number(angle, 5);
  for (const int count : {row.n_sat, row.n_dd, row.n_tracks}) detail::append_count(text += ',', count);
  number(row.success_rate, 6);
  number(row.solve_ms, 3);
  text += '\n';
}

/// The whole file as text.
[[nodiscard]] inline std::string trajectory_csv(const std::vector<TrajectoryRow>& rows) {
  std::string text = trajectory_header() + '\n';
  for (const TrajectoryRow& row : rows) append_trajectory_row(text, row);
  return text;
}

namespace detail {

/// Reads one data line; an empty string on success, else what is wrong with it.
[[nodiscard]] inline std::string read_trajectory_line(std::string_view line, TrajectoryRow& row) {
  const std::vector<std::string_view> fields = split(line, ',');
  if (fields.size() != kTrajectoryColumns.size())
    return std::to_string(fields.size()) + " fields, " + std::to_string(kTrajectoryColumns.size()) + " expected";
  std::array<double, kTrajectoryColumns.size()> values{};
  for (std::size_t i = 0; i < fields.size(); ++i) {
    if (i == 5) continue;
    const std::string place = "column " + std::string{kTrajectoryColumns[i]};
    values[i] = kUnknown;
    if (!fields[i].empty() && !parse_number(fields[i], values[i])) return place + ": '" + std::string{fields[i]} + "' is not a number";
    if (fields[i].empty() && i < 5) return place + " is empty";
  }
  if (!status_from_text(fields[5], row.status))
    return "column status: '" + std::string{fields[5]} + "' is not one of fix, float, dgnss, spp, dr";
  if (values[0] != std::floor(values[0]) || values[0] < 0 || values[0] > 9999) return "column week is not a GPS week";
  if (values[1] < 0 || values[1] >= kSecondsPerWeek) return "column sow lies outside 0..604800";
  row.time = GpsTime::from_week_sow(static_cast<std::int64_t>(values[0]), values[1]);
  row.p_e_m = {values[2], values[3], values[4]};
  row.sd_enu_m = {values[6], values[7], values[8]};
  row.cov_en_m2 = values[9], row.cov_eu_m2 = values[10], row.cov_nu_m2 = values[11];
  row.v_enu_mps = {values[15], values[16], values[17]};
  row.roll_deg = values[18], row.pitch_deg = values[19], row.heading_deg = values[20];
  int* const counts[] = {&row.n_sat, &row.n_dd, &row.n_tracks};
  for (std::size_t i = 0; i < 3; ++i) {
    const double count = values[21 + i];
    if (std::isfinite(count) && (count != std::floor(count) || count < 0 || count > 1e6))
      return "column " + std::string{kTrajectoryColumns[21 + i]} + " is not a count";
    *counts[i] = std::isfinite(count) ? static_cast<int>(count) : -1;
  }
  row.success_rate = values[24], row.solve_ms = values[25];
  return {};
}

}  // namespace detail

/// Reads trajectory.csv from text; `name` is the file's name in errors. Strict: the exact header, known status words, rising time.
[[nodiscard]] inline FileResult<std::vector<TrajectoryRow>> parse_trajectory(std::string_view text, const std::string& name) {
  LineReader lines{text};
  std::string_view line;
  if (!lines.next(line) || trimmed(line) != trajectory_header())
    return Diagnostic{name, 1, "the first line is not the header of a trajectory.csv", "it must be " + trajectory_header()};
  std::vector<TrajectoryRow> rows;
  while (lines.next(line)) {
    if (trimmed(line).empty()) continue;
    TrajectoryRow row;
    if (std::string wrong = detail::read_trajectory_line(line, row); !wrong.empty())
      return Diagnostic{name, lines.number(), std::move(wrong), {}};
    if (!rows.empty() && row.time <= rows.back().time)
      return Diagnostic{name, lines.number(), "time does not rise", "sort the rows, each time once"};
    rows.push_back(row);
  }
  if (rows.empty()) return Diagnostic{name, 0, "has a header but no row", "the run wrote nothing"};
  return rows;
}

/// Reads a trajectory.csv file.
[[nodiscard]] inline FileResult<std::vector<TrajectoryRow>> read_trajectory(const std::string& path) {
  const FileResult<std::string> text = read_text_file(path);
  if (!text) return text.error();
  return parse_trajectory(*text, path);
}

}  // namespace searvins::io
