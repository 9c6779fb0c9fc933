// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <string>
#include <vector>

#include <searvins/io/trajectory_export.hpp>

#include "support/property.hpp"

using namespace searvins;
using namespace searvins::io;
using searvins::test::for_all_seeds;
using searvins::test::Rng;
using searvins::test::uniform;

namespace {

std::vector<TrajectoryRow> rows_of(const std::vector<SolutionStatus>& statuses, double gap_after_2_s = 1) {
  std::vector<TrajectoryRow> rows;
  GpsTime time = GpsTime::from_week_sow(2300, 1000);
  for (std::size_t i = 0; i < statuses.size(); ++i) {
    TrajectoryRow row;
    row.time = time;
    row.p_e_m = geodesy::ecef_from_geodetic({0.6, 2.4 + 1e-6 * static_cast<double>(i), 40});
    row.status = statuses[i];
    rows.push_back(row);
    time = time.plus_seconds(i == 2 ? gap_after_2_s : 1);
  }
  return rows;
}

int count(const std::string& text, const std::string& part) {
  int n = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
  return n;
}

}  // namespace

TEST_CASE("attitude angles: forward points along the heading, pitch lifts it, roll lowers the right side") {
  for_all_seeds(100, [](Rng& rng) {
    const double roll = uniform(rng, -80, 80), pitch = uniform(rng, -80, 80), heading = uniform(rng, 0, 360), rad = std::numbers::pi / 180;
    const Eigen::Matrix3d R_wb = R_wb_from_angles(roll, pitch, heading);
    CHECK(test::close(R_wb.transpose() * R_wb, Eigen::Matrix3d::Identity(), 1e-12));
    CHECK(R_wb.determinant() == doctest::Approx(1));
    const Eigen::Vector3d forward_w = R_wb.col(1);
    CHECK(forward_w.z() == doctest::Approx(std::sin(pitch * rad)));
    CHECK(std::remainder(std::atan2(forward_w.x(), forward_w.y()) / rad - heading, 360) == doctest::Approx(0).epsilon(1e-9));
    CHECK(R_wb.col(0).z() == doctest::Approx(-std::sin(roll * rad) * std::cos(pitch * rad)));
  });
}

TEST_CASE("TUM: seconds rise, positions are local, a row without attitude has the identity") {
  std::vector<TrajectoryRow> rows = rows_of({SolutionStatus::fix, SolutionStatus::fix});
  rows[1].roll_deg = 0, rows[1].pitch_deg = 0, rows[1].heading_deg = 180;
  const std::string text = trajectory_tum(rows, rows[0].p_e_m);
  LineReader lines{text};
  std::string_view line;
  REQUIRE(lines.next(line));
  CHECK(line.front() == '#');
  REQUIRE(lines.next(line));
  CHECK(line == "1391041000.000000000 0.00000 0.00000 0.00000 0.00000000 0.00000000 0.00000000 1.00000000");
  REQUIRE(lines.next(line));
  const std::vector<std::string_view> fields = split_words(line);
  REQUIRE(fields.size() == 8);
  double east_m = 0, qz = 0;
  CHECK(parse_number(fields[1], east_m));
  CHECK(east_m == doctest::Approx(1e-6 * 6378137 * std::cos(0.6)).epsilon(0.01));
  CHECK(parse_number(fields[6], qz));
  CHECK(std::abs(qz) == doctest::Approx(1));
  CHECK_FALSE(lines.next(line));
}

TEST_CASE("KML: one line a stretch of one status, no gap is bridged, all rows are drawn") {
  using S = SolutionStatus;
  CHECK(count(trajectory_kml(rows_of({S::fix, S::fix, S::fix, S::fix})), "<LineString>") == 1);
  CHECK(count(trajectory_kml(rows_of({S::fix, S::float_, S::float_, S::fix})), "<LineString>") == 2);
  CHECK(count(trajectory_kml(rows_of({S::fix, S::fix, S::fix, S::fix, S::fix}, 100)), "<LineString>") == 2);
  CHECK(count(trajectory_kml(rows_of({S::dr})), "<Point>") == 2);
  CHECK(count(trajectory_kml({}), "<Placemark>") == 0);
  const std::string kml = trajectory_kml(rows_of({S::fix, S::spp, S::dr, S::dgnss}));
  for (const char* style : {"#spp", "#dr", "#dgnss"}) CHECK(count(kml, std::string{"<styleUrl>"} + style) == 1);
  CHECK(count(kml, "<Placemark>") == count(kml, "</Placemark>"));
}
