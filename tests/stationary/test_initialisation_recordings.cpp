// SPDX-License-Identifier: BSD-3-Clause
// Detector and initialisation together, on a recorded car and on a simulated drive.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <searvins/geodesy/local_frame.hpp>
#include <searvins/imu/initializer.hpp>
#include <searvins/stationary/detector.hpp>

#include "tests/stationary/imu_recording.hpp"
#include "tests/support/property.hpp"
#include "tests/support/shared_data.hpp"

using namespace searvins;

TEST_CASE("recordings: the car is levelled at its first stop and finds its heading when it drives; a minute later the heading still is the course") {
  const auto shared = test::shared_data();
  if (!shared) {
    MESSAGE("SKIPPED: shared data not found");
    return;
  }
  const test::ImuRecording car = test::read_imu_recording(*shared / "data/real/boulder_drive_2025", test::car_axes());
  const geodesy::LocalFrame w = geodesy::LocalFrame::at(car.fixes.front().position_e_m);
  imu::InitializerSettings settings;
  settings.noise.accel_bias_sigma_mps2 = 0.2;
  settings.noise.gyro_bias_sigma_radps = 5e-3;
  imu::Initializer initializer{settings};
  REQUIRE(initializer
              .set_local_gravity(w.R_ew.transpose() * geodesy::gravity_e_mps2(car.fixes.front().position_e_m),
                                 w.R_ew.transpose() * Eigen::Vector3d{0, 0, geodesy::kEarthRateRadps})
              .ok());
  stationary::Detector detector{settings.noise};
  std::size_t fix = 0;
  double levelled_s = -1, aligned_s = -1, sigma = 0;
  std::vector<double> errors_deg;
  const GpsTime start = car.samples.front().time;
  for (const imu::ImuSample& s : car.samples) {
    REQUIRE(detector.add(s).ok());
    REQUIRE(initializer.add_imu(s, detector.stationary()).ok());
    const double t = seconds_between(start, s.time);
    for (; fix < car.fixes.size() && car.fixes[fix].time <= s.time; ++fix) {
      const imu::PositionFix& f = car.fixes[fix];
      const Eigen::Vector3d v_w = w.R_ew.transpose() * f.velocity_e_mps;
      detector.set_speed_hint(f.time, v_w.norm(), f.sigma_velocity_mps);
      if (seconds_between(f.time, s.time) < 0.1) CHECK(initializer.add_velocity(f.time, v_w, f.sigma_velocity_mps).ok());
      const bool straight = std::abs(s.gyro_b_radps.z() - initializer.gyro_bias_b_radps().z()) < 0.05;
      if (aligned_s >= 0 && t < aligned_s + 60 && v_w.norm() > 5 && straight)
        errors_deg.push_back(std::abs(imu::wrapped(imu::heading_of(initializer.R_lb()) - imu::course_of(v_w))) * 180 / std::numbers::pi);
    }
    if (levelled_s < 0 && initializer.state() != imu::AlignmentState::collecting) levelled_s = t;
    if (aligned_s < 0 && initializer.state() == imu::AlignmentState::aligned) aligned_s = t, sigma = initializer.sigma_heading_rad() * 180 / std::numbers::pi;
  }
  REQUIRE(aligned_s > 0);
  REQUIRE(errors_deg.size() > 20);
  std::nth_element(errors_deg.begin(), errors_deg.begin() + static_cast<std::ptrdiff_t>(errors_deg.size() / 2), errors_deg.end());
  const auto angles = imu::attitude_angles(initializer.R_lb());
  MESSAGE("car: levelled after " << levelled_s << " s, aligned after " << aligned_s << " s by " << std::string{name_of(initializer.heading_source())} << ", sigma " << sigma
                                 << " deg, median difference of heading and course in the minute after " << errors_deg[errors_deg.size() / 2]
                                 << " deg; at the end roll, pitch " << angles.roll_rad * 57.3 << " and " << angles.pitch_rad * 57.3 << " deg");
  CHECK(levelled_s < 15);
  CHECK(errors_deg[errors_deg.size() / 2] < 3);
  CHECK(initializer.heading_source() == imu::HeadingSource::velocity);
}

TEST_CASE("recordings: a simulated drive whose ride is smooth: with velocities no motion is taken for rest, and the attitude is that of the truth") {
  const auto shared = test::shared_data();
  if (!shared) {
    MESSAGE("SKIPPED: shared data not found");
    return;
  }
  Eigen::Matrix3d R_b_raw;  // the rig's axes: ["-x", "y", "-z"]
  R_b_raw << -1, 0, 0, 0, 1, 0, 0, 0, -1;
  auto log = io::read_imu_log(*shared / "data/twin/a-clean/imu.log");
  const auto text = io::read_text_file((*shared / "data/twin/a-clean/truth.csv").string());
  REQUIRE(log.ok());
  REQUIRE(text.ok());
  CHECK(io::check_gravity_axis(log.value.samples, Eigen::Matrix3d::Identity(), "imu.log"));  // raw axes: said
  io::turn_axes(log.value.samples, R_b_raw);
  CHECK_FALSE(io::check_gravity_axis(log.value.samples, R_b_raw, "imu.log"));

  struct Truth {
    GpsTime time{};
    Eigen::Vector3d p_e_m{Eigen::Vector3d::Zero()}, v_w{Eigen::Vector3d::Zero()};
    Eigen::Matrix3d R_wb{Eigen::Matrix3d::Identity()};
  };
  std::vector<Truth> truth;
  io::LineReader lines{*text};
  std::string_view line;
  while (lines.next(line)) {
    const auto fields = io::split(line, ',');
    std::array<double, 17> v{};
    bool ok = fields.size() >= v.size();
    for (std::size_t i = 0; ok && i < v.size(); ++i) ok = io::parse_number(fields[i], v[i]);
    if (!ok) continue;
    truth.push_back({GpsTime::from_week_sow(2323, v[0]), {v[1], v[2], v[3]}, {v[14], v[15], v[16]}, so3::matrix_from_quaternion(Eigen::Quaterniond{v[7], v[8], v[9], v[10]})});
  }
  REQUIRE(truth.size() > 11000);

  // Velocities of 5 cm/s at 1 Hz, sometimes missing; starts at sow 553950, and in the middle of the drive, on the move.
  for (const double begin_s : {0.0, 240.0, 560.0}) {
    test::Rng rng{3};
    imu::InitializerSettings settings;
    settings.lever_arm_b_m = {0.284, -0.517, 0.142};
    imu::Initializer initializer{settings};
    stationary::Detector detector{settings.noise};
    const Eigen::Vector3d p_e = truth.front().p_e_m;
    const geodesy::LocalFrame w = geodesy::LocalFrame::at(p_e);
    REQUIRE(initializer.set_local_gravity(w.R_ew.transpose() * geodesy::gravity_e_mps2(p_e), w.R_ew.transpose() * Eigen::Vector3d{0, 0, geodesy::kEarthRateRadps}).ok());
    double aligned_s = -1, rest_s = 0, found_s = 0, motion_s = 0, false_alarm_s = 0, tilt = 0, heading = 0;
    std::size_t k = 0;
    for (const imu::ImuSample& s : log.value.samples) {
      const double t = seconds_between(truth.front().time, s.time);
      if (t < begin_s) continue;
      REQUIRE(detector.add(s).ok());
      REQUIRE(initializer.add_imu(s, detector.stationary()).ok());
      while (k + 1 < truth.size() && truth[k].time < s.time) ++k;
      if (truth[k].time != s.time) continue;
      const double speed = truth[k].v_w.norm();
      (speed < 0.02 ? rest_s : motion_s) += 0.1;
      if (speed < 0.02 && detector.stationary()) found_s += 0.1;
      if (speed > 0.3 && detector.stationary()) false_alarm_s += 0.1;
      if (s.time.ns % kNanosecondsPerSecond == 0) {
        const Eigen::Vector3d v = truth[k].v_w + Eigen::Vector3d{test::normal(rng, 0.05), test::normal(rng, 0.05), test::normal(rng, 0.05)};
        detector.set_speed_hint(s.time, v.norm(), 0.087);
        CHECK(initializer.add_velocity(s.time, v, 0.05).ok());
      }
      if (aligned_s >= 0 || initializer.state() != imu::AlignmentState::aligned) continue;
      aligned_s = t - begin_s;
      const Eigen::Vector3d error = truth[k].R_wb * so3::log(initializer.R_lb().transpose() * truth[k].R_wb);
      tilt = error.head<2>().norm(), heading = std::abs(error.z());
      MESSAGE("twin from " << begin_s << " s: aligned after " << aligned_s << " s, tilt error " << tilt * 57.3 << " deg of sigma " << initializer.sigma_tilt_rad() * 57.3
                           << ", heading error " << heading * 57.3 << " deg of sigma " << initializer.sigma_heading_rad() * 57.3);
      CHECK(tilt < 4 * initializer.sigma_tilt_rad());
      CHECK(heading < 4 * initializer.sigma_heading_rad());
    }
    MESSAGE("twin from " << begin_s << " s: rest found for " << found_s << " of " << rest_s << " s, false alarm " << false_alarm_s << " of " << motion_s << " s");
    CHECK(aligned_s >= 0);
    CHECK(found_s > 0.9 * rest_s);
    CHECK(false_alarm_s < 0.01 * motion_s);
  }
}
