// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <string>

#include "examples/support/truth.hpp"
#include "support/property.hpp"
#include "support/shared_data.hpp"

using namespace searvins;
using namespace searvins::examples;
using searvins::test::for_all_seeds;
using searvins::test::Rng;
using searvins::test::uniform;

namespace {

std::string error_of(const std::string& text, std::optional<GpsTime> reference = {}) {
  const auto truth = parse_truth(text, "truth.csv", reference);
  return truth.ok() ? "accepted" : io::to_string(truth.error());
}

const std::string kP = ",-3810234.401,3567867.762,3652897.917";

}  // namespace

TEST_CASE("truth: interpolation is exact on a straight line and bounded by the neighbours it may use") {
  for_all_seeds(100, [](Rng& rng) {
    const Eigen::Vector3d p0{-3.8e6, 3.5e6, 3.6e6}, v = test::random_vector<3>(rng, 30);
    TruthTrack truth;
    const GpsTime t0 = GpsTime::from_week_sow(2323, 1000);
    for (int i = 0; i <= 10; ++i)
      if (i != 5) truth.points.push_back({t0.plus_seconds(i), p0 + i * v});
    const double t = uniform(rng, -0.019, 10.019);
    const auto p = truth_at(truth, t0.plus_seconds(t));
    const bool in_gap = t > 4.02 && t < 5.98;  // row 5 is missing: 2 s between neighbours
    CHECK(p.has_value() == !in_gap);
    if (p) CHECK((*p - (p0 + t * v)).norm() < 1e-6);
  });
}

TEST_CASE("truth: the gap limit is inclusive, beyond the margin there is nothing") {
  const Eigen::Vector3d p{6.4e6, 0, 0};
  const GpsTime t0 = GpsTime::from_week_sow(2323, 1000);
  const TruthTrack at_limit{{{t0, p}, {t0.plus_seconds(1.2), p}}}, beyond{{{t0, p}, {t0.plus_seconds(1.201), p}}};
  CHECK(truth_at(at_limit, t0.plus_seconds(0.6)));
  CHECK_FALSE(truth_at(beyond, t0.plus_seconds(0.6)));
  CHECK(truth_at(beyond, t0.plus_seconds(0.02)));
  CHECK_FALSE(truth_at(beyond, t0.plus_seconds(0.021)));
  CHECK_FALSE(truth_at(at_limit, t0.plus_seconds(-0.021)));
  CHECK_FALSE(truth_at(TruthTrack{}, t0));
  CHECK(truth_at(static_truth(p), t0.plus_seconds(1e6)));
}

TEST_CASE("truth: every form of the format") {
  const Eigen::Vector3d p{-3810234.401, 3567867.762, 3652897.917};
  const GpsTime t = GpsTime::from_week_sow(2323, 553950.5);
  const std::string forms[] = {"2323,553950.5" + kP + ",7,8\n",
                               "week,sow,x,y,z\n2323,553950.5" + kP + "\n",
                               "t,ant_x,ant_y,ant_z,imu_x,imu_y,imu_z\n553950.5" + kP + ",1,2,3\n",
                               "t_gps_sow,ecef_x,ecef_y,ecef_z\n553950.5" + kP + "\n",
                               "gps_week,tow_s,ecef_x_m,ecef_y_m,ecef_z_m\r\n2323,553950.5" + kP + "\r\n",
                               "GPS TOW (s),GPS Week,Latitude (deg),ECEF X (m),ECEF Y (m),ECEF Z (m)\n553950.5,2323,35" + kP + "\n"};
  for (const std::string& text : forms) {
    const auto truth = parse_truth(text, "truth.csv", GpsTime::from_week_sow(2323, 600000));
    REQUIRE_MESSAGE(truth.ok(), io::to_string(truth.error()));
    CHECK(truth->points.front().time == t);
    CHECK((truth->points.front().p_e_m - p).norm() < 1e-9);
  }
  const auto log = parse_truth("# heading \xB0 \n2024/07/20\t09:52:12.500\t1\t35.165302157\t136.881458605\t41.3244\t3.8\n", "gt.log");
  REQUIRE_MESSAGE(log.ok(), io::to_string(log.error()));
  CHECK(log->points.front().time == t);  // UTC is 18 s behind
  CHECK((log->points.front().p_e_m - p).norm() < 1e-3);
}

TEST_CASE("truth: without a week the trajectory gives it, over the end of a week too") {
  const std::string text = "t,x,y,z\n604799" + kP + "\n0" + kP + "\n1" + kP + "\n";
  const auto early = parse_truth(text, "t", GpsTime::from_week_sow(2300, 604790));
  const auto late = parse_truth(text, "t", GpsTime::from_week_sow(2301, 5));
  for (const auto* truth : {&early, &late}) {
    REQUIRE_MESSAGE(truth->ok(), io::to_string(truth->error()));
    CHECK((*truth)->points[0].time == GpsTime::from_week_sow(2300, 604799));
    CHECK((*truth)->points[2].time == GpsTime::from_week_sow(2301, 1));
  }
  CHECK(error_of(text).find("has no week column") != std::string::npos);
}

TEST_CASE("truth: what cannot be used is refused with its line") {
  CHECK(error_of("week,sow,lat,lon\n").find("truth.csv:1: the header names no position") == 0);
  CHECK(error_of("week,time,x,y,z\n").find("names no time column") != std::string::npos);
  CHECK(error_of("week,sow,x,y\n2323,1,2,3\n").find("names no position") != std::string::npos);
  CHECK(error_of("2323,1" + kP + "\n2323,2,nan,1,2\n").find("truth.csv:2: 'nan' is not a coordinate") == 0);
  CHECK(error_of("2323,1,1,2\n").find("cut short") != std::string::npos);
  CHECK(error_of("2323,1,35.1,136.8,41\n").find("not on or near the Earth") != std::string::npos);
  CHECK(error_of("2323,1" + kP + "\n2323,1" + kP + "\n").find("truth.csv:2: time does not rise") == 0);
  CHECK(error_of("# nothing\n").find("has no truth row") != std::string::npos);
  CHECK(error_of("-1,1" + kP + "\n").find("week") != std::string::npos);
  CHECK(error_of("2024/07/20 25:00:00 1 35 136 41\n").find("is not a UTC date") != std::string::npos);
}

TEST_CASE("truth: every truth among the recordings is read, and the two of the simulated drive agree") {
  const auto shared = test::shared_data();
  if (!shared) {
    MESSAGE("SKIPPED: no shared data");
    return;
  }
  int files = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator{*shared / "data" / "real"}) {
    if (!entry.path().filename().string().starts_with("reference")) continue;
    const auto truth = read_truth(entry.path().string());
    CHECK_MESSAGE(truth.ok(), io::to_string(truth.error()));
    CHECK(truth->points.size() >= 178);
    ++files;
  }
  CHECK(files == 5);
  for (const char* name : {"a-clean", "a-urban"}) {
    const auto csv = read_truth((*shared / "data/twin" / name / "truth.csv").string(), GpsTime::from_week_sow(2323, 553950));
    const auto log = read_truth((*shared / "data/twin" / name / "ground_truth.log").string());
    REQUIRE((csv.ok() && log.ok()));
    CHECK(csv->points.size() == 11401);
    CHECK(log->points.size() == 1141);
    double worst_m = 0;
    for (const TruthPoint& point : log->points) worst_m = std::max(worst_m, (*truth_at(*csv, point.time) - point.p_e_m).norm());
    CHECK(worst_m < 1e-3);
  }
}
