// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// RTKLIB's solution text format (.pos), written so that RTKPLOT opens it and read so that its results can be scored.
///
///     Q     1 fix   2 float   4 dgps   5 single   7 dead reckoning            written
///           3 (sbas) is read as dgnss, 6 (ppp) as float: neither is ever written
///     sd*   standard deviations, metres, of the axes of the position columns (x y z, or n e u beside latitude and longitude)
///     sdxy  sign(c) sqrt(|c|) of the covariance c of the two axes, metres
///
/// Written: GPST as week and seconds of week, ECEF position, nine decimals of time because a state lies at the receiver's tag minus
/// its clock offset. Read: week and seconds or calendar date, GPST or UTC, ECEF or degrees with ellipsoidal height; columns are found
/// by the names in the last comment line before the data.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include <searvins/core/time.hpp>
#include <searvins/geodesy/wgs84.hpp>
#include <searvins/io/text_fields.hpp>
#include <searvins/io/trajectory.hpp>

namespace searvins::io {

/// RTKLIB's quality number of a status.
[[nodiscard]] constexpr int rtklib_quality(SolutionStatus status) {
  constexpr int quality[kSolutionStatuses] = {1, 2, 4, 5, 7};
  return quality[static_cast<std::size_t>(status)];
}

/// What the .pos file says beside the rows.
struct RtklibHeader {
  std::string program{"searvins"};         ///< "% program" line
  std::vector<std::string> input_files{};  ///< "% inp file" lines
  std::string reference{};                 ///< "% ref pos" line: base position as text; empty: no line
};

namespace detail {

[[nodiscard]] inline double signed_root(double c) { return c < 0 ? -std::sqrt(-c) : std::sqrt(c); }
[[nodiscard]] inline double signed_square(double s) { return s < 0 ? -s * s : s * s; }

/// Position covariance of a row in ECEF, m^2; zero where the row has none (RTKLIB's own habit for "unknown").
[[nodiscard]] inline Eigen::Matrix3d covariance_e_m2(const TrajectoryRow& row) {
  const Eigen::Matrix3d R_ew = geodesy::ecef_from_enu(geodesy::geodetic_from_ecef(row.p_e_m));
  const Eigen::Matrix3d c = R_ew * row.covariance_enu_m2() * R_ew.transpose();
  return c.allFinite() ? c : Eigen::Matrix3d::Zero().eval();
}

inline void append_padded(std::string& text, double value, int decimals, std::size_t width) { text += fixed_text(value, decimals, width); }

}  // namespace detail

/// The whole .pos file as text. `ratios` and `ages_s` are per row (ambiguity ratio, age of the base data); empty: zeros.
[[nodiscard]] inline std::string rtklib_solution(const std::vector<TrajectoryRow>& rows, const RtklibHeader& header = {},
                                                 const std::vector<double>& ratios = {}, const std::vector<double>& ages_s = {}) {
  std::string text = "% program   : " + header.program + '\n';
  for (const std::string& file : header.input_files) text += "% inp file  : " + file + '\n';
  if (!header.reference.empty()) text += "% ref pos   : " + header.reference + '\n';
  text += "%\n% (x/y/z-ecef=WGS84,Q=1:fix,2:float,3:sbas,4:dgps,5:single,6:ppp,7:dr,ns=# of satellites)\n";
  text +=
      "%  GPST                x-ecef(m)      y-ecef(m)      z-ecef(m)   Q  ns   sdx(m)   sdy(m)   sdz(m)  sdxy(m)  sdyz(m)  sdzx(m) age(s) "
      " ratio\n";
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const TrajectoryRow& row = rows[i];
    std::string sow;
    detail::append_sow(sow, row.time);
    text += std::to_string(row.time.week()) + ' ' + std::string(sow.size() < 16 ? 16 - sow.size() : 0, ' ') + sow;
    for (int k = 0; k < 3; ++k) detail::append_padded(text, row.p_e_m[k], 4, 15);
    text += "   " + std::to_string(rtklib_quality(row.status));
    const std::string satellites = std::to_string(std::max(0, row.n_sat));
    text += std::string(satellites.size() < 4 ? 4 - satellites.size() : 0, ' ') + satellites;
    const Eigen::Matrix3d c = detail::covariance_e_m2(row);
    for (int k = 0; k < 3; ++k) detail::append_padded(text, detail::signed_root(std::max(0.0, c(k, k))), 4, 9);
    for (const double covariance : {c(0, 1), c(1, 2), c(2, 0)}) detail::append_padded(text, detail::signed_root(covariance), 4, 9);
    detail::append_padded(text, i < ages_s.size() && std::isfinite(ages_s[i]) ? ages_s[i] : 0.0, 2, 7);
    detail::append_padded(text, i < ratios.size() && std::isfinite(ratios[i]) ? std::min(ratios[i], 999.9) : 0.0, 1, 7);
    text += '\n';
  }
  return text;
}

namespace detail {

/// Where the columns of a .pos file are. The time takes two fields of a data line but one name of the header.
struct RtklibLayout {
  bool utc{false}, geodetic{false};
  std::size_t position{0}, quality{0}, satellites{0}, sigma{0};  ///< first field of each; sigma 0: none
};

/// Reads the header line of names; an empty string on success, else what is wrong with it.
[[nodiscard]] inline std::string read_rtklib_layout(std::string_view line, RtklibLayout& layout) {
  const std::vector<std::string_view> names = split_words(line.substr(1));
  if (names.empty() || (names[0] != "GPST" && names[0] != "UTC"))
    return "the time of a .pos file must be GPST or UTC: set out-timesys=gpst";
  layout.utc = names[0] == "UTC";
  for (std::size_t i = 1; i < names.size(); ++i) {
    const std::string_view name = names[i].substr(0, names[i].find('('));
    const std::size_t field = i + 1;
    if (names[i] == "latitude(d'\")") return "latitude and longitude are in degrees, minutes, seconds: set out-degform=deg";
    if (name == "x-ecef" || name == "latitude") layout.position = field, layout.geodetic = name == "latitude";
    if (name == "e-baseline") return "the positions are relative to the base: set out-solformat=xyz";
    if (name == "Q") layout.quality = field;
    if (name == "ns") layout.satellites = field;
    if (name == "sdx" || name == "sdn") layout.sigma = field;
  }
  return layout.position && layout.quality ? std::string{} : "the header line names no position or no quality column";
}

/// Reads the two fields of time: week and seconds, or date and time of day.
[[nodiscard]] inline bool read_rtklib_time(std::string_view first, std::string_view second, bool utc, GpsTime& out) {
  std::int64_t week = 0;
  double sow = 0;
  if (parse_integer(first, week) && parse_number(second, sow)) {
    if (week < 0 || week > 9999 || sow < 0 || sow >= kSecondsPerWeek + 1) return false;
    out = GpsTime::from_week_sow(week, sow);
  } else {
    const std::vector<std::string_view> date = split(first, '/'), clock = split(second, ':');
    std::int64_t year = 0, month = 0, day = 0, hour = 0, minute = 0;
    double second_of_minute = 0;
    if (date.size() != 3 || clock.size() != 3 || !parse_integer(date[0], year) || !parse_integer(date[1], month) ||
        !parse_integer(date[2], day))
      return false;
    if (!parse_integer(clock[0], hour) || !parse_integer(clock[1], minute) || !parse_number(clock[2], second_of_minute)) return false;
    if (year < 1980 || year > 2200 || month < 1 || month > 12 || day < 1 || day > 31 || hour < 0 || hour > 23 || minute < 0 || minute > 59)
      return false;
    if (second_of_minute < 0 || second_of_minute >= 61) return false;
    const CivilTime civil{static_cast<int>(year), static_cast<int>(month),  static_cast<int>(day),
                          static_cast<int>(hour), static_cast<int>(minute), second_of_minute};
    out = gps_from_civil(civil);
  }
  // The civil reading of a UTC clock, taken as GPS time, is behind by the leap seconds; Unix time says the same thing.
  if (utc) out = to_gps(UtcTime{out.ns + kGpsEpochUnixDays * kSecondsPerDay * kNanosecondsPerSecond});
  return true;
}

/// Reads the covariance fields into the row; leaves it unknown when they are absent, malformed or all zero.
inline void read_rtklib_covariance(const std::vector<double>& sd, bool geodetic, TrajectoryRow& row) {
  if (sd.size() != 6 || !(sd[0] > 0 && sd[1] > 0 && sd[2] > 0)) return;
  Eigen::Matrix3d c;
  c << sd[0] * sd[0], signed_square(sd[3]), signed_square(sd[5]),  //
      signed_square(sd[3]), sd[1] * sd[1], signed_square(sd[4]),   //
      signed_square(sd[5]), signed_square(sd[4]), sd[2] * sd[2];
  if (geodetic) {  // north, east, up -> east, north, up
    Eigen::Matrix3d swap;
    swap << 0, 1, 0, 1, 0, 0, 0, 0, 1;
    row.set_covariance_enu_m2(swap * c * swap.transpose());
    return;
  }
  const Eigen::Matrix3d R_ew = geodesy::ecef_from_enu(geodesy::geodetic_from_ecef(row.p_e_m));
  row.set_covariance_enu_m2(R_ew.transpose() * c * R_ew);
}

/// Reads a quality or a count, which some programs write as 1.0000000.
[[nodiscard]] inline bool read_rtklib_count(std::string_view field, int& out) {
  double value = 0;
  if (!parse_number(field, value) || value != std::floor(value) || value < 0 || value > 999) return false;
  out = static_cast<int>(value);
  return true;
}

/// Reads one data line; an empty string on success, else what is wrong with it.
[[nodiscard]] inline std::string read_rtklib_line(std::string_view line, const RtklibLayout& layout, TrajectoryRow& row) {
  std::string spaced{line};
  std::replace(spaced.begin(), spaced.end(), ',', ' ');
  const std::vector<std::string_view> fields = split_words(spaced);
  if (fields.size() <= std::max(layout.position + 2, layout.quality)) return "the line is cut short";
  if (!read_rtklib_time(fields[0], fields[1], layout.utc, row.time))
    return "'" + std::string{fields[0]} + ' ' + std::string{fields[1]} + "' is not a time";
  double p[3];
  for (std::size_t i = 0; i < 3; ++i)
    if (!parse_number(fields[layout.position + i], p[i])) return "'" + std::string{fields[layout.position + i]} + "' is not a coordinate";
  constexpr double rad = std::numbers::pi / 180;
  row.p_e_m = layout.geodetic ? geodesy::ecef_from_geodetic({p[0] * rad, p[1] * rad, p[2]}) : Eigen::Vector3d{p[0], p[1], p[2]};
  int quality = 0;
  constexpr SolutionStatus statuses[] = {SolutionStatus::fix, SolutionStatus::float_, SolutionStatus::dgnss, SolutionStatus::dgnss,
                                         SolutionStatus::spp, SolutionStatus::float_, SolutionStatus::dr};
  if (!read_rtklib_count(fields[layout.quality], quality) || quality < 1 || quality > 7)
    return "'" + std::string{fields[layout.quality]} + "' is not a quality of 1..7";
  row.status = statuses[quality - 1];
  if (layout.satellites && layout.satellites < fields.size() && !read_rtklib_count(fields[layout.satellites], row.n_sat)) row.n_sat = -1;
  std::vector<double> sd;
  for (std::size_t i = layout.sigma; layout.sigma && i < layout.sigma + 6 && i < fields.size(); ++i) {
    double value = 0;
    if (parse_number(fields[i], value)) sd.push_back(value);
  }
  read_rtklib_covariance(sd, layout.geodetic, row);
  return {};
}

}  // namespace detail

/// Reads a .pos file from text; `name` is the file's name in errors.
[[nodiscard]] inline FileResult<std::vector<TrajectoryRow>> parse_rtklib_solution(std::string_view text, const std::string& name) {
  LineReader lines{text};
  detail::RtklibLayout layout;
  std::vector<TrajectoryRow> rows;
  std::string_view line, names;
  long names_line = 0;
  while (lines.next(line)) {
    if (line.empty() || line.front() == '%') {
      if (line.find("x-ecef(") != line.npos || line.find("latitude(") != line.npos || line.find("e-baseline(") != line.npos)
        names = line, names_line = lines.number();
      continue;
    }
    if (trimmed(line).empty()) continue;
    if (names.empty()) return Diagnostic{name, lines.number(), "no comment line before the data names the columns", "set out-outhead=on"};
    if (rows.empty())
      if (std::string wrong = detail::read_rtklib_layout(names, layout); !wrong.empty())
        return Diagnostic{name, names_line, std::move(wrong), {}};
    TrajectoryRow row;
    if (std::string wrong = detail::read_rtklib_line(line, layout, row); !wrong.empty())
      return Diagnostic{name, lines.number(), std::move(wrong), {}};
    if (!rows.empty() && row.time <= rows.back().time)
      return Diagnostic{name, lines.number(), "time does not rise", "sort the rows, each time once"};
    rows.push_back(row);
  }
  if (rows.empty()) return Diagnostic{name, 0, "has no solution line", {}};
  return rows;
}

/// Reads a .pos file.
[[nodiscard]] inline FileResult<std::vector<TrajectoryRow>> read_rtklib_solution(const std::string& path) {
  const FileResult<std::string> text = read_text_file(path);
  if (!text) return text.error();
  return parse_rtklib_solution(*text, path);
}

}  // namespace searvins::io
