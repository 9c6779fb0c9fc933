// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Position fixes with covariance from files, for the loosely coupled mode: RTKLIB's .pos, and bare tables week,sow,x,y,z[,sdx,sdy,sdz].
///
/// Where rtklib_solution.hpp reads a result to score it and refuses the file at the first bad line, this reader feeds a run: a bad line is
/// left out and counted. Layouts are those of rtklib_solution.hpp: GPST or UTC, calendar or week, degrees or ECEF, blanks or commas;
/// beside them the velocity columns vn, ve, vu (m/s) with their sdvn, sdve, sdvu.
///
/// A fix without a positive covariance gets the sigma of its quality, said in `skipped` under a reason of its own, though the fix itself stays:
///
///     quality    1 fix   2 float   3 sbas   4 dgps   5 single   6 ppp   7 dead reckoning
///     sigma, m   0.05    0.5       1.5      1.5      5          0.3     10                  (each axis)
#pragma once

#include <Eigen/Core>

#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <searvins/geodesy/wgs84.hpp>
#include <searvins/imu/position_fix.hpp>
#include <searvins/io/diagnostic.hpp>
#include <searvins/io/imu_columns.hpp>
#include <searvins/io/rtklib_solution.hpp>
#include <searvins/io/text_fields.hpp>

namespace searvins::io {

using imu::PositionFix;

/// Sigma of each axis that stands in for a missing covariance, metres.
[[nodiscard]] constexpr double assumed_sigma_m(int quality) {
  constexpr double sigmas[] = {10, 0.05, 0.5, 1.5, 1.5, 5, 0.3, 10};
  return quality >= 1 && quality <= 7 ? sigmas[quality] : sigmas[0];
}

namespace detail {

/// First fields of the velocity and of its sigmas in a .pos line; 0: none.
struct VelocityLayout {
  std::size_t velocity{0}, sigma{0};
};

[[nodiscard]] inline VelocityLayout velocity_layout(std::string_view names_line) {
  VelocityLayout layout;
  const std::vector<std::string_view> names = split_words(names_line.substr(1));
  for (std::size_t i = 1; i < names.size(); ++i) {
    const std::string_view name = names[i].substr(0, names[i].find('('));
    if (name == "vn" || name == "vx") layout.velocity = i + 1;
    if (name == "sdvn" || name == "sdvx") layout.sigma = i + 1;
  }
  return layout;
}

/// Velocity of a line, if it has one. The sigma is the root mean square of the three.
inline void read_velocity(const std::vector<std::string_view>& fields, const VelocityLayout& layout, bool geodetic, PositionFix& fix) {
  if (layout.velocity == 0 || layout.sigma == 0 || fields.size() < std::max(layout.velocity, layout.sigma) + 3) return;
  Eigen::Vector3d v, sd;
  for (std::size_t i = 0; i < 3; ++i)
    if (!parse_number(fields[layout.velocity + i], v[static_cast<Eigen::Index>(i)]) ||
        !parse_number(fields[layout.sigma + i], sd[static_cast<Eigen::Index>(i)]))
      return;
  const double sigma = sd.norm() / std::sqrt(3.0);
  if (!(sigma > 0)) return;
  const Eigen::Matrix3d R_ew = geodesy::ecef_from_enu(geodesy::geodetic_from_ecef(fix.position_e_m));
  fix.velocity_e_mps = geodetic ? Eigen::Vector3d{R_ew * Eigen::Vector3d{v[1], v[0], v[2]}} : v;
  fix.sigma_velocity_mps = sigma;
}

/// Gives the covariance of the quality to a fix that has none; true if it did.
inline bool assume_covariance(PositionFix& fix) {
  if (fix.covariance_e_m2.allFinite() && fix.covariance_e_m2.diagonal().minCoeff() > 0) return false;
  const double sigma = assumed_sigma_m(fix.quality);
  fix.covariance_e_m2 = sigma * sigma * Eigen::Matrix3d::Identity();
  fix.covariance_assumed = true;
  return true;
}

/// Reads a line of a .pos file; an empty string on success, else the reason for which it is left out.
[[nodiscard]] inline std::string read_pos_line(std::string_view line, const RtklibLayout& layout, const VelocityLayout& velocity, PositionFix& fix) {
  TrajectoryRow row;
  if (std::string wrong = read_rtklib_line(line, layout, row); !wrong.empty()) return "unreadable line: " + wrong;
  std::string spaced{line};
  for (char& c : spaced)
    if (c == ',') c = ' ';
  const std::vector<std::string_view> fields = split_words(spaced);
  fix.time = row.time;
  fix.position_e_m = row.p_e_m;
  fix.covariance_e_m2 = covariance_e_m2(row);
  fix.satellites = row.n_sat;
  if (!read_rtklib_count(fields[layout.quality], fix.quality)) return "unreadable line: no quality";
  read_velocity(fields, velocity, layout.geodetic, fix);
  return {};
}

/// Reads a line week,sow,x,y,z[,sdx,sdy,sdz]: positions of quality 1.
[[nodiscard]] inline std::string read_table_line(std::string_view line, PositionFix& fix) {
  const RowFields row{line};
  if (row.size() < 5) return "row with too few fields";
  ImuColumns time;
  time.week = 0, time.seconds = 1;
  if (!read_imu_time(row, time, NanosecondScale::gps, fix.time)) return "time that is no GPS time";
  Eigen::Vector3d sd = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < 3; ++i)
    if (!parse_number(row[2 + i], fix.position_e_m[static_cast<Eigen::Index>(i)])) return "field that is not a number";
  for (std::size_t i = 0; row.size() >= 8 && i < 3; ++i)
    if (!parse_number(row[5 + i], sd[static_cast<Eigen::Index>(i)])) return "field that is not a number";
  fix.covariance_e_m2 = Eigen::Matrix3d::Zero();
  fix.covariance_e_m2.diagonal() = sd.cwiseAbs2();
  fix.quality = 1;
  return {};
}

}  // namespace detail

/// Reads position fixes from text; `name` is the file's name in messages. Errors: no line that names the columns, a layout that is not positions in
/// degrees or ECEF, no usable line.
[[nodiscard]] inline Parsed<std::vector<PositionFix>> parse_pos_file(std::string_view text, const std::string& name) {
  Parsed<std::vector<PositionFix>> out;
  LineReader lines{text};
  detail::RtklibLayout layout;
  detail::VelocityLayout velocity;
  std::string_view line, names;
  bool ready = false, table = false;
  const auto keep = [&](PositionFix& fix) {
    const double radius_m = fix.position_e_m.norm();
    if (!(radius_m > 6.2e6 && radius_m < 5e7)) return out.skipped.add("position that is not near the Earth", lines.number());
    if (!out.value.empty() && fix.time == out.value.back().time) return out.skipped.add("repeated time stamp", lines.number());
    if (!out.value.empty() && fix.time < out.value.back().time)
      return out.skipped.add("time stamp before that of the row above", lines.number(), "sort the rows");
    if (detail::assume_covariance(fix))
      out.skipped.add("covariance missing, that of the quality assumed", lines.number(), "the fix is used; write out-outstat or sd columns to have its own");
    out.value.push_back(fix);
  };
  while (lines.next(line)) {
    line = trimmed(line);
    if (line.empty() || line.front() == '#') continue;
    if (line.front() == '%') {
      if (line.find("x-ecef(") != line.npos || line.find("latitude(") != line.npos || line.find("e-baseline(") != line.npos) names = line;
      continue;
    }
    if (!ready) {
      table = names.empty() && detail::count_numbers(line) >= 5;
      if (names.empty() && !table) {
        out.error = Diagnostic{name, lines.number(), "no comment line before the data names the columns", "set out-outhead=on"};
        return out;
      }
      if (std::string wrong = table ? std::string{} : detail::read_rtklib_layout(names, layout); !wrong.empty()) {
        out.error = Diagnostic{name, 0, std::move(wrong), {}};
        return out;
      }
      if (!table) velocity = detail::velocity_layout(names);
      ready = true;
    }
    PositionFix fix;
    const std::string wrong = table ? detail::read_table_line(line, fix) : detail::read_pos_line(line, layout, velocity, fix);
    if (wrong.empty())
      keep(fix);
    else
      out.skipped.add(wrong, lines.number());
  }
  if (out.value.empty()) out.error = Diagnostic{name, 0, "has no usable position", {}};
  return out;
}

/// Reads a file of position fixes. Errors: those of parse_pos_file; missing, empty, unreadable or compressed file, folder.
[[nodiscard]] inline Parsed<std::vector<PositionFix>> read_pos_file(const std::string& path) {
  const FileResult<std::string> text = read_text_file(path);
  if (text) return parse_pos_file(*text, path);
  Parsed<std::vector<PositionFix>> out;
  out.error = text.error();
  return out;
}

}  // namespace searvins::io
