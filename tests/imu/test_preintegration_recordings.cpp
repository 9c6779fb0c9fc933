// SPDX-License-Identifier: BSD-3-Clause
// Preintegration of a real unit (EuRoC V1_02, ADIS16448 at 200 Hz on a multicopter) over intervals of one second, against the state truth
// of the recording.
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <searvins/imu/prediction.hpp>
#include <searvins/imu/preintegration.hpp>

#include "support/property.hpp"
#include "support/shared_data.hpp"

using namespace searvins;
using namespace searvins::test;
using Eigen::Vector3d;
using imu::ImuSample;
using imu::NavigationState;

namespace {

/// Rows of a comma-separated file after its header: the stamp in nanoseconds, then numbers.
struct Row {
  std::int64_t ns;
  std::vector<double> x;
};
std::vector<Row> read_rows(const std::filesystem::path& file, std::size_t columns) {
  std::vector<Row> rows;
  std::ifstream in{file};
  std::string line;
  while (std::getline(in, line)) {
    if (line.empty() || line[0] == '#') continue;
    char* at = nullptr;
    Row row{std::strtoll(line.c_str(), &at, 10), {}};
    while (*at == ',') row.x.push_back(std::strtod(at + 1, &at));
    REQUIRE(row.x.size() == columns);
    rows.push_back(row);
  }
  return rows;
}

struct Recording {
  std::vector<ImuSample> samples;
  struct Truth {
    GpsTime time;
    NavigationState state;
  };
  std::vector<Truth> truth;
};

Recording read_recording(const std::filesystem::path& folder) {
  Recording r;
  for (const Row& row : read_rows(folder / "imu0/data.csv", 6))
    r.samples.push_back({{row.ns}, {row.x[0], row.x[1], row.x[2]}, {row.x[3], row.x[4], row.x[5]}});
  for (const Row& row : read_rows(folder / "gt0/data.csv", 16)) {
    NavigationState s;
    s.p_wb_m = {row.x[0], row.x[1], row.x[2]};
    s.R_wb = so3::matrix_from_quaternion(Eigen::Quaterniond{row.x[3], row.x[4], row.x[5], row.x[6]});
    s.v_wb_mps = {row.x[7], row.x[8], row.x[9]};
    s.gyro_bias_b_radps = {row.x[10], row.x[11], row.x[12]}, s.accel_bias_b_mps2 = {row.x[13], row.x[14], row.x[15]};
    r.truth.push_back({{row.ns}, s});
  }
  return r;
}

double percentile(std::vector<double> v, double share) {
  std::sort(v.begin(), v.end());
  return v[static_cast<std::size_t>(share * static_cast<double>(v.size() - 1))];
}

}  // namespace

TEST_CASE("EuRoC V1_02: a second of preintegration against the state truth") {
  const auto shared = shared_data();
  if (!shared || !std::filesystem::exists(*shared / "data/real/euroc_v102_imu")) {
    MESSAGE("SKIPPED: shared data not found");
    return;
  }
  const Recording r = read_recording(*shared / "data/real/euroc_v102_imu");
  REQUIRE(r.samples.size() > 7000);
  const imu::ConstantGravity gravity{Vector3d{0, 0, -9.81}};  // the laboratory's axes: z up, heading unknown, so no Earth rotation
  std::vector<double> attitude, position, velocity, way, attitude_of_other_kind;
  imu::PreintegrationOptions other;
  other.kind = imu::SampleKind::mean_to_stamp;
  for (std::size_t k = 0; k + 40 < r.truth.size(); k += 10) {
    const auto &a = r.truth[k], &b = r.truth[k + 40];
    if (b.time > r.samples.back().time || seconds_between(a.time, b.time) > 1.01) continue;
    const auto motion = imu::preintegrate<double>(r.samples, a.time, b.time, imu::bias_of(a.state));
    const auto as_means = imu::preintegrate<double>(r.samples, a.time, b.time, imu::bias_of(a.state), other);
    REQUIRE((motion.ok() && as_means.ok()));
    const NavigationState::Step d = b.state.local(imu::predict(a.state, *motion, gravity));
    attitude.push_back(d.segment<3>(0).norm()), position.push_back(d.segment<3>(3).norm()), velocity.push_back(d.segment<3>(6).norm());
    way.push_back((b.state.p_wb_m - a.state.p_wb_m).norm());
    attitude_of_other_kind.push_back(b.state.local(imu::predict(a.state, *as_means, gravity)).head<3>().norm());
  }
  MESSAGE("intervals ", attitude.size(), ", median way ", percentile(way, 0.5), " m");
  MESSAGE("attitude, mrad: median ", 1e3 * percentile(attitude, 0.5), ", 95 % ", 1e3 * percentile(attitude, 0.95),
          "; samples taken for means: median ", 1e3 * percentile(attitude_of_other_kind, 0.5));
  MESSAGE("position, mm:   median ", 1e3 * percentile(position, 0.5), ", 95 % ", 1e3 * percentile(position, 0.95));
  MESSAGE("velocity, mm/s: median ", 1e3 * percentile(velocity, 0.5), ", 95 % ", 1e3 * percentile(velocity, 0.95));
  // Measured: 152 intervals; 1.29 and 3.5 mrad, 26 and 51 mm, 48 and 93 mm/s. The truth's own vertical is good to some 4 mrad, which is 40
  // mm/s.
  CHECK(attitude.size() > 140);
  CHECK(percentile(attitude, 0.5) < 1.6e-3);
  CHECK(percentile(attitude, 0.95) < 4.2e-3);
  CHECK(percentile(position, 0.5) < 0.032);
  CHECK(percentile(position, 0.95) < 0.062);
  CHECK(percentile(velocity, 0.5) < 0.058);
  CHECK(percentile(velocity, 0.95) < 0.112);
  CHECK(percentile(attitude_of_other_kind, 0.5) > 1.5 * percentile(attitude, 0.5));  // this unit's samples are instantaneous, and it shows
}
