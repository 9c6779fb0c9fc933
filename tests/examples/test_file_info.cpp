// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <string>

#include "examples/support/file_info.hpp"
#include "support/shared_data.hpp"

using namespace searvins;
using namespace searvins::examples;

namespace {

std::string fact(const FileInfo& info, const std::string& key) {
  for (const InfoFact& f : info.facts)
    if (f.key == key) return f.value.text();
  return "(none)";
}

FileInfo info_of(const std::string& content) {
  const std::string path = (std::filesystem::temp_directory_path() / "searvins_test_info.txt").string();
  REQUIRE(io::write_text_file(path, content).empty());
  return file_info(path);
}

}  // namespace

TEST_CASE("info: number tables tell rows, span, interval, gaps and bad lines") {
  const FileInfo lord = info_of(
      "# Week, wholesec\n2323, 100, 0.00, 1, 2, 3, 4, 5, 6\n2323, 100, 0.01, 1, 2, 3, 4, 5, 6\n2323, 100, x, 1\n2323, 100, 0.02, 1, 2, 3, "
      "4, 5, 6\n2323, 100, 0.09, 1, 2, 3, 4, 5, 6\n");
  CHECK(lord.kind == "LORD IMU log");
  CHECK(fact(lord, "rows") == "4");
  CHECK(fact(lord, "interval_s") == "0.0100");
  CHECK(fact(lord, "gaps") == "1");
  REQUIRE(lord.skipped.size() == 1);
  CHECK(lord.skipped[0].first_line == 4);

  const FileInfo euroc = info_of(
      "#timestamp [ns],w_RS_S_x [rad s^-1],w_y,w_z,a_x,a_y,a_z\n1403715523912000000,1,2,3,4,5,6\n1403715523917000000,1,2,3,4,5,6\n");
  CHECK(fact(euroc, "interval_s") == "0.0050");

  const FileInfo tracks =
      info_of("t_gps_sow,track_id,u_left,u_right,v,score,semantic_class\n10.0,1,2,3,4,5,0\n10.0,2,2,3,4,5,0\n10.1,1,2,3,4,5,0\n");
  CHECK(tracks.kind == "stereo tracks");
  CHECK(fact(tracks, "frames") == "2");
  CHECK(fact(tracks, "tracks") == "2");
}

TEST_CASE("info: an IMU log tells rate, gaps, gravity, where up is, and what looks wrong with it") {
  std::string text = "week,sow,gx,gy,gz,ax,ay,az\n";
  for (int i = 0; i < 50; ++i) text += "2323," + io::fixed_text(100 + 0.02 * (i < 40 ? i : i + 10), 2) + ",0.001,0.002,0,0.01,0.02,-0.998\n";
  const FileInfo log = info_of(text);
  CHECK_FALSE(log.error);
  CHECK(log.kind == "IMU CSV");
  CHECK(fact(log, "rows") == "50");
  CHECK(fact(log, "interval_s") == "0.0200");
  CHECK(fact(log, "gaps") == "1");
  CHECK(fact(log, "duration_s") == "1.180");
  CHECK(fact(log, "mean_accel_norm_mps2") == "9.7895");
  CHECK(fact(log, "up_axis") == "-z");
  CHECK(fact(log, "first").find("week 2323, sow 100.000") != std::string::npos);
  REQUIRE(log.tables.size() == 2);
  CHECK(log.tables[0].rows.size() == 1);
  CHECK(log.tables[0].rows[0][2].text() == "0.220");
  CHECK(log.tables[1].rows[0][0].text().find("the unit is g") != std::string::npos);
  CHECK(info_of("t,gx,gy,gz,ax,ay\n1,2,3,4,5,6\n").error->message.find("az") != std::string::npos);
}

TEST_CASE("info: what cannot be used is an error with its reason, in both outputs") {
  const FileInfo gzip = info_of("\x1f\x8b\x08 packed");
  REQUIRE(gzip.error);
  CHECK(info_text(gzip).find("gunzip") != std::string::npos);
  CHECK(file_info("/no/such/file").error->message == "no such file");
  CHECK(info_of("hello\n").error->message.find("no file that searvins knows") != std::string::npos);
  CHECK(info_of("{\"schema\": 1, \"imu\": {}}").error->message == "imu.rate_hz is missing");
  JsonWriter json;
  write_info(json, gzip);
  const auto parsed = parse_json(json.text(), "info");
  REQUIRE(parsed.ok());
  CHECK(parsed->find("error")->string.find("gunzip") != std::string::npos);
}

TEST_CASE("info: trajectories and truths tell their span") {
  std::vector<io::TrajectoryRow> rows(3);
  for (std::size_t i = 0; i < 3; ++i) {
    rows[i].time = GpsTime::from_week_sow(2323, 553980 + static_cast<double>(i));
    rows[i].p_e_m = {-3810234.401, 3567867.762, 3652897.917};
    rows[i].status = i ? io::SolutionStatus::fix : io::SolutionStatus::spp;
  }
  const FileInfo csv = info_of(io::trajectory_csv(rows)), pos = info_of(io::rtklib_solution(rows));
  CHECK(csv.kind == "trajectory");
  CHECK(pos.kind == "RTKLIB solution");
  for (const FileInfo* info : {&csv, &pos}) {
    CHECK(fact(*info, "status_fix") == "2");
    CHECK(fact(*info, "first") == "2024-07-20 09:53:00.000 GPST (week 2323, sow 553980.000)");
    CHECK(fact(*info, "duration_s") == "2.000");
  }
  CHECK(info_of("2323,553980,-3810234.401,3567867.762,3652897.917\n").kind == "truth");
}

TEST_CASE("info: the recordings") {
  const auto shared = test::shared_data();
  if (!shared) {
    MESSAGE("SKIPPED: no shared data");
    return;
  }
  const FileInfo rover = file_info((*shared / "data/real/kamakura_drive_2021/rover.obs").string());
  CHECK_FALSE(rover.error);
  CHECK(fact(rover, "epochs") == "180");
  CHECK(fact(rover, "version") == "3.04");
  CHECK(fact(rover, "interval_s") == "1.000");
  REQUIRE(rover.tables.size() >= 2);
  CHECK(rover.tables[0].rows.size() == 3);  // GPS, Galileo, QZSS
  const FileInfo imu = file_info((*shared / "data/twin/a-clean/imu.log").string());
  CHECK(fact(imu, "rows") == "114001");
  CHECK(fact(imu, "rate_hz") == "100.00");
  CHECK(fact(imu, "up_axis") == "-z");
  CHECK(file_info((*shared / "data/twin/a-clean/rig.json").string()).kind == "rig");
  CHECK(file_info((*shared / "data/twin/a-clean/ground_truth.log").string()).kind == "truth");
}
