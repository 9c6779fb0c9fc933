// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <string>
#include <vector>

#include <searvins/io/trajectory.hpp>

#include "support/property.hpp"

using namespace searvins;
using namespace searvins::io;
using searvins::test::chance;
using searvins::test::for_all_seeds;
using searvins::test::Rng;
using searvins::test::uniform;

namespace {

/// A trajectory with everything random and any field possibly unknown.
std::vector<TrajectoryRow> random_rows(Rng& rng, int n) {
  std::vector<TrajectoryRow> rows;
  std::int64_t ns = GpsTime::from_week_sow(test::integer(rng, 0, 3000), uniform(rng, 0, 604800)).ns;
  for (int i = 0; i < n; ++i) {
    TrajectoryRow row;
    row.time.ns = ns += test::integer(rng, 1, 2'000'000'000);
    row.p_e_m = geodesy::ecef_from_geodetic({uniform(rng, -1.57, 1.57), uniform(rng, -3.14, 3.14), uniform(rng, -100, 5000)});
    row.status = static_cast<SolutionStatus>(test::integer(rng, 0, 4));
    if (chance(rng, 0.7)) row.set_covariance_enu_m2(test::random_spd(rng, 3));
    if (chance(rng, 0.7)) row.v_enu_mps = test::random_vector<3>(rng, 50);
    if (chance(rng, 0.5))
      row.roll_deg = uniform(rng, -180, 180), row.pitch_deg = uniform(rng, -90, 90), row.heading_deg = uniform(rng, 0, 360);
    if (chance(rng, 0.7)) row.n_sat = test::integer(rng, 0, 60), row.n_dd = test::integer(rng, 0, 99);
    if (chance(rng, 0.3)) row.n_tracks = test::integer(rng, 0, 200);
    if (chance(rng, 0.5)) row.success_rate = uniform(rng, 0, 1);
    if (chance(rng, 0.5)) row.solve_ms = uniform(rng, 0, 100);
    rows.push_back(row);
  }
  return rows;
}

bool same(double a, double b, double tolerance) { return (std::isnan(a) && std::isnan(b)) || std::abs(a - b) <= tolerance; }

/// A well-formed data line, one field replaced.
std::string file_with(std::size_t column, const std::string& field) {
  TrajectoryRow row;
  row.time = GpsTime::from_week_sow(2323, 553950.25);
  row.p_e_m = {-3810234.401, 3567867.762, 3652897.917};
  std::string line;
  append_trajectory_row(line, row);
  line.pop_back();
  std::string out;
  const std::vector<std::string_view> fields = split(line, ',');
  for (std::size_t i = 0; i < fields.size(); ++i) (out += i ? "," : "") += i == column ? field : std::string{fields[i]};
  return trajectory_header() + "\n" + out + "\n";
}

}  // namespace

TEST_CASE("trajectory.csv: what is written is read back, the time to the nanosecond") {
  for_all_seeds(30, [](Rng& rng) {
    const std::vector<TrajectoryRow> rows = random_rows(rng, 20);
    const FileResult<std::vector<TrajectoryRow>> back = parse_trajectory(trajectory_csv(rows), "t.csv");
    REQUIRE_MESSAGE(back.ok(), to_string(back.error()));
    REQUIRE(back->size() == rows.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const TrajectoryRow &a = rows[i], &b = (*back)[i];
      CHECK(a.time == b.time);
      CHECK((a.p_e_m - b.p_e_m).norm() < 1e-5);
      CHECK(a.status == b.status);
      for (int k = 0; k < 3; ++k) {
        CHECK(same(a.sd_enu_m[k], b.sd_enu_m[k], 6e-6));
        CHECK(same(a.v_enu_mps[k], b.v_enu_mps[k], 6e-6));
      }
      CHECK(same(a.cov_en_m2, b.cov_en_m2, 1e-6 * std::abs(a.cov_en_m2)));
      CHECK(same(a.cov_nu_m2, b.cov_nu_m2, 1e-6 * std::abs(a.cov_nu_m2)));
      CHECK(same(a.heading_deg, b.heading_deg, 6e-6));
      CHECK(a.n_sat == b.n_sat);
      CHECK(a.n_tracks == b.n_tracks);
      CHECK(same(a.success_rate, b.success_rate, 6e-7));
    }
  });
}

TEST_CASE("trajectory.csv: the header is the one of the format, nothing in the file reads nan") {
  CHECK(trajectory_header() ==
        "week,sow,ecef_x_m,ecef_y_m,ecef_z_m,status,sd_e_m,sd_n_m,sd_u_m,cov_en_m2,cov_eu_m2,cov_nu_m2,lat_deg,lon_deg,height_m,vel_e_mps,"
        "vel_n_mps,vel_u_mps,"
        "roll_deg,pitch_deg,heading_deg,n_sat,n_dd,n_tracks,success_rate,solve_ms");
  std::string line;
  append_trajectory_row(line, TrajectoryRow{});
  CHECK(line.find("nan") == std::string::npos);
  CHECK(line.find("-1") == std::string::npos);  // unknown counts are empty too
}

TEST_CASE("trajectory.csv: each malformed field is an error with its line and column name") {
  struct Case {
    std::size_t column;
    const char* field;
    const char* part;
  };
  const Case cases[] = {{0, "", "week is empty"},
                        {0, "23x", "'23x' is not a number"},
                        {0, "2323.5", "week"},
                        {1, "604800", "sow"},
                        {1, "-1", "sow"},
                        {2, "", "ecef_x_m is empty"},
                        {3, "nan", "not a number"},
                        {4, "inf", "not a number"},
                        {5, "fixed", "'fixed' is not"},
                        {5, "", "is not one of"},
                        {6, "0.1 m", "sd_e_m"},
                        {21, "7.5", "n_sat is not a count"},
                        {21, "-3", "n_sat"}};
  for (const Case& c : cases) {
    const auto result = parse_trajectory(file_with(c.column, c.field), "run/trajectory.csv");
    CAPTURE(c.part);
    REQUIRE_FALSE(result.ok());
    CHECK(result.error().line == 2);
    CHECK(to_string(result.error()).find(std::string{"run/trajectory.csv:2: "}) == 0);
    CHECK(result.error().message.find(c.part) != std::string::npos);
  }
  CHECK(parse_trajectory(file_with(99, ""), "t").ok());
}

TEST_CASE("trajectory.csv: wrong header, short line, falling time, no row; CR LF is fine") {
  const std::string good = file_with(99, "");
  CHECK_FALSE(parse_trajectory("t,x,y,z\n1,2,3,4\n", "t").ok());
  CHECK_FALSE(parse_trajectory("", "t").ok());
  CHECK_FALSE(parse_trajectory(trajectory_header() + "\n", "t").ok());
  CHECK(parse_trajectory(trajectory_header() + "\n2323,5,1,2\n", "t").error().message.find("4 fields, 26 expected") == 0);
  const std::string line = good.substr(good.find('\n') + 1);
  CHECK(parse_trajectory(good + line, "t").error().line == 3);  // the same time twice
  std::string crlf;
  for (const char c : good) crlf += c == '\n' ? std::string{"\r\n"} : std::string{c};
  CHECK(parse_trajectory(crlf, "t").ok());
}

TEST_CASE("numbers as text: exact field, finite, no minus zero") {
  double value = 7;
  for (const char* bad : {"", " ", "1 ", "1e", "1e999", "nan", "inf", "0x10", "--1", "1,5", "+-1"}) CHECK_FALSE(parse_number(bad, value));
  CHECK(value == 7);
  CHECK(parse_number("+1.5e2", value));
  CHECK(value == 150);
  CHECK(fixed_text(-0.0001, 3) == "0.000");
  CHECK(fixed_text(-0.0006, 3) == "-0.001");
  CHECK(fixed_text(2.5, 1, 6) == "   2.5");
}
