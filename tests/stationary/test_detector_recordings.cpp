// SPDX-License-Identifier: BSD-3-Clause
// The detector on recorded units: a car, a pedestrian, a quadrotor on the ground.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <searvins/imu/alignment.hpp>
#include <searvins/stationary/detector.hpp>

#include "tests/stationary/imu_recording.hpp"
#include "tests/support/shared_data.hpp"

using namespace searvins;

namespace {

/// The fix nearest a time.
const imu::PositionFix& nearest(const std::vector<imu::PositionFix>& fixes, GpsTime t) {
  auto at = std::lower_bound(fixes.begin(), fixes.end(), t, [](const imu::PositionFix& f, GpsTime time) { return f.time < time; });
  if (at == fixes.end()) --at;
  if (at != fixes.begin() && seconds_between(std::prev(at)->time, t) < std::abs(seconds_between(t, at->time))) --at;
  return *at;
}

struct Rates {
  double found{0}, missed{0}, false_alarm{0}, motion{0};  ///< seconds: of rest, and of motion above 0.5 m/s
  Eigen::Vector3d mean_accel{Eigen::Vector3d::Zero()};
  int rests{0};
};

Rates run(const test::ImuRecording& r, bool hints) {
  stationary::Detector detector;
  Rates rates;
  double n = 0;
  bool before = false;
  for (std::size_t i = 1, fix = 0; i < r.samples.size(); ++i) {
    const imu::ImuSample& s = r.samples[i];
    REQUIRE(detector.add(s).ok());
    for (; fix < r.fixes.size() && r.fixes[fix].time <= s.time; ++fix)
      if (hints && r.fixes[fix].has_velocity()) detector.set_speed_hint(r.fixes[fix].time, r.fixes[fix].velocity_e_mps.norm(), r.fixes[fix].sigma_velocity_mps);
    const double dt_s = seconds_between(r.samples[i - 1].time, s.time), speed = nearest(r.fixes, s.time).velocity_e_mps.norm();
    const bool rest = detector.stationary();
    if (speed < 0.05) (rest ? rates.found : rates.missed) += dt_s;
    if (speed > 0.5) rates.motion += dt_s, rates.false_alarm += rest ? dt_s : 0;
    if (rest) rates.mean_accel += (s.accel_b_mps2 - rates.mean_accel) / ++n;
    rates.rests += rest && !before ? 1 : 0;
    before = rest;
  }
  return rates;
}

}  // namespace

TEST_CASE("recordings: a car's stops are found and its motion is not taken for one") {
  const auto shared = test::shared_data();
  if (!shared) {
    MESSAGE("SKIPPED: shared data not found");
    return;
  }
  const test::ImuRecording car = test::read_imu_recording(*shared / "data/real/boulder_drive_2025", test::car_axes());
  for (const bool hints : {false, true}) {
    const Rates r = run(car, hints);
    MESSAGE(std::string{hints ? "car, hints: " : "car, IMU alone: "} << r.rests << " rests, found " << r.found << " s, missed " << r.missed << " s, false alarm "
                                                          << r.false_alarm << " s of " << r.motion << " s of motion, |mean accel| " << r.mean_accel.norm());
    CHECK(r.found > 0.7 * (r.found + r.missed));
    CHECK(r.false_alarm < 0.002 * r.motion);
    CHECK(r.mean_accel.norm() == doctest::Approx(9.796).epsilon(0.02));
  }
}

TEST_CASE("recordings: a pedestrian's rests are found") {
  const auto shared = test::shared_data();
  if (!shared) {
    MESSAGE("SKIPPED: shared data not found");
    return;
  }
  Eigen::Matrix3d R_b_raw;  // forward-right-down from the sensor: roll 180, yaw -90; then right-forward-up
  R_b_raw << 1, 0, 0, 0, 1, 0, 0, 0, 1;
  const test::ImuRecording walk = test::read_imu_recording(*shared / "data/real/boulder_walk_2025", R_b_raw);
  const Rates r = run(walk, true);
  MESSAGE("walk: " << r.rests << " rests, found " << r.found << " s, missed " << r.missed << " s, false alarm " << r.false_alarm << " s of " << r.motion
                   << " s of motion, |mean accel| " << r.mean_accel.norm());
  CHECK(r.found > 0.6 * (r.found + r.missed));
  CHECK(r.false_alarm == 0);
  CHECK(r.mean_accel.norm() == doctest::Approx(9.796).epsilon(0.02));
}

TEST_CASE("recordings: a quadrotor on the ground rests") {
  const auto shared = test::shared_data();
  if (!shared) {
    MESSAGE("SKIPPED: shared data not found");
    return;
  }
  const auto log = io::read_imu_log(*shared / "data/real/euroc_v101_static/mav0/imu0/data.csv");
  REQUIRE(log.ok());
  imu::ImuNoise adis;
  adis.accel_noise_mps2_sqrt_hz = 2e-3;
  adis.gyro_bias_sigma_radps = 0.05;  // its gyroscope rests at 0.077 rad/s
  stationary::Detector detector{adis};
  imu::RestStatistics rest;
  double found = 0, all = 0, most = 0;
  for (const imu::ImuSample& s : log.value.samples) {
    REQUIRE(detector.add(s).ok());
    if (to_utc(s.time).unix_ns < 1403715275'400'000'000 || to_utc(s.time).unix_ns > 1403715278'000'000'000) continue;
    all += 1, found += detector.stationary() ? 1 : 0;
    most = std::max(most, detector.accel_spread_mps2());
    rest.add(s);
  }
  MESSAGE("quadrotor: rest for " << 100 * found / all << " % of 2.6 s, |mean accel| " << rest.mean_accel_b_mps2().norm() << ", largest spread "
                                 << most << ", |mean gyro| " << rest.mean_gyro_b_radps().norm());
  CHECK(rest.mean_accel_b_mps2().norm() == doctest::Approx(9.81).epsilon(0.01));
  CHECK(found == all);
}
