// SPDX-License-Identifier: BSD-3-Clause
// The simulator's files: the same for the same seed, and what they hold.
#include <doctest/doctest.h>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <sstream>
#include <string>
#include <vector>

#include "examples/simulator/dataset.hpp"
#include "simulated_files.hpp"

using namespace searvins;
using test::options_of;
using test::text_of;

namespace {

std::vector<std::vector<double>> numbers(const std::string& text) {
  std::vector<std::vector<double>> rows;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.empty() || line[0] == '#' || std::isalpha(static_cast<unsigned char>(line[0]))) continue;
    rows.emplace_back();
    for (const char* at = line.c_str(); *at;) {
      char* end = nullptr;
      rows.back().push_back(std::strtod(at, &end));
      if (end == at) break;
      for (at = end; *at == ',' || *at == ' ' || *at == '\t'; ++at) {
      }
    }
  }
  return rows;
}

}  // namespace

TEST_CASE("simulated files: one seed gives the same bytes, another seed another drive; rates leave the rest alone") {
  const simulator::Simulation a(options_of("texcup", 30, 4)), b(options_of("texcup", 30, 4)), c(options_of("texcup", 30, 5));
  const simulator::Dataset first = simulator::make_dataset(a, simulator::Layout::plain),
                           again = simulator::make_dataset(b, simulator::Layout::plain),
                           other = simulator::make_dataset(c, simulator::Layout::plain);
  REQUIRE(first.files.size() == 9);
  for (std::size_t i = 0; i < first.files.size(); ++i) {
    CHECK(first.files[i].name == again.files[i].name);
    CHECK_MESSAGE(first.files[i].text == again.files[i].text, first.files[i].name);
    // The profile's way begins with a standstill, the same for every seed.
    const bool is_shared = first.files[i].name == "rig.json" || first.files[i].name == "truth.csv" || first.files[i].name == "streets.csv";
    if (!is_shared) CHECK_MESSAGE(first.files[i].text != other.files[i].text, first.files[i].name);
  }
  simulator::SimulationOptions faster = options_of("texcup", 30, 4);
  faster.rover_rate_hz = 10;
  const simulator::Simulation d(faster);
  const simulator::Dataset fast = simulator::make_dataset(d, simulator::Layout::plain);
  for (const char* name : {"base.obs", "nav.rnx", "imu.csv", "truth.csv", "stereo_tracks.csv"})
    CHECK(text_of(fast, name) == text_of(first, name));
  const std::string& rover = text_of(fast, "rover.obs");
  const std::string& slow = text_of(first, "rover.obs");
  CHECK(std::count(rover.begin(), rover.end(), '>') > 8 * std::count(slow.begin(), slow.end(), '>'));
}

TEST_CASE("simulated files: both layouts tell the same") {
  const simulator::Simulation drive(options_of("urban", 20, 2));
  const simulator::Dataset plain = simulator::make_dataset(drive, simulator::Layout::plain);
  const simulator::Dataset texcup = simulator::make_dataset(drive, simulator::Layout::texcup);
  CHECK(text_of(texcup, "asterx4_rover.obs") == text_of(plain, "rover.obs"));
  CHECK(text_of(texcup, "asterx4_base_1hz.obs") == text_of(plain, "base.obs"));
  CHECK(text_of(texcup, "brdm1620.25p") == text_of(plain, "nav.rnx"));
  const auto csv = numbers(text_of(plain, "imu.csv")), log = numbers(text_of(texcup, "lord_imu.log"));
  REQUIRE(csv.size() == 2201);  // a second before, 20 s, a second after, at 100 Hz
  REQUIRE(log.size() == csv.size());
  for (std::size_t i = 0; i < csv.size(); i += 100) {
    REQUIRE(csv[i].size() == 8);
    REQUIRE(log[i].size() == 9);
    CHECK(log[i][1] + log[i][2] == doctest::Approx(csv[i][1]).epsilon(1e-12));
    for (std::size_t axis = 0; axis < 3; ++axis) {  // left, forward, down against right, forward, up
      const double sign = axis == 1 ? 1 : -1;
      CHECK(log[i][3 + axis] == sign * csv[i][5 + axis]);
      CHECK(log[i][6 + axis] == sign * csv[i][2 + axis]);
    }
  }
  const auto truth = numbers(text_of(plain, "truth.csv")), second = numbers(text_of(texcup, "ground_truth.log"));
  REQUIRE(truth.size() == 221);
  REQUIRE(second.size() == 23);
  for (std::size_t i = 0; i < truth.size(); i += 50) {
    const Eigen::Vector3d arm =
        Eigen::Vector3d{truth[i][1], truth[i][2], truth[i][3]} - Eigen::Vector3d{truth[i][4], truth[i][5], truth[i][6]};
    CHECK(arm.norm() == doctest::Approx(drive.vehicle().lever_arm_b_m().norm()).epsilon(1e-3));
    const Eigen::Vector4d q{truth[i][7], truth[i][8], truth[i][9], truth[i][10]};
    CHECK(q.norm() == doctest::Approx(1).epsilon(1e-6));
  }
}

TEST_CASE("simulated files: every track observation is where its landmark projects, but for noise and the wrong matches") {
  const simulator::Simulation drive(options_of("light", 40, 3));
  simulator::StereoCamera camera = drive.camera();
  const simulator::StereoRig rig;
  int seen = 0, wrong = 0;
  double squares = 0;
  for (int k = 200; k <= 400; ++k) {
    const simulator::VehicleState s = drive.vehicle().state(0.1 * k);
    for (const simulator::TrackObservation& o : camera.frame(s)) {
      ++seen, wrong += o.is_wrong ? 1 : 0;
      if (o.is_wrong) continue;
      const Eigen::Vector3d b = s.R_wb.transpose() * (camera.landmarks()[o.landmark].p_w_m - s.p_w_m);
      const Eigen::Vector3d c = rig.R_bc.transpose() * (b - rig.t_bc_m);
      const Eigen::Vector3d miss{o.u_left_px - (1373 * c.x() / c.z() + 992), o.v_px - (1373 * c.y() / c.z() + 333),
                                 o.u_left_px - o.u_right_px - 1373 * 0.498 / c.z()};
      CHECK(miss.cwiseAbs().maxCoeff() < 20);
      squares += miss.head<2>().squaredNorm() / 2;
    }
  }
  CHECK(seen > 30 * 201);
  CHECK(wrong > 0);
  CHECK(wrong < seen / 25);
  CHECK(std::sqrt(squares / (seen - wrong)) == doctest::Approx(0.7).epsilon(0.2));
}
