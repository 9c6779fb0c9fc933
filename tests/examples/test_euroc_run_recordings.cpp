// SPDX-License-Identifier: BSD-3-Clause
// `searvins solve --dataset euroc` as a user runs it: real pictures of a craft at rest, a rendered drive, and folders that cannot be used.
#include <doctest/doctest.h>

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <searvins/geodesy/local_frame.hpp>

#include "support/shared_data.hpp"
#include "support/temporary_folder.hpp"
#include "tests/examples/command_runner.hpp"

#ifdef SEARVINS_COMMAND

using namespace searvins;
using searvins::test::has;
using searvins::test::Outcome;
using searvins::test::TemporaryFolder;
namespace fs = std::filesystem;

namespace {

std::string text_of(const fs::path& path) {
  std::ifstream stream{path, std::ios::binary};
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

struct TumRow {
  std::string stamp;
  Eigen::Vector3d p_m;
  Eigen::Vector4d q;
};

std::vector<TumRow> tum_rows(const fs::path& path) {
  std::vector<TumRow> rows;
  std::istringstream text{text_of(path)};
  for (std::string line; std::getline(text, line);) {
    if (line.starts_with('#')) continue;
    std::istringstream fields{line};
    TumRow row;
    fields >> row.stamp >> row.p_m.x() >> row.p_m.y() >> row.p_m.z() >> row.q[0] >> row.q[1] >> row.q[2] >> row.q[3];
    REQUIRE(fields);
    rows.push_back(row);
  }
  return rows;
}

/// The number after a key of summary.json.
double figure(const std::string& json, const std::string& key) {
  const std::size_t at = json.find('"' + key + "\": ");
  REQUIRE_MESSAGE(at != std::string::npos, key);
  return std::stod(json.substr(at + key.size() + 4));
}

/// A route: three seconds at rest, then off and through a bend; week,sow,x,y,z.
void write_route(const fs::path& path, double length_s) {
  const geodesy::LocalFrame w = geodesy::LocalFrame::at(geodesy::ecef_from_geodetic({0.84, 0.2, 500}));
  std::ofstream file{path};
  file.precision(13);
  for (double t_s = 0; t_s <= length_s + 6; t_s += 0.5) {
    const double moving_s = std::max(0.0, t_s - 3), way_m = moving_s < 4 ? 0.75 * moving_s * moving_s : 12 + 6 * (moving_s - 4);
    const double turn = way_m / 40;  // radius 40 m
    const Eigen::Vector3d p_e_m = w.to_ecef({40 * (1 - std::cos(turn)), 40 * std::sin(turn), 0});
    file << "2370," << 274800 + t_s << ',' << p_e_m.x() << ',' << p_e_m.y() << ',' << p_e_m.z() << '\n';
  }
}

}  // namespace

TEST_CASE("euroc run: real pictures of a craft at rest: a pose for each frame from the first on, and no motion") {
  const auto shared = test::shared_data();
  if (!shared) {
    MESSAGE("SKIPPED: shared data not found");
    return;
  }
  const fs::path recording = *shared / "data/real/euroc_v101_static";
  const TemporaryFolder out("euroc_rest");
  const Outcome run = test::run("solve --dataset euroc '" + recording.string() + "' --out '" + out.path().string() + "'");
  INFO(run.output);
  REQUIRE(run.exit_code == 0);
  CHECK(has(run, "12, with a pose 12"));
  CHECK(has(run, "before the first frame"));
  CHECK(has(run, "there is no truth"));
  const std::vector<TumRow> rows = tum_rows(out.path() / "trajectory.tum");
  REQUIRE(rows.size() == 12);
  CHECK(rows.front().stamp == "1403715273.262142976");
  CHECK(rows.back().stamp == "1403715273.812143104");
  for (const TumRow& row : rows) {
    CHECK((row.p_m - rows.front().p_m).norm() < 0.02);
    CHECK(std::abs(row.q.dot(rows.front().q)) > std::cos(0.5 * 0.01));
    CHECK(row.q.norm() == doctest::Approx(1).epsilon(1e-6));
    // The unit's x points up, 22 degrees off: what gravity says.
    const double up_x = 2 * (row.q[0] * row.q[2] - row.q[1] * row.q[3]);
    CHECK(std::abs(up_x) == doctest::Approx(9.06 / 9.786).epsilon(0.01));
  }
  const std::string json = text_of(out.path() / "summary.json");
  CHECK(figure(json, "frames_at_rest") >= 6);
  CHECK(figure(json, "stop_cue_frames") >= 5);
  CHECK(figure(json, "way_m") < 0.1);
  CHECK(text_of(out.path() / "report.html").find("</html>") != std::string::npos);
}

TEST_CASE("euroc run: a rendered drive is followed to a per cent of its way, from the first frame on") {
  const TemporaryFolder data("euroc_drive"), out("euroc_drive_out");
  write_route(data.path() / "route.csv", 12);
  const Outcome made = test::run("simulate --profile urban --route '" + (data.path() / "route.csv").string() +
                                 "' --duration 12 --images 480x180 --out '" + data.path().string() + "'");
  INFO(made.output);
  REQUIRE(made.exit_code == 0);
  const Outcome run = test::run("solve --dataset euroc '" + data.path().string() + "' --reject 3,4,6 --out '" + out.path().string() + "'");
  INFO(run.output);
  REQUIRE(run.exit_code == 0);
  const std::string json = text_of(out.path() / "summary.json");
  CHECK(figure(json, "poses") == 121);
  const double way_m = figure(json.substr(json.find("\"errors\"")), "way_m");
  CHECK(way_m > 38);
  const std::string yaw = json.substr(json.find("\"yaw_and_position_aligned\""));
  CHECK(figure(yaw, "rmse_m") < 0.01 * way_m);
  CHECK(figure(yaw, "tilt_rmse_deg") < 1);
  CHECK(tum_rows(out.path() / "truth.tum").size() == 121);

  // The same without the truth: said, and no fault.
  fs::remove_all(data.path() / "state_groundtruth_estimate0");
  const Outcome blind = test::run("solve --dataset euroc --duration 2 '" + data.path().string() + "' --out '" + out.path().string() + "'");
  CHECK(blind.exit_code == 0);
  CHECK(has(blind, "there is no truth in the recording"));
  CHECK(has(blind, "21, with a pose 21"));

  // Without readings, without a camera: refused by name.
  fs::remove(data.path() / "imu0" / "data.csv");
  const Outcome no_imu = test::run("solve --dataset euroc '" + data.path().string() + "' --out '" + out.path().string() + "'");
  CHECK(no_imu.exit_code == 3);
  CHECK(has(no_imu, "imu0/data.csv"));
  CHECK(has(no_imu, "no readings of an inertial unit"));
  fs::remove_all(data.path() / "cam1");
  const Outcome no_camera = test::run("solve --dataset euroc '" + data.path().string() + "' --out '" + out.path().string() + "'");
  CHECK(no_camera.exit_code == 3);
  CHECK(has(no_camera, "there is no cam1"));
}

TEST_CASE("euroc run: usage") {
  CHECK(test::run("solve --dataset kitti somewhere --out /tmp/x").exit_code == 2);
  CHECK(test::run("solve --dataset euroc --out /tmp/x").exit_code == 2);
  CHECK(test::run("solve --dataset euroc nowhere --out /tmp/x").exit_code == 3);
  CHECK(test::run("solve --dataset euroc nowhere --out /tmp/x --truth-is-left-camera").exit_code == 2);
  CHECK(test::run("solve --dataset euroc nowhere --out /tmp/x --without colour").exit_code == 2);
  const Outcome help = test::run("solve --dataset euroc --help");
  CHECK(help.exit_code == 0);
  CHECK(has(help, "FOLDER"));
}

#endif  // SEARVINS_COMMAND
