// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Centre lines of lanes from a table with one point a row, in the order along the line:
///
///     line,lat_deg,lon_deg,height_m
///     7,37.7740,-122.4310,12.5
///
/// The first row names the columns; blank lines and those that begin with # are passed over. Rows of the same number that follow one another are one line.
/// A map is not guessed at: the first bad row refuses the file. Heights are of the ellipsoid; they need to be good to some ten metres only, because
/// matching is level (imu/centreline.hpp).
#pragma once

#include <cmath>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

#include <searvins/geodesy/wgs84.hpp>
#include <searvins/imu/centreline.hpp>
#include <searvins/io/diagnostic.hpp>
#include <searvins/io/file_result.hpp>
#include <searvins/io/text_fields.hpp>

namespace searvins::io {

namespace detail {

/// Reads one row; an empty string on success, else what is wrong.
[[nodiscard]] inline std::string read_centreline_row(std::string_view row, imu::CentrelinePoint& point) {
  const std::vector<std::string_view> fields = split(row, ',');
  if (fields.size() < 4) return "row with fewer than four fields";
  std::int64_t line = 0;
  double lat_deg = 0, lon_deg = 0, height_m = 0;
  if (!parse_integer(trimmed(fields[0]), line) || line < 0 || line > 0xffffffffLL) return "the line's number is no whole number of 0 .. 4294967295";
  if (!parse_number(trimmed(fields[1]), lat_deg) || !parse_number(trimmed(fields[2]), lon_deg) || !parse_number(trimmed(fields[3]), height_m))
    return "field that is not a number";
  if (!(std::abs(lat_deg) <= 90) || !(std::abs(lon_deg) <= 360) || !(std::abs(height_m) < 1e4)) return "no place on Earth: degrees and metres are asked for";
  constexpr double kRad = std::numbers::pi / 180;
  point = {geodesy::ecef_from_geodetic({lat_deg * kRad, lon_deg * kRad, height_m}), static_cast<std::uint32_t>(line)};
  return {};
}

}  // namespace detail

/// Reads centre lines from text; `name` is the file's name in messages. Errors: a first row without the four columns, a bad row, no line of two points.
[[nodiscard]] inline FileResult<std::vector<imu::CentrelinePoint>> parse_centrelines(std::string_view text, const std::string& name) {
  constexpr std::string_view kColumns = "line,lat_deg,lon_deg,height_m";
  std::vector<imu::CentrelinePoint> points;
  LineReader lines{text};
  std::string_view row;
  bool has_columns = false, has_segment = false;
  while (lines.next(row)) {
    row = trimmed(row);
    if (row.empty() || row.front() == '#') continue;
    if (!has_columns) {
      if (row != kColumns) return Diagnostic{name, lines.number(), "the first row does not name the columns", "begin with " + std::string{kColumns}};
      has_columns = true;
      continue;
    }
    imu::CentrelinePoint point;
    if (const std::string wrong = detail::read_centreline_row(row, point); !wrong.empty())
      return Diagnostic{name, lines.number(), wrong, "rows are " + std::string{kColumns}};
    has_segment = has_segment || (!points.empty() && points.back().line == point.line);
    points.push_back(point);
  }
  if (!has_segment) return Diagnostic{name, 0, "holds no line of two points", "rows of a line follow one another and have the same number"};
  return points;
}

/// The same from a file. Errors besides: the file cannot be read.
[[nodiscard]] inline FileResult<std::vector<imu::CentrelinePoint>> read_centrelines(const std::string& path) {
  FileResult<std::string> text = read_text_file(path);
  if (!text) return text.error();
  return parse_centrelines(*text, path);
}

}  // namespace searvins::io
