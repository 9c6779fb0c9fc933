// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// A trajectory for other programs: KML for map viewers, TUM text for evo.
///
/// TUM lines are `t x y z qx qy qz qw`: t GPS seconds since 1980-01-06 (no leap seconds), the antenna's position in the local
/// East-North-Up frame w of an origin, and R_wb of the body as right-forward-up. With roll r, pitch p, heading h (forward-right-down
/// angles, heading clockwise from north) and S the matrix that swaps the first two axes and negates the third,
///
///     R_wb = S Rz(h) Ry(p) Rx(r) S
///
/// A row without attitude gets the identity: evo then still compares translations.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <searvins/geodesy/local_frame.hpp>
#include <searvins/io/trajectory.hpp>

namespace searvins::io {

/// R_wb of the body as right-forward-up from forward-right-down angles in degrees.
[[nodiscard]] inline Eigen::Matrix3d R_wb_from_angles(double roll_deg, double pitch_deg, double heading_deg) {
  constexpr double rad = std::numbers::pi / 180;
  Eigen::Matrix3d S;
  S << 0, 1, 0, 1, 0, 0, 0, 0, -1;
  const Eigen::Matrix3d R_ned_frd =
      (Eigen::AngleAxisd{heading_deg * rad, Eigen::Vector3d::UnitZ()} * Eigen::AngleAxisd{pitch_deg * rad, Eigen::Vector3d::UnitY()} *
       Eigen::AngleAxisd{roll_deg * rad, Eigen::Vector3d::UnitX()})
          .toRotationMatrix();
  return S * R_ned_frd * S;
}

/// The whole trajectory_tum.txt as text, in the local frame at `origin_e_m`.
[[nodiscard]] inline std::string trajectory_tum(const std::vector<TrajectoryRow>& rows, const Eigen::Vector3d& origin_e_m) {
  const geodesy::LocalFrame w = geodesy::LocalFrame::at(origin_e_m);
  std::string text = "# t_gps_s east_m north_m up_m qx qy qz qw, origin ECEF";
  for (int i = 0; i < 3; ++i) append_fixed(text += ' ', origin_e_m[i], 4);
  text += '\n';
  for (const TrajectoryRow& row : rows) {
    if (!row.p_e_m.allFinite()) continue;
    const std::string fraction = std::to_string(row.time.ns % kNanosecondsPerSecond);
    text += std::to_string(row.time.ns / kNanosecondsPerSecond) + '.' + std::string(9 - fraction.size(), '0') + fraction;
    const Eigen::Vector3d p_w_m = w.to_local(row.p_e_m);
    for (int i = 0; i < 3; ++i) append_fixed(text += ' ', p_w_m[i], 5);
    Eigen::Quaterniond q_wb = Eigen::Quaterniond::Identity();
    if (std::isfinite(row.roll_deg + row.pitch_deg + row.heading_deg))
      q_wb = Eigen::Quaterniond{R_wb_from_angles(row.roll_deg, row.pitch_deg, row.heading_deg)};
    for (const double c : {q_wb.x(), q_wb.y(), q_wb.z(), q_wb.w()}) append_fixed(text += ' ', c, 8);
    text += '\n';
  }
  return text;
}

namespace detail {

/// KML colour of a status, aabbggrr.
[[nodiscard]] constexpr const char* kml_color(SolutionStatus status) {
  constexpr const char* colors[kSolutionStatuses] = {"ff4f9e1b", "ff1f8ff0", "ffd9772b", "ff5a3ad6", "ff9a8a80"};
  return colors[static_cast<std::size_t>(status)];
}

/// A gap longer than this breaks the line: three times the median interval.
[[nodiscard]] inline double break_interval_s(const std::vector<TrajectoryRow>& rows) {
  std::vector<double> intervals;
  for (std::size_t i = 1; i < rows.size(); ++i) intervals.push_back(seconds_between(rows[i - 1].time, rows[i].time));
  if (intervals.empty()) return 1;
  const auto middle = intervals.begin() + static_cast<std::ptrdiff_t>(intervals.size() / 2);
  std::nth_element(intervals.begin(), middle, intervals.end());
  return 3 * *middle;
}

inline void append_kml_point(std::string& text, const TrajectoryRow& row) {
  const geodesy::Geodetic g = geodesy::geodetic_from_ecef(row.p_e_m);
  append_fixed(text, g.lon_rad * 180 / std::numbers::pi, 9);
  append_fixed(text += ',', g.lat_rad * 180 / std::numbers::pi, 9);
  append_fixed(text += ',', g.height_m, 3);
  text += ' ';
}

}  // namespace detail

/// The whole trajectory.kml as text: stretches of one status as coloured lines on the ground, and a placemark at either end.
[[nodiscard]] inline std::string trajectory_kml(const std::vector<TrajectoryRow>& all_rows) {
  std::vector<TrajectoryRow> rows;
  std::copy_if(all_rows.begin(), all_rows.end(), std::back_inserter(rows), [](const TrajectoryRow& row) { return row.p_e_m.allFinite(); });
  std::string text =
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<kml xmlns=\"http://www.opengis.net/kml/2.2\">\n<Document>\n<name>searvins "
      "trajectory</name>\n";
  for (std::size_t i = 0; i < kSolutionStatuses; ++i) {
    const auto status = static_cast<SolutionStatus>(i);
    text += std::string{"<Style id=\""} + name_of(status) + "\"><LineStyle><color>" + detail::kml_color(status) +
            "</color><width>4</width></LineStyle></Style>\n";
  }
  const double break_s = detail::break_interval_s(rows);
  for (std::size_t begin = 0; begin < rows.size();) {  // the row that ends a stretch also begins the next, so that the line is unbroken
    std::size_t end = begin + 1;
    const SolutionStatus status = rows[std::min(end, rows.size() - 1)].status;
    while (end < rows.size() && rows[end].status == status && seconds_between(rows[end - 1].time, rows[end].time) <= break_s) ++end;
    if (end > begin + 1) {
      text += std::string{"<Placemark><name>"} + name_of(status) + "</name><styleUrl>#" + name_of(status) +
              "</styleUrl><LineString><tessellate>1</tessellate><coordinates>";
      for (std::size_t i = begin; i < end; ++i) detail::append_kml_point(text, rows[i]);
      text += "</coordinates></LineString></Placemark>\n";
    }
    const bool gap = end < rows.size() && seconds_between(rows[end - 1].time, rows[end].time) > break_s;
    begin = gap || end == begin + 1 ? end : end - 1;
    if (end >= rows.size()) break;
  }
  const auto placemark = [&text](const char* name, const TrajectoryRow& row) {
    text += std::string{"<Placemark><name>"} + name + ", sow ";
    append_fixed(text, row.time.sow(), 3);
    text += "</name><Point><coordinates>";
    detail::append_kml_point(text, row);
    text += "</coordinates></Point></Placemark>\n";
  };
  if (!rows.empty()) placemark("start", rows.front()), placemark("end", rows.back());
  return text + "</Document>\n</kml>\n";
}

}  // namespace searvins::io
