// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Readings of inertial units in CSV files whose header uses long names, as the forms that the library's IMU reader takes.
///
///     time            GPS TOW (s) with GPS Week, or field.header.stamp (UTC nanoseconds since 1970)
///     acceleration    Acc X (m/s^2), Acceleration X(m/s^2), field.linear_acceleration.x
///     angular rate    Ang Rate X (deg/s), Angular rate X(rad/s), field.angular_velocity.x      a unit with deg is converted
///
/// Names are compared without case, blanks and signs; other columns are passed over. Readings keep their axes. The text that comes out is
/// week,sow,gx,gy,gz,ax,ay,az with nine decimals of a second.
#pragma once

#include <array>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <searvins/core/time.hpp>
#include <searvins/io/diagnostic.hpp>
#include <searvins/io/file_result.hpp>
#include <searvins/io/imu_log.hpp>
#include <searvins/io/text_fields.hpp>
#include <searvins/io/text_reader.hpp>

#include "examples/support/truth.hpp"

namespace searvins::examples {

/// Readings, and what was left out.
struct NamedReadings {
  io::ImuLog log{};
  io::SkipLog skipped{};
};

namespace detail {

/// Where the fields of a row are.
struct NamedImuColumns {
  static constexpr std::size_t kNone = SIZE_MAX;
  std::size_t week{kNone}, seconds{kNone}, stamp_ns{kNone}, fields{0};
  std::array<std::size_t, 3> accel{kNone, kNone, kNone}, gyro{kNone, kNone, kNone};
  bool gyro_in_degrees{false};
};

/// Finds the columns; an empty string on success, else what is missing.
[[nodiscard]] inline std::string find_named_columns(std::string_view header, NamedImuColumns& c) {
  const std::vector<std::string_view> names = io::split(header, ',');
  c.fields = names.size();
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::string name = plain_name(names[i]);
    if (name == "gps_week" || name == "week") c.week = i;
    if (name == "gps_tow_s" || name == "tow_s") c.seconds = i;
    if (name == "field_header_stamp") c.stamp_ns = i;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::string letter(1, "xyz"[axis]);
      for (const char* stem : {"acc_", "acceleration_", "field_linear_acceleration_"})
        if (name == stem + letter || name == stem + letter + "_m_s_2") c.accel[axis] = i;
      for (const char* stem : {"ang_rate_", "angular_rate_", "field_angular_velocity_"})
        if (name == stem + letter || name == stem + letter + "_rad_s" || name == stem + letter + "_deg_s") {
          c.gyro[axis] = i;
          c.gyro_in_degrees = name.ends_with("_deg_s");
        }
    }
  }
  const auto missing = [](const char* what, std::size_t axis) { return std::string{what} + ' ' + "XYZ"[axis]; };
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (c.accel[axis] == NamedImuColumns::kNone) return missing("acceleration", axis);
    if (c.gyro[axis] == NamedImuColumns::kNone) return missing("angular rate", axis);
  }
  const bool has_sow = c.seconds != NamedImuColumns::kNone && c.week != NamedImuColumns::kNone;
  return has_sow || c.stamp_ns != NamedImuColumns::kNone ? "" : "time (GPS TOW with GPS Week, or field.header.stamp)";
}

/// One row; an empty text on success, else why it is left out.
[[nodiscard]] inline const char* read_named_row(std::string_view line, const NamedImuColumns& c, imu::ImuSample& out) {
  const std::vector<std::string_view> fields = io::split(line, ',');
  if (fields.size() < c.fields) return "row with too few fields";
  if (c.stamp_ns != NamedImuColumns::kNone) {
    std::int64_t ns = 0;
    if (!io::parse_integer(fields[c.stamp_ns], ns) || ns <= 0 || ns > 6'000'000'000'000'000'000) return "stamp that is no time";
    out.time = to_gps(UtcTime{ns});
  } else {
    double week = 0;
    std::int64_t ns = 0;
    if (!io::parse_number(fields[c.week], week) || !(week >= 0 && week <= 9999) || !io::detail::seconds_as_ns(fields[c.seconds], ns) ||
        ns < 0 || ns > 2 * kNanosecondsPerWeek)
      return "time that is no GPS time";
    out.time = {static_cast<std::int64_t>(week) * kNanosecondsPerWeek + ns};
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<Eigen::Index>(axis);
    if (!io::parse_number(fields[c.accel[axis]], out.accel_b_mps2[i]) || !io::parse_number(fields[c.gyro[axis]], out.gyro_b_radps[i]))
      return "field that is not a number";
  }
  if (c.gyro_in_degrees) out.gyro_b_radps *= std::numbers::pi / 180;
  return "";
}

}  // namespace detail

/// Reads a file. Errors: missing file, a header without the columns (with its line), no usable row.
[[nodiscard]] inline io::FileResult<NamedReadings> read_named_imu(const std::filesystem::path& path) {
  io::TextReader reader;
  if (auto wrong = reader.open(path)) return *wrong;
  NamedReadings out;
  detail::NamedImuColumns columns;
  std::string_view line;
  bool has_header = false;
  while (reader.next(line)) {
    if (io::trimmed(line).empty()) continue;
    if (!has_header) {
      const std::string missing = detail::find_named_columns(line, columns);
      if (!missing.empty())
        return io::Diagnostic{path.string(), reader.line_number(), "the header names no column of the " + missing,
                              "the first line must be the published header: get the file again"};
      has_header = true;
      continue;
    }
    imu::ImuSample sample;
    const char* wrong = detail::read_named_row(line, columns, sample);
    if (!*wrong && !out.log.samples.empty() && sample.time <= out.log.samples.back().time) wrong = "time that does not rise";
    if (*wrong)
      out.skipped.add(wrong, reader.line_number());
    else
      out.log.samples.push_back(sample);
  }
  if (out.log.samples.empty()) return io::Diagnostic{path.string(), 0, "has no usable reading", "get the file again"};
  out.log.has_week = true;
  io::detail::find_imu_gaps(out.log);
  out.log.findings = io::check_imu_units(out.log.samples, path.string(), false);
  return out;
}

/// The readings as CSV for the library's reader.
[[nodiscard]] inline std::string imu_csv(const std::vector<imu::ImuSample>& samples) {
  std::string text = "week,sow,gx,gy,gz,ax,ay,az\n";
  text.reserve(samples.size() * 96 + text.size());
  char row[256];
  for (const imu::ImuSample& s : samples) {
    const std::int64_t ns = s.time.ns_of_week();
    const Eigen::Vector3d &w = s.gyro_b_radps, &f = s.accel_b_mps2;
    std::snprintf(row, sizeof row, "%lld,%lld.%09lld,%.9f,%.9f,%.9f,%.8f,%.8f,%.8f\n", static_cast<long long>(s.time.week()),
                  static_cast<long long>(ns / kNanosecondsPerSecond), static_cast<long long>(ns % kNanosecondsPerSecond), w.x(), w.y(),
                  w.z(), f.x(), f.y(), f.z());
    text += row;
  }
  return text;
}

/// Reference positions as CSV for read_truth().
[[nodiscard]] inline std::string truth_csv(const std::vector<TruthPoint>& points) {
  std::string text = "week,sow,ant_x,ant_y,ant_z\n";
  char row[160];
  for (const TruthPoint& p : points) {
    const std::int64_t ns = p.time.ns_of_week();
    std::snprintf(row, sizeof row, "%lld,%lld.%09lld,%.4f,%.4f,%.4f\n", static_cast<long long>(p.time.week()),
                  static_cast<long long>(ns / kNanosecondsPerSecond), static_cast<long long>(ns % kNanosecondsPerSecond), p.p_e_m.x(),
                  p.p_e_m.y(), p.p_e_m.z());
    text += row;
  }
  return text;
}

}  // namespace searvins::examples
