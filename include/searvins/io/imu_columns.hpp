// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Rows of IMU logs: where the fields of a line are and what they mean, for the three sorts of log that are read.
///
///     LORD     week, whole_seconds, fractional_seconds, ax, ay, az, gx, gy, gz          (the TEX-CUP log: acceleration first)
///     CSV      t, gx, gy, gz, ax, ay, az        without a header line, else in any order under the names of read_imu_header
///     EuRoC    timestamp [ns], w_RS_S_x, ..., a_RS_S_z
///
/// A time never passes through a double when its field is a plain decimal: "553950" and "0.01" are 553950010000000 ns exactly.
#pragma once

#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <string>
#include <string_view>

#include <searvins/core/time.hpp>
#include <searvins/imu/imu_sample.hpp>
#include <searvins/io/fixed_field.hpp>
#include <searvins/io/text_fields.hpp>

namespace searvins::io {

inline constexpr double kStandardGravityMps2 = 9.80665;  ///< the g of data sheets and of logs in g

/// Where the fields of a row are, and the factors that turn them into SI units.
struct ImuColumns {
  static constexpr std::size_t kNone = SIZE_MAX;
  std::size_t week{kNone}, seconds{kNone}, fraction{kNone}, nanoseconds{kNone};  ///< either nanoseconds, or seconds with what else there is
  std::array<std::size_t, 3> gyro{kNone, kNone, kNone}, accel{kNone, kNone, kNone};
  double gyro_scale{1}, accel_scale{1};
  std::size_t fields{0};  ///< fields of a whole row

  [[nodiscard]] static ImuColumns lord() { return {0, 1, 2, kNone, {6, 7, 8}, {3, 4, 5}, 1, 1, 9}; }
  [[nodiscard]] static ImuColumns seven() { return {kNone, 0, kNone, kNone, {1, 2, 3}, {4, 5, 6}, 1, 1, 7}; }
};

/// What nanosecond stamps count.
enum class NanosecondScale : std::uint8_t {
  unix_utc,  ///< since 1970-01-01 UTC, as EuRoC and TEX-CUP have them
  gps        ///< since 1980-01-06, GPS time, as the simulator writes
};

/// The fields of a row, without allocation; more than kMost fields are counted but not kept.
class RowFields {
 public:
  static constexpr std::size_t kMost = 32;
  explicit RowFields(std::string_view line) {
    for (std::size_t begin = 0;;) {
      const std::size_t end = line.find(',', begin);
      if (count_ < kMost) fields_[count_] = trimmed(line.substr(begin, end == std::string_view::npos ? end : end - begin));
      ++count_;
      if (end == std::string_view::npos) return;
      begin = end + 1;
    }
  }
  [[nodiscard]] std::size_t size() const { return count_; }
  [[nodiscard]] std::string_view operator[](std::size_t i) const { return i < count_ && i < kMost ? fields_[i] : std::string_view{}; }

 private:
  std::array<std::string_view, kMost> fields_{};
  std::size_t count_{0};
};

namespace detail {

/// A column's name in lower case with underscores, without its unit; the unit as a factor to SI.
struct ColumnName {
  std::string base;
  double scale{1};
};

[[nodiscard]] inline ColumnName column_name(std::string_view text) {
  std::string name;
  for (const char c : text) name += std::isalnum(static_cast<unsigned char>(c)) ? static_cast<char>(std::tolower(static_cast<unsigned char>(c))) : '_';
  const std::size_t bracket = std::min(text.find('['), text.find('('));
  ColumnName column{name.substr(0, bracket), 1};
  const std::string unit = bracket == std::string_view::npos ? std::string{} : name.substr(bracket + 1);
  while (!column.base.empty() && column.base.back() == '_') column.base.pop_back();
  constexpr double rad = std::numbers::pi / 180;
  struct Unit {
    std::string_view suffix;
    double scale;
  };
  for (const Unit& u : {Unit{"_mps2", 1}, Unit{"_m_s2", 1}, Unit{"_m_s_2", 1}, Unit{"_radps", 1}, Unit{"_rad_s", 1}, Unit{"_dps", rad}, Unit{"_degps", rad},
                        Unit{"_deg_s", rad}, Unit{"_mg", kStandardGravityMps2 / 1000}, Unit{"_g", kStandardGravityMps2}})
    if (column.base.ends_with(u.suffix)) {
      column.base.resize(column.base.size() - u.suffix.size());
      column.scale = u.scale;
      return column;
    }
  if (unit.starts_with("deg") || unit.starts_with("dps")) column.scale = rad;
  if (unit.starts_with("g_")) column.scale = kStandardGravityMps2;
  if (unit.starts_with("mg_")) column.scale = kStandardGravityMps2 / 1000;
  return column;
}

/// Which axis of `stems` a name means: "gyro_y" with the stem "gyro_" is 1; 3 for none.
template <std::size_t N>
[[nodiscard]] std::size_t axis_of(std::string_view name, const std::array<std::string_view, N>& stems) {
  if (name.empty() || name.back() < 'x' || name.back() > 'z') return 3;
  const std::string_view stem = name.substr(0, name.size() - 1);
  return std::find(stems.begin(), stems.end(), stem) != stems.end() ? static_cast<std::size_t>(name.back() - 'x') : 3;
}

/// A decimal number of seconds as nanoseconds, exactly where it is written without an exponent.
[[nodiscard]] inline bool seconds_as_ns(std::string_view text, std::int64_t& out) {
  if (read_nanoseconds(text, out) == FieldState::number) return true;
  double value = 0;
  if (!parse_number(text, value) || !(std::abs(value) < 4.5e9)) return false;
  out = nanoseconds_from_seconds(value);
  return true;
}

}  // namespace detail

/// Reads a header line (a leading # is dropped); an empty string on success, else what is missing.
///
/// Time: t, time, sow, tow or t_gps_sow (also with _s), with week or gps_week beside it or not, or timestamp (nanoseconds). Gyroscope: gx, wx, gyro_x,
/// w_x, w_RS_S_x and their like; accelerometer: ax, accel_x, acc_x, a_x, a_RS_S_x. A unit may follow the name: _g, _mg, _dps, [deg/s] are converted.
[[nodiscard]] inline std::string read_imu_header(std::string_view line, ImuColumns& out) {
  constexpr std::array<std::string_view, 8> gyro_stems{"g", "w", "gyro_", "gyr_", "gyro", "w_", "w_rs_s_", "angular_velocity_"};
  constexpr std::array<std::string_view, 7> accel_stems{"a", "acc_", "accel_", "acc", "a_", "a_rs_s_", "linear_acceleration_"};
  line = trimmed(line);
  while (!line.empty() && line.front() == '#') line = trimmed(line.substr(1));
  const RowFields names{line};
  ImuColumns c;
  c.fields = names.size();
  for (std::size_t i = 0; i < std::min(names.size(), RowFields::kMost); ++i) {
    const detail::ColumnName column = detail::column_name(names[i]);
    const std::string& name = column.base;
    if (name == "week" || name == "gps_week") c.week = i;
    const bool seconds = name == "t" || name == "t_s" || name == "time" || name == "time_s" || name == "sow" || name == "sow_s" || name == "tow" ||
                         name == "tow_s" || name == "gps_tow_s" || name == "t_gps_sow";
    if (seconds && c.seconds == ImuColumns::kNone) c.seconds = i;
    if (name == "timestamp" || name == "timestamp_ns" || name == "t_ns") c.nanoseconds = i;
    if (const std::size_t axis = detail::axis_of(name, gyro_stems); axis < 3) c.gyro[axis] = i, c.gyro_scale = column.scale;
    if (const std::size_t axis = detail::axis_of(name, accel_stems); axis < 3) c.accel[axis] = i, c.accel_scale = column.scale;
  }
  if (c.seconds == ImuColumns::kNone && c.nanoseconds == ImuColumns::kNone) return "no time column (t, sow, tow_s or timestamp)";
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const char letter = "xyz"[axis];
    if (c.gyro[axis] == ImuColumns::kNone) return std::string{"no gyroscope column g"} + letter + " (or gyro_" + letter + ')';
    if (c.accel[axis] == ImuColumns::kNone) return std::string{"no accelerometer column a"} + letter + " (or accel_" + letter + ')';
  }
  out = c;
  return {};
}

/// The time of a row. Without a week column seconds up to 604800 are seconds of week 0, more are seconds since 1980-01-06. False: no time.
[[nodiscard]] inline bool read_imu_time(const RowFields& row, const ImuColumns& c, NanosecondScale scale, GpsTime& out) {
  std::int64_t ns = 0, week = 0, fraction = 0;
  if (c.nanoseconds != ImuColumns::kNone) {
    if (!parse_integer(row[c.nanoseconds], ns) || ns < 0 || ns > 6'000'000'000'000'000'000) return false;
    out = scale == NanosecondScale::gps ? GpsTime{ns} : to_gps(UtcTime{ns});
    return true;
  }
  if (!detail::seconds_as_ns(row[c.seconds], ns)) return false;
  if (c.fraction != ImuColumns::kNone && !detail::seconds_as_ns(row[c.fraction], fraction)) return false;
  if (c.week != ImuColumns::kNone) {
    double weeks = 0;
    if (!parse_number(row[c.week], weeks) || !(weeks >= 0 && weeks <= 9999) || weeks != std::floor(weeks)) return false;
    week = static_cast<std::int64_t>(weeks);
    if (ns < 0 || ns > 2 * kNanosecondsPerWeek) return false;
  }
  if (ns < 0 || fraction < 0 || fraction >= 2 * kNanosecondsPerSecond) return false;
  out = {week * kNanosecondsPerWeek + ns + fraction};
  return true;
}

/// Reads a row; an empty string on success, else the reason for which it is left out.
[[nodiscard]] inline const char* read_imu_row(std::string_view line, const ImuColumns& c, NanosecondScale scale, imu::ImuSample& out) {
  const RowFields row{line};
  if (row.size() < c.fields) return "row with too few fields";
  if (row.size() > c.fields) return "row with too many fields";
  if (!read_imu_time(row, c, scale, out.time)) return "time that is no GPS time";
  const auto read = [&row](std::size_t at, double& value) {
    if (parse_number(row[at], value)) return "";
    const std::string_view text = row[at];
    const bool named = text.find("nan") != text.npos || text.find("NaN") != text.npos || text.find("NAN") != text.npos || text.find("inf") != text.npos ||
                       text.find("Inf") != text.npos;
    return named ? "NaN or infinity" : "field that is not a number";
  };
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<Eigen::Index>(axis);
    if (const char* wrong = read(c.gyro[axis], out.gyro_b_radps[i]); *wrong) return wrong;
    if (const char* wrong = read(c.accel[axis], out.accel_b_mps2[i]); *wrong) return wrong;
  }
  out.gyro_b_radps *= c.gyro_scale;
  out.accel_b_mps2 *= c.accel_scale;
  return "";
}

}  // namespace searvins::io
