// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include <searvins/imu/position_fix.hpp>
#include <searvins/io/pos_file.hpp>

#include "tests/support/property.hpp"
#include "tests/support/shared_data.hpp"

using namespace searvins;
using test::for_all_seeds;
using test::Rng;

namespace {

const std::string kEcefHeader =
    "% program   : x\n%  GPST   x-ecef(m)  y-ecef(m)  z-ecef(m)   Q  ns   sdx(m)   sdy(m)   sdz(m)  sdxy(m)  sdyz(m)  sdzx(m) age(s)  ratio\n";
const std::string kGeodeticHeader =
    "%  GPST            latitude(deg) longitude(deg) height(m) Q ns sdn(m) sde(m) sdu(m) sdne(m) sdeu(m) sdun(m) age(s) ratio vn(m/s) ve(m/s) vu(m/s) sdvn sdve "
    "sdvu sdvne sdveu sdvun\n";

}  // namespace

TEST_CASE(".pos: property: what the library's own writer wrote comes back, covariance and all") {
  for_all_seeds(50, [](Rng& rng) {
    std::vector<io::TrajectoryRow> rows;
    for (int i = 0; i < 10; ++i) {
      io::TrajectoryRow row;
      row.time = GpsTime{2300 * kNanosecondsPerWeek + i * 200'000'000LL + test::integer(rng, 0, 99'999'999)};
      row.p_e_m = geodesy::ecef_from_geodetic({test::uniform(rng, -1.5, 1.5), test::uniform(rng, -3.1, 3.1), test::uniform(rng, -100, 9000)});
      row.status = static_cast<io::SolutionStatus>(test::integer(rng, 0, 4));
      row.n_sat = test::integer(rng, 4, 40);
      row.set_covariance_enu_m2(test::random_spd(rng, 3, 10.0));
      rows.push_back(row);
    }
    const auto read = io::parse_pos_file(io::rtklib_solution(rows), "x.pos");
    REQUIRE(read.ok());
    REQUIRE(read.value.size() == rows.size());
    CHECK(read.skipped.total() == 0);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const io::PositionFix& fix = read.value[i];
      CHECK(fix.time == rows[i].time);
      CHECK((fix.position_e_m - rows[i].p_e_m).norm() < 1e-4);
      CHECK(fix.quality == io::rtklib_quality(rows[i].status));
      CHECK(fix.satellites == rows[i].n_sat);
      CHECK_FALSE(fix.covariance_assumed);
      CHECK((fix.covariance_e_m2 - io::detail::covariance_e_m2(rows[i])).norm() < 1e-3 * (1 + fix.covariance_e_m2.norm()));
    }
  });
}

TEST_CASE(".pos: calendar time, geodetic position, velocity north-east-up") {
  const auto read = io::parse_pos_file(
      kGeodeticHeader + "2025/07/08 19:34:18.499 40.0 -105.0 1600.0 1.0000000 21.0 0.01 0.02 0.03 0.0 0.0 0.0 0 0 3.0 4.0 0.5 0.05 0.05 0.05 0 0 0\n", "x.pos");
  REQUIRE(read.ok());
  const io::PositionFix& fix = read.value[0];
  CHECK(fix.time == gps_from_civil({2025, 7, 8, 19, 34, 18.499}));
  CHECK(fix.quality == 1);
  CHECK(fix.satellites == 21);
  const geodesy::Geodetic at{40 * std::numbers::pi / 180, -105 * std::numbers::pi / 180, 1600};
  CHECK((fix.position_e_m - geodesy::ecef_from_geodetic(at)).norm() < 1e-6);
  const Eigen::Matrix3d R_ew = geodesy::ecef_from_enu(at);
  REQUIRE(fix.has_velocity());
  CHECK((R_ew.transpose() * fix.velocity_e_mps - Eigen::Vector3d{4, 3, 0.5}).norm() < 1e-9);
  CHECK(fix.sigma_velocity_mps == doctest::Approx(0.05));
  const Eigen::Matrix3d enu = R_ew.transpose() * fix.covariance_e_m2 * R_ew;
  CHECK(std::sqrt(enu(0, 0)) == doctest::Approx(0.02));
  CHECK(std::sqrt(enu(1, 1)) == doctest::Approx(0.01));
  CHECK(std::sqrt(enu(2, 2)) == doctest::Approx(0.03));
}

TEST_CASE(".pos: bad lines are left out and counted, a missing covariance is assumed and said") {
  const std::string good = " -3817680.0 3562839.0 3650159.0 1 12 0.01 0.01 0.01 0 0 0 0 0\n";
  const auto read = io::parse_pos_file(kEcefHeader + "2323 100.0" + good + "2323 100.2 -3817680.0 nan 3650159.0 1 12 0.01 0.01 0.01 0 0 0 0 0\n" + "2323 100.2" +
                                           good + "2323 100.2" + good + "2323 99.0" + good + "2323 100.4 1 2 3 1 12 0.01 0.01 0.01 0 0 0 0 0\n" +
                                           "2323 100.6 -3817680.0 3562839.0 3650159.0 5 12 0 0 0 0 0 0 0 0\n2323 100.8 -3817680.0 35",
                                       "x.pos");
  REQUIRE(read.ok());
  REQUIRE(read.value.size() == 3);
  CHECK(read.skipped.count("is not a coordinate") == 1);
  CHECK(read.skipped.find("is not a coordinate")->first_line == 4);
  CHECK(read.skipped.count("repeated") == 1);
  CHECK(read.skipped.count("before that") == 1);
  CHECK(read.skipped.count("not near the Earth") == 1);
  CHECK(read.skipped.count("cut short") == 1);
  CHECK(read.skipped.count("covariance missing") == 1);
  CHECK(read.value[2].covariance_assumed);
  CHECK(read.value[2].covariance_e_m2(1, 1) == doctest::Approx(25));
  CHECK(read.value[2].quality == 5);
}

TEST_CASE(".pos: what cannot be used says why") {
  CHECK(io::read_pos_file("/no/such.pos").error->message == "no such file");
  CHECK(io::parse_pos_file("hello\n", "x").error->message.find("names the columns") != std::string::npos);
  CHECK(io::parse_pos_file("%  GPST  e-baseline(m) n-baseline(m) u-baseline(m) Q ns\n2323 1 1 2 3 1 5\n", "x").error->message.find("relative to the base") !=
        std::string::npos);
  CHECK(io::parse_pos_file(kEcefHeader, "x").error->message == "has no usable position");
}

TEST_CASE(".pos: the receiver's positions of the recorded drive and walk, and the bare table beside the walk") {
  const auto shared = test::shared_data();
  if (!shared) {
    MESSAGE("SKIPPED: shared data not found");
    return;
  }
  const auto drive = io::read_pos_file((*shared / "data/real/boulder_drive_2025/onboard_rtk.pos").string());
  REQUIRE(drive.ok());
  CHECK(drive.value.size() == 2197);
  CHECK(drive.skipped.total() == 0);
  long fixed = 0;
  for (const io::PositionFix& f : drive.value) fixed += f.quality == 1 ? 1 : 0;
  CHECK(fixed == 2189);
  for (std::size_t i = 1; i < drive.value.size(); ++i) {  // the velocities are those of the positions
    const io::PositionFix &a = drive.value[i - 1], &b = drive.value[i];
    CHECK(b.has_velocity());
    const double dt_s = seconds_between(a.time, b.time);
    if (dt_s < 0.3) CHECK(((b.position_e_m - a.position_e_m) / dt_s - (a.velocity_e_mps + b.velocity_e_mps) / 2).norm() < 1.0);
  }
  const auto table = io::read_pos_file((*shared / "data/real/boulder_walk_2025/reference.csv").string());
  REQUIRE(table.ok());
  CHECK(table.value.size() == 349);
  CHECK(table.skipped.count("covariance missing") == 349);
  const auto walk = io::read_pos_file((*shared / "data/real/boulder_walk_2025/onboard_rtk.pos").string());
  REQUIRE(walk.ok());
  CHECK((walk.value[0].position_e_m - table.value[0].position_e_m).norm() < 0.05);
}

TEST_CASE("a position fix has a velocity when it is finite and has a sigma") {
  imu::PositionFix fix;
  CHECK_FALSE(fix.has_velocity());
  fix.velocity_e_mps = {1, 2, 3};
  CHECK_FALSE(fix.has_velocity());
  fix.sigma_velocity_mps = 0.1;
  CHECK(fix.has_velocity());
  fix.velocity_e_mps.y() = std::numeric_limits<double>::quiet_NaN();
  CHECK_FALSE(fix.has_velocity());
}
