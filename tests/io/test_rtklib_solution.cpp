// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <string>
#include <vector>

#include <searvins/io/rtklib_solution.hpp>

#include "support/property.hpp"
#include "support/shared_data.hpp"

using namespace searvins;
using namespace searvins::io;
using searvins::test::for_all_seeds;
using searvins::test::Rng;
using searvins::test::uniform;

TEST_CASE("solution.pos: position, time, status and covariance survive writing and reading") {
  for_all_seeds(30, [](Rng& rng) {
    std::vector<TrajectoryRow> rows(5);
    GpsTime time = GpsTime::from_week_sow(test::integer(rng, 1000, 3000), uniform(rng, 0, 604000));
    for (TrajectoryRow& row : rows) {
      row.time = time = time.plus_seconds(uniform(rng, 0.01, 3));
      row.p_e_m = geodesy::ecef_from_geodetic({uniform(rng, -1.5, 1.5), uniform(rng, -3, 3), uniform(rng, 0, 1000)});
      row.status = static_cast<SolutionStatus>(test::integer(rng, 0, 4));
      row.set_covariance_enu_m2(test::random_spd(rng, 3, 10));
      row.n_sat = test::integer(rng, 0, 40);
    }
    const auto back = parse_rtklib_solution(rtklib_solution(rows), "s.pos");
    REQUIRE_MESSAGE(back.ok(), to_string(back.error()));
    REQUIRE(back->size() == rows.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
      CHECK((*back)[i].time == rows[i].time);
      CHECK((*back)[i].status == rows[i].status);
      CHECK((*back)[i].n_sat == rows[i].n_sat);
      CHECK(((*back)[i].p_e_m - rows[i].p_e_m).norm() < 1e-4);
      const Eigen::Matrix3d want = rows[i].covariance_enu_m2();
      CHECK(((*back)[i].covariance_enu_m2() - want).norm() < 2e-3 * (1 + want.norm()));
    }
  });
}

TEST_CASE("solution.pos: latitude and longitude, calendar time and UTC are read as well") {
  const std::string llh =
      "% (lat/lon/height=WGS84/ellipsoidal,Q=1:fix,2:float)\n"
      "%  GPST                  latitude(deg) longitude(deg)  height(m)   Q  ns   sdn(m)   sde(m)   sdu(m)  sdne(m)  sdeu(m)  sdun(m) "
      "age(s)  ratio\n"
      "2023/01/08 10:00:00.000   48.780735781    9.173352866   319.9977   2   7   1.4664   1.0262   2.8922  -0.6466   0.7071  -1.2707   "
      "0.00    0.0\n";
  const auto gps = parse_rtklib_solution(llh, "a.pos");
  REQUIRE_MESSAGE(gps.ok(), to_string(gps.error()));
  const TrajectoryRow& row = gps->front();
  CHECK(row.time == GpsTime::from_week_sow(2244, 36000));
  CHECK((row.p_e_m - Eigen::Vector3d{4157161.126, 671329.198, 4774767.031}).norm() < 0.02);
  CHECK(row.sd_enu_m.x() == doctest::Approx(1.0262));
  CHECK(row.sd_enu_m.y() == doctest::Approx(1.4664));
  CHECK(row.cov_en_m2 == doctest::Approx(-0.6466 * 0.6466));
  CHECK(row.cov_eu_m2 == doctest::Approx(0.7071 * 0.7071));
  CHECK(row.cov_nu_m2 == doctest::Approx(-1.2707 * 1.2707));

  std::string utc = llh;
  utc.replace(utc.find("GPST"), 4, "UTC ");
  CHECK(parse_rtklib_solution(utc, "a.pos")->front().time == GpsTime::from_week_sow(2244, 36018));
}

TEST_CASE("solution.pos: what cannot be used is refused with its line") {
  const std::string names = "%  GPST   x-ecef(m)  y-ecef(m)  z-ecef(m)  Q  ns\n";
  const auto message = [](const std::string& text) {
    const auto result = parse_rtklib_solution(text, "s.pos");
    return result.ok() ? std::string{"accepted"} : to_string(result.error());
  };
  CHECK(message(names + "2244 36000.0 4157161 671329 4774767 1 9\n") == "accepted");
  CHECK(message("2244 36000.0 4157161 671329 4774767 1 9\n").find("out-outhead=on") != std::string::npos);
  CHECK(message(names + "2244 36000.0 4157161 671329 4774767 8 9\n").find("s.pos:2: '8' is not a quality") == 0);
  CHECK(message(names + "2244 36000.0 4157161 671329\n").find("cut short") != std::string::npos);
  CHECK(message(names + "2244 36000.0 4157161 nan 4774767 1 9\n").find("'nan' is not a coordinate") != std::string::npos);
  CHECK(message(names + "2244/1 36000.0 4157161 671329 4774767 1 9\n").find("is not a time") != std::string::npos);
  CHECK(message("%  JST   x-ecef(m)  y-ecef(m)  z-ecef(m)  Q  ns\n2244 36000.0 4157161 671329 4774767 1 9\n").find("GPST or UTC") !=
        std::string::npos);
  CHECK(message("%  GPST   e-baseline(m) n-baseline(m) u-baseline(m)  Q  ns\n2244 36000.0 1 2 3 1 9\n").find("out-solformat=xyz") !=
        std::string::npos);
  const std::string line = "2244 36000.0 4157161 671329 4774767 1 9\n";
  CHECK(message(names + line + line).find("time does not rise") != std::string::npos);
  CHECK(message(names).find("no solution line") != std::string::npos);
}

TEST_CASE("solution.pos: every RTKLIB result among the recordings is read") {
  const auto shared = test::shared_data();
  if (!shared) {
    MESSAGE("SKIPPED: no shared data");
    return;
  }
  int files = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator{*shared / "data" / "real"}) {
    if (entry.path().extension() != ".pos") continue;
    const auto rows = read_rtklib_solution(entry.path().string());
    CHECK_MESSAGE(rows.ok(), to_string(rows.error()));
    CHECK(rows->size() > 100);
    ++files;
  }
  CHECK(files >= 35);
}
