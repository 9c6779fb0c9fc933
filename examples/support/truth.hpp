// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Reference trajectories ("truth") in the forms that formats.md lists, told apart by their content:
///
///     header line        columns by name: time t, sow, t_gps_sow or tow_s; week or gps_week where there is one; position from
///                        ant_x, ecef_x, ecef_x_m or x on (three columns)
///     headerless         week,sow,x,y,z[,...]
///     TEX-CUP log        # comments (Latin-1), then date, time of day (UTC), ., latitude, longitude, ellipsoidal height
///
/// A file without a week takes it from the trajectory that is scored. Interpolation is linear in ECEF.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <searvins/core/time.hpp>
#include <searvins/geodesy/wgs84.hpp>
#include <searvins/io/rtklib_solution.hpp>
#include <searvins/io/text_fields.hpp>

namespace searvins::examples {

/// One reference position.
struct TruthPoint {
  GpsTime time{};
  Eigen::Vector3d p_e_m{Eigen::Vector3d::Zero()};  ///< antenna, ECEF
};

/// A reference trajectory: rising in time, or a point that never moves.
struct TruthTrack {
  std::vector<TruthPoint> points;
  bool is_static{false};  ///< one point that holds at all times
};

/// A truth that never moves.
[[nodiscard]] inline TruthTrack static_truth(const Eigen::Vector3d& p_e_m) { return {{{GpsTime{}, p_e_m}}, true}; }

/// Where a truth is interpolated.
struct TruthLimits {
  double max_gap_s{1.2};  ///< neighbours farther apart are not interpolated between
  double margin_s{0.02};  ///< beyond the last neighbour before a gap or an end, the last interval is continued for this long: a state
                          ///< lies at the receiver's tag minus its clock offset, up to 10 ms away from the second of the truth row
};

namespace detail {

/// Position on the line through two points at a time; beyond them the line goes on.
[[nodiscard]] inline Eigen::Vector3d on_line(const TruthPoint& a, const TruthPoint& b, GpsTime t) {
  const double u = seconds_between(a.time, t) / seconds_between(a.time, b.time);
  return (1 - u) * a.p_e_m + u * b.p_e_m;
}

}  // namespace detail

/// Truth at a time, nothing where it has no neighbours that are near enough.
[[nodiscard]] inline std::optional<Eigen::Vector3d> truth_at(const TruthTrack& truth, GpsTime t, const TruthLimits& limits = {}) {
  const std::vector<TruthPoint>& p = truth.points;
  if (p.empty()) return std::nullopt;
  if (truth.is_static) return p.front().p_e_m;
  const auto after = std::lower_bound(p.begin(), p.end(), t, [](const TruthPoint& a, GpsTime time) { return a.time < time; });
  const std::size_t i = static_cast<std::size_t>(after - p.begin());  // first point at or after t
  if (i < p.size() && p[i].time == t) return p[i].p_e_m;
  const auto near = [&](std::size_t k) {
    return k + 1 < p.size() && p[k + 1].time.ns - p[k].time.ns <= nanoseconds_from_seconds(limits.max_gap_s);
  };
  if (i > 0 && i < p.size() && near(i - 1)) return detail::on_line(p[i - 1], p[i], t);
  if (i > 0 && seconds_between(p[i - 1].time, t) <= limits.margin_s)
    return i > 1 && near(i - 2) ? detail::on_line(p[i - 2], p[i - 1], t) : p[i - 1].p_e_m;
  if (i < p.size() && seconds_between(t, p[i].time) <= limits.margin_s) return near(i) ? detail::on_line(p[i], p[i + 1], t) : p[i].p_e_m;
  return std::nullopt;
}

namespace detail {

/// Columns of a truth file with a header or without.
struct TruthColumns {
  std::size_t time{1}, position{2};
  std::optional<std::size_t> week{0};
};

/// "GPS TOW (s)" -> "gps_tow_s": lower case, runs of other characters as one underscore.
[[nodiscard]] inline std::string plain_name(std::string_view name) {
  std::string out;
  for (const char c : name) {
    if (std::isalnum(static_cast<unsigned char>(c)))
      out += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    else if (!out.empty() && out.back() != '_')
      out += '_';
  }
  if (!out.empty() && out.back() == '_') out.pop_back();
  return out;
}

/// Finds the columns in a header line; an empty string on success.
[[nodiscard]] inline std::string find_truth_columns(std::string_view header, TruthColumns& columns) {
  std::vector<std::string> names;
  for (const std::string_view name : io::split(header, ',')) names.push_back(plain_name(name));
  const auto first_of = [&names](std::initializer_list<const char*> wanted) -> std::optional<std::size_t> {
    for (const char* name : wanted)
      if (const auto at = std::find(names.begin(), names.end(), name); at != names.end())
        return static_cast<std::size_t>(at - names.begin());
    return std::nullopt;
  };
  const auto time = first_of({"t", "sow", "t_gps_sow", "tow_s", "gps_tow_s"});
  const auto position = first_of({"ant_x", "ecef_x", "ecef_x_m", "x"});
  columns.week = first_of({"week", "gps_week"});
  if (!time) return "the header names no time column: t, sow, t_gps_sow or tow_s";
  if (!position || *position + 2 >= names.size()) return "the header names no position: three columns from ant_x, ecef_x, ecef_x_m or x on";
  columns.time = *time, columns.position = *position;
  return {};
}

/// One data line by columns; an empty string on success. Without a week, `time` counts from the start of week 0.
[[nodiscard]] inline std::string read_truth_row(std::string_view line, const TruthColumns& columns, TruthPoint& point) {
  const std::vector<std::string_view> fields = io::split(line, ',');
  double sow = 0, week = 0;
  if (fields.size() <= std::max(columns.time, columns.position + 2)) return "the line is cut short";
  if (!io::parse_number(fields[columns.time], sow)) return "'" + std::string{fields[columns.time]} + "' is not a time";
  if (sow < 0 || sow > 2 * static_cast<double>(kSecondsPerWeek))
    return "the time " + std::string{fields[columns.time]} + " is no second of a GPS week";
  if (columns.week && (*columns.week >= fields.size() || !io::parse_number(fields[*columns.week], week) || week != std::floor(week) ||
                       week < 0 || week > 9999))
    return "the week is not a GPS week";
  for (std::size_t i = 0; i < 3; ++i) {
    const std::string_view field = fields[columns.position + i];
    if (!io::parse_number(field, point.p_e_m[static_cast<Eigen::Index>(i)])) return "'" + std::string{field} + "' is not a coordinate";
  }
  point.time = GpsTime::from_week_sow(static_cast<std::int64_t>(week), sow);
  return {};
}

/// One line of a TEX-CUP ground_truth.log; an empty string on success.
[[nodiscard]] inline std::string read_texcup_row(std::string_view line, TruthPoint& point) {
  const std::vector<std::string_view> words = io::split_words(line);
  if (words.size() < 6) return "the line is cut short: date, time, quality, latitude, longitude, height are needed";
  if (!io::detail::read_rtklib_time(words[0], words[1], true, point.time))
    return "'" + std::string{words[0]} + ' ' + std::string{words[1]} + "' is not a UTC date and time";
  double lat_deg = 0, lon_deg = 0, height_m = 0;
  if (!io::parse_number(words[3], lat_deg) || !io::parse_number(words[4], lon_deg) || !io::parse_number(words[5], height_m))
    return "latitude, longitude or height is not a number";
  if (std::abs(lat_deg) > 90 || std::abs(lon_deg) > 360) return "latitude or longitude lies outside its range";
  constexpr double rad = std::numbers::pi / 180;
  point.p_e_m = geodesy::ecef_from_geodetic({lat_deg * rad, lon_deg * rad, height_m});
  return {};
}

/// Moves a track without weeks to the weeks nearest a reference, and over the end of the week where time falls back.
inline void place_weeks(std::vector<TruthPoint>& points, GpsTime reference) {
  std::int64_t week = reference.week();
  if (!points.empty()) {
    const double ahead_s = points.front().time.sow() - reference.sow();
    if (ahead_s > kSecondsPerWeek / 2) --week;
    if (ahead_s < -kSecondsPerWeek / 2) ++week;
  }
  std::int64_t last_ns = 0;
  for (TruthPoint& point : points) {
    if (last_ns - point.time.ns > kNanosecondsPerWeek / 2) ++week;
    last_ns = point.time.ns;
    point.time.ns += week * kNanosecondsPerWeek;
  }
}

}  // namespace detail

/// Reads a truth from text; `name` is the file's name in errors. `reference` gives the week to a file that has none.
[[nodiscard]] inline io::FileResult<TruthTrack> parse_truth(std::string_view text, const std::string& name,
                                                            std::optional<GpsTime> reference = {}) {
  enum class Form { unknown, columns, texcup } form = Form::unknown;
  detail::TruthColumns columns;
  TruthTrack truth;
  io::LineReader lines{text};
  std::string_view line;
  std::vector<long> line_numbers;
  while (lines.next(line)) {
    const std::string_view content = io::trimmed(line);
    if (content.empty() || content.front() == '#') continue;
    std::string wrong;
    if (form == Form::unknown) {
      const std::string_view first = content.substr(0, content.find_first_of(", \t"));
      form = std::count(first.begin(), first.end(), '/') == 2 ? Form::texcup : Form::columns;
      double number = 0;
      if (form == Form::columns && !io::parse_number(first, number)) {
        wrong = detail::find_truth_columns(content, columns);
        if (!wrong.empty()) return io::Diagnostic{name, lines.number(), wrong, {}};
        continue;
      }
    }
    TruthPoint point;
    wrong = form == Form::texcup ? detail::read_texcup_row(content, point) : detail::read_truth_row(content, columns, point);
    const double radius_m = point.p_e_m.norm();
    if (wrong.empty() && (radius_m < 6.0e6 || radius_m > 5.0e7))
      wrong = "the position is not on or near the Earth: ECEF metres are expected";
    if (!wrong.empty()) return io::Diagnostic{name, lines.number(), wrong, {}};
    truth.points.push_back(point);
    line_numbers.push_back(lines.number());
  }
  if (truth.points.empty()) return io::Diagnostic{name, 0, "has no truth row", {}};
  if (form == Form::columns && !columns.week) {
    if (!reference) return io::Diagnostic{name, 0, "has no week column", "give a trajectory whose week can be used"};
    detail::place_weeks(truth.points, *reference);
  }
  for (std::size_t i = 1; i < truth.points.size(); ++i)
    if (truth.points[i].time <= truth.points[i - 1].time)
      return io::Diagnostic{name, line_numbers[i], "time does not rise", "sort the rows, each time once"};
  return truth;
}

/// Reads a truth file.
[[nodiscard]] inline io::FileResult<TruthTrack> read_truth(const std::string& path, std::optional<GpsTime> reference = {}) {
  const io::FileResult<std::string> text = io::read_text_file(path);
  if (!text) return text.error();
  return parse_truth(*text, path, reference);
}

}  // namespace searvins::examples
