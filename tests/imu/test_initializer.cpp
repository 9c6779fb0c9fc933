// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <cmath>
#include <numbers>
#include <string>

#include <searvins/geodesy/local_frame.hpp>
#include <searvins/imu/initializer.hpp>
#include <searvins/math/small_cholesky.hpp>

#include "tests/support/property.hpp"

using namespace searvins;
using imu::AlignmentState;
using imu::AlignmentWait;
using imu::HeadingSource;
using imu::Initializer;
using test::for_all_seeds;
using test::normal;
using test::Rng;
using test::uniform;

namespace {

using std::numbers::pi;
const Eigen::Vector3d kLocalGravity{0, 0, -9.8}, kEarth{0, 5.9e-5, 4.2e-5};

/// A vehicle in the plane with a unit mounted askew, its IMU at 100 Hz, its antenna's velocity and position at 1 Hz. Every step checks that the
/// initialisation says what it waits for.
struct Drive {
  Rng& rng;
  Initializer& initializer;
  double heading{0}, speed{0};  ///< speed below 0: reverse
  double roll{0.02}, pitch{-0.03};
  Eigen::Vector3d lever{0.3, 1.2, 0.8};
  Eigen::Vector3d accel_bias{0, 0, 0}, gyro_bias{0, 0, 0};
  imu::ImuNoise noise{};
  double sigma_v{0.05}, sigma_p{0.02};
  bool velocities{true}, positions{false};
  GpsTime time{100'000'000'000};
  Eigen::Vector3d p_w{0, 0, 0};

  [[nodiscard]] Eigen::Matrix3d R_wb() const { return imu::R_wb_from({0, 0, heading}) * imu::R_wb_from({roll, pitch, 0}); }
  [[nodiscard]] Eigen::Vector3d v_w() const { return speed * Eigen::Vector3d{std::sin(heading), std::cos(heading), 0}; }

  /// Drives with a forward acceleration and a heading rate (clockwise).
  void go(double seconds, double accel, double turn, bool at_rest = false) {
    for (int i = 0; i < static_cast<int>(std::lround(seconds * 100)); ++i) {
      const double dt = 0.01;
      time.ns += 10'000'000;
      p_w += (v_w() + dt / 2 * accel * v_w().normalized()) * (speed != 0 ? dt : 0);
      speed += accel * dt, heading += turn * dt;
      const Eigen::Vector3d forward{std::sin(heading), std::cos(heading), 0}, right{std::cos(heading), -std::sin(heading), 0};
      const Eigen::Matrix3d R_bw = R_wb().transpose();
      const Eigen::Vector3d rate = R_bw * Eigen::Vector3d{0, 0, -turn};
      imu::ImuSample s{time, rate + R_bw * kEarth + gyro_bias, R_bw * (accel * forward + speed * turn * right - kLocalGravity) + accel_bias};
      for (int k = 0; k < 3; ++k) {
        s.gyro_b_radps[k] += normal(rng, noise.gyro_noise_radps_sqrt_hz * 10);
        s.accel_b_mps2[k] += normal(rng, noise.accel_noise_mps2_sqrt_hz * 10);
      }
      REQUIRE(initializer.add_imu(s, at_rest).ok());
      CHECK(std::string{initializer.waiting_text()}.size() > 10);
      CHECK((initializer.waits_for() == AlignmentWait::nothing) == (initializer.state() == AlignmentState::aligned));
      if (time.ns % 1'000'000'000 != 0) continue;
      const Eigen::Vector3d noise_v{normal(rng, sigma_v), normal(rng, sigma_v), normal(rng, sigma_v)};
      const Eigen::Vector3d noise_p{normal(rng, sigma_p), normal(rng, sigma_p), normal(rng, sigma_p)};
      if (velocities) REQUIRE(initializer.add_velocity(time, v_w() + R_wb() * rate.cross(lever) + noise_v, sigma_v).ok());
      if (positions) REQUIRE(initializer.add_position(time, p_w + R_wb() * lever + noise_p, sigma_p).ok());
    }
  }
  [[nodiscard]] Eigen::Vector3d attitude_error() const { return so3::log(initializer.R_lb().transpose() * R_wb()); }
};

imu::InitializerSettings settings() {
  imu::InitializerSettings s;
  s.lever_arm_b_m = {0.3, 1.2, 0.8};
  return s;
}

}  // namespace

TEST_CASE("initializer: at rest, then driving east: collecting, levelled, aligned, each with its reason") {
  Rng rng{1};
  Initializer initializer{settings()};
  CHECK(initializer.waits_for() == AlignmentWait::gravity);
  CHECK(initializer.set_local_gravity(kLocalGravity, kEarth).ok());
  CHECK(initializer.waits_for() == AlignmentWait::imu);
  Drive drive{rng, initializer};
  drive.heading = pi / 2;
  drive.go(1, 0, 0, true);
  CHECK(initializer.state() == AlignmentState::collecting);
  CHECK(initializer.waits_for() == AlignmentWait::rest_or_velocity);
  CHECK(initializer.alignment(Eigen::Vector3d::Zero(), Eigen::Matrix3d::Identity()).status().code == StatusCode::under_determined);
  drive.go(4, 0, 0, true);
  CHECK(initializer.state() == AlignmentState::levelled);
  CHECK(initializer.waits_for() == AlignmentWait::heading_speed);
  CHECK(initializer.sigma_tilt_rad() < 0.006);
  CHECK(initializer.sigma_heading_rad() > 3);
  drive.go(1, 1.5, 0);  // pulls away
  CHECK(initializer.waits_for() == AlignmentWait::heading_speed);
  drive.go(1, 1.5, 0);
  CHECK(initializer.waits_for() == AlignmentWait::heading_confirmation);
  drive.go(1, 1.5, 0);
  REQUIRE(initializer.state() == AlignmentState::aligned);
  CHECK(initializer.heading_source() == HeadingSource::velocity);
  CHECK((initializer.R_lb().col(1) - Eigen::Vector3d::UnitX()).norm() < 0.1);  // the forward axis points east
  CHECK(std::abs(imu::wrapped(imu::heading_of(initializer.R_lb()) - pi / 2)) < 0.1);
  const auto a = initializer.alignment(drive.p_w + drive.R_wb() * drive.lever, 1e-4 * Eigen::Matrix3d::Identity());
  REQUIRE(a.ok());
  CHECK(a->from_rest);
  CHECK_FALSE(a->reversed);
  CHECK((a->state.p_wb_m - drive.p_w).norm() < 0.1);
  CHECK((a->state.v_wb_mps - drive.v_w()).norm() < 0.3);
  CHECK(a->time == drive.time);
  CHECK(a->sigmas()[imu::NavigationState::position] < 0.1);
}

TEST_CASE("initializer: property: after a rest the errors of attitude, velocity and biases have the covariance that is claimed") {
  double nees = 0;
  int n = 0;
  for_all_seeds(60, [&](Rng& rng) {
    imu::InitializerSettings s = settings();
    s.noise.accel_bias_sigma_mps2 = 0.03;
    s.course.sigma_course_rad = 0.01;
    Initializer initializer{s};
    REQUIRE(initializer.set_local_gravity(kLocalGravity, kEarth).ok());
    Drive drive{rng, initializer};
    drive.noise = s.noise;
    drive.heading = uniform(rng, -pi, pi);
    drive.roll = uniform(rng, -0.1, 0.1), drive.pitch = uniform(rng, -0.1, 0.1);
    for (int k = 0; k < 3; ++k) drive.accel_bias[k] = normal(rng, 0.03), drive.gyro_bias[k] = normal(rng, 0.01);
    drive.go(uniform(rng, 3, 20), 0, 0, true);
    drive.go(3, uniform(rng, 0.8, 2), uniform(rng, -0.05, 0.05));
    drive.go(6, 0, 0);
    REQUIRE(initializer.state() == AlignmentState::aligned);
    const auto a = initializer.alignment(drive.p_w + drive.R_wb() * drive.lever, 1e-4 * Eigen::Matrix3d::Identity());
    REQUIRE(a.ok());
    imu::NavigationState truth;
    truth.R_wb = drive.R_wb();
    truth.p_wb_m = drive.p_w;
    truth.v_wb_mps = drive.v_w();
    truth.accel_bias_b_mps2 = drive.accel_bias;
    truth.gyro_bias_b_radps = drive.gyro_bias;
    const imu::NavigationState::Step e = a->state.local(truth);
    const math::SmallCholesky<15> cholesky{a->covariance};
    REQUIRE(cholesky.ok());
    nees += e.dot(cholesky.solve(e));
    ++n;
    const imu::NavigationState::Step sigmas = a->sigmas();
    for (int i = 0; i < 15; ++i) {
      CAPTURE(i);
      CHECK(std::abs(e[i]) < 5 * sigmas[i]);
    }
  });
  MESSAGE("NEES of the aligned state: " << nees / n << " of 15");
  CHECK(nees / n > 15 * 0.2);  // position without noise and a cautious course: below its expectation, never above
  CHECK(nees / n < 15 * 1.3);
}

TEST_CASE("initializer: property: pulling away in reverse gives the heading of the bonnet, not of the boot") {
  for_all_seeds(20, [](Rng& rng) {
    Initializer initializer{settings()};
    REQUIRE(initializer.set_local_gravity(kLocalGravity, kEarth).ok());
    Drive drive{rng, initializer};
    drive.heading = uniform(rng, -pi, pi);
    drive.go(4, 0, 0, true);
    drive.go(5, -1, 0);
    drive.go(3, 0, uniform(rng, -0.05, 0.05));
    REQUIRE(initializer.state() == AlignmentState::aligned);
    CHECK(drive.attitude_error().norm() < 0.15);
    CHECK(initializer.alignment(drive.p_w, Eigen::Matrix3d::Identity())->reversed);
  });
}

TEST_CASE("initializer: property: a moving start levels between velocities and aligns within ten seconds") {
  for_all_seeds(30, [](Rng& rng) {
    Initializer initializer{settings()};
    REQUIRE(initializer.set_local_gravity(kLocalGravity, kEarth).ok());
    Drive drive{rng, initializer};
    drive.heading = uniform(rng, -pi, pi);
    drive.speed = uniform(rng, 8, 15);
    drive.sigma_v = uniform(rng, 0.03, 0.3);
    for (int k = 0; k < 3; ++k) drive.accel_bias[k] = normal(rng, 0.03), drive.gyro_bias[k] = normal(rng, 9e-4);
    drive.go(10, uniform(rng, -0.5, 2), uniform(rng, -0.03, 0.03));
    REQUIRE(initializer.state() == AlignmentState::aligned);
    const auto a = initializer.alignment(drive.p_w, Eigen::Matrix3d::Identity());
    REQUIRE(a.ok());
    CHECK_FALSE(a->from_rest);
    const Eigen::Vector3d error = drive.attitude_error();
    const math::SmallCholesky<3> attitude{Eigen::Matrix3d{a->covariance.topLeftCorner<3, 3>()}};
    REQUIRE(attitude.ok());
    CHECK(error.dot(attitude.solve(error)) < 25);  // five sigma
    CHECK(a->sigmas().head<3>().maxCoeff() < 0.15);
  });
}

TEST_CASE("initializer: a moving start without GNSS levels coarsely and says that it waits for a heading; a given heading aligns it") {
  Rng rng{5};
  Initializer initializer{settings()};
  REQUIRE(initializer.set_local_gravity(kLocalGravity, kEarth).ok());
  Drive drive{rng, initializer};
  drive.speed = 5, drive.velocities = false;
  CHECK(initializer.set_heading(0.1, 0.05).code == StatusCode::under_determined);
  drive.go(9, 0, 0.02);
  CHECK(initializer.state() == AlignmentState::collecting);
  drive.go(1.5, 0, 0.02);
  CHECK(initializer.state() == AlignmentState::aligned);  // the heading was kept
  CHECK(initializer.heading_source() == HeadingSource::given);
  CHECK(initializer.sigma_tilt_rad() > 0.03);
  CHECK(drive.attitude_error().head<2>().norm() < 3 * initializer.sigma_tilt_rad());

  Initializer second{settings()};
  REQUIRE(second.set_local_gravity(kLocalGravity, kEarth).ok());
  Drive again{rng, second};
  again.speed = 5, again.velocities = false;
  again.go(11, 0, 0);
  CHECK(second.state() == AlignmentState::levelled);
  CHECK(second.waits_for() == AlignmentWait::heading_source);
  CHECK(second.set_heading(0.05, 0.1).ok());
  CHECK(second.state() == AlignmentState::aligned);
  CHECK(second.sigma_heading_rad() == doctest::Approx(0.1));
  CHECK(second.alignment(Eigen::Vector3d::Zero(), Eigen::Matrix3d::Identity())->sigmas()[imu::NavigationState::velocity] == doctest::Approx(20));
}

TEST_CASE("initializer: a given heading at rest aligns at once, with zero velocity") {
  Rng rng{6};
  Initializer initializer{settings()};
  REQUIRE(initializer.set_local_gravity(kLocalGravity, kEarth).ok());
  Drive drive{rng, initializer};
  drive.heading = -2;
  drive.gyro_bias = {0.004, -0.003, 0.002};
  drive.go(3, 0, 0, true);
  CHECK(initializer.set_heading(-2, 0.02).ok());
  const auto a = initializer.alignment(Eigen::Vector3d::Zero(), 1e-4 * Eigen::Matrix3d::Identity());
  REQUIRE(a.ok());
  CHECK(a->state.v_wb_mps.norm() == 0);
  CHECK(a->sigmas()[imu::NavigationState::velocity] < 0.1);
  CHECK(drive.attitude_error().norm() < 0.01);
  CHECK((a->state.gyro_bias_b_radps - drive.gyro_bias).norm() < 4e-4);
  CHECK(initializer.set_heading(std::nan(""), 1).code == StatusCode::non_finite);
  CHECK(initializer.set_heading(1, 0).code == StatusCode::invalid_argument);
}

TEST_CASE("initializer: property: RTK displacements alone give the heading after a rest") {
  for_all_seeds(20, [](Rng& rng) {
    Initializer initializer{settings()};
    REQUIRE(initializer.set_local_gravity(kLocalGravity, kEarth).ok());
    Drive drive{rng, initializer};
    drive.velocities = false, drive.positions = true;
    drive.heading = uniform(rng, -pi, pi);
    drive.go(4, 0, 0, true);
    CHECK(initializer.state() == AlignmentState::levelled);
    drive.go(4, 1, uniform(rng, -0.01, 0.01));
    drive.go(6, 0, 0);
    REQUIRE(initializer.state() == AlignmentState::aligned);
    CHECK(initializer.heading_source() == HeadingSource::displacement);
    CHECK(drive.attitude_error().norm() < 5 * std::hypot(initializer.sigma_heading_rad(), initializer.sigma_tilt_rad()));
    CHECK(initializer.sigma_heading_rad() < 0.1);
  });
}

TEST_CASE("initializer: one wild velocity does not point the vehicle anywhere; a vague one and a turn are named") {
  Rng rng{7};
  Initializer initializer{settings()};
  REQUIRE(initializer.set_local_gravity(kLocalGravity, kEarth).ok());
  Drive drive{rng, initializer};
  drive.go(4, 0, 0, true);
  drive.velocities = false;
  drive.go(5, 1, 0);
  CHECK(initializer.add_velocity(drive.time, {-5, 0, 0}, 0.05).ok());  // the truth is north
  CHECK(initializer.waits_for() == AlignmentWait::heading_confirmation);
  drive.go(0.5, 0, 0);
  CHECK(initializer.add_velocity(drive.time, drive.v_w(), 0.05).ok());
  CHECK(initializer.waits_for() == AlignmentWait::heading_confirmation);
  CHECK(initializer.add_velocity(drive.time, drive.v_w(), 3).ok());
  CHECK(initializer.waits_for() == AlignmentWait::heading_certainty);
  drive.go(0.5, 0, 0.5);
  CHECK(initializer.add_velocity(drive.time, drive.v_w(), 0.05).ok());
  CHECK(initializer.waits_for() == AlignmentWait::heading_straight);
  drive.go(0.5, 0, 0);
  CHECK(initializer.add_velocity(drive.time, drive.v_w(), 0.05).ok());
  REQUIRE(initializer.state() == AlignmentState::aligned);
  CHECK(drive.attitude_error().norm() < 0.1);
}

TEST_CASE("initializer: a gap starts anew; bad input is refused and changes nothing") {
  Rng rng{8};
  Initializer initializer{settings()};
  CHECK(initializer.set_local_gravity({0, 0, 1}, kEarth).code == StatusCode::invalid_argument);
  CHECK(initializer.set_local_gravity({0, 0, std::nan("")}, kEarth).code == StatusCode::non_finite);
  Drive drive{rng, initializer};
  drive.velocities = false;
  CHECK(initializer.add_velocity(drive.time, {1, 2, 3}, 0.1).code == StatusCode::stale);
  drive.go(3, 0, 0, true);  // rests before gravity is known
  CHECK(initializer.waits_for() == AlignmentWait::gravity);
  REQUIRE(initializer.set_local_gravity(kLocalGravity, kEarth).ok());
  drive.go(0.6, 0, 0, true);
  CHECK(initializer.state() == AlignmentState::levelled);  // and the rest counted

  const Eigen::Matrix3d before = initializer.R_lb();
  const imu::ImuSample good{drive.time, Eigen::Vector3d::Zero(), Eigen::Vector3d{0, 0, 9.8}};
  CHECK(initializer.add_imu(good, true).code == StatusCode::duplicate);
  CHECK(initializer.add_imu({GpsTime{drive.time.ns - 1}, good.gyro_b_radps, good.accel_b_mps2}, true).code == StatusCode::out_of_order);
  CHECK(initializer.add_imu({GpsTime{drive.time.ns + 1}, good.gyro_b_radps, Eigen::Vector3d::Constant(std::nan(""))}, true).code == StatusCode::non_finite);
  CHECK(initializer.add_velocity(drive.time, {1, 2, std::nan("")}, 0.1).code == StatusCode::non_finite);
  CHECK(initializer.add_velocity(drive.time, {1, 2, 3}, 0).code == StatusCode::invalid_argument);
  CHECK(initializer.add_position(drive.time, {1, 2, 3}, -1).code == StatusCode::invalid_argument);
  CHECK(initializer.add_position(GpsTime{drive.time.ns - 10'000'000'000}, {1, 2, 3}, 1).code == StatusCode::stale);
  CHECK(initializer.R_lb() == before);

  drive.time.ns += 1'000'000'000;
  drive.go(0.5, 0, 0, true);
  CHECK(initializer.state() == AlignmentState::collecting);
  CHECK(initializer.waits_for() == AlignmentWait::rest_or_velocity);
  CHECK(sizeof(Initializer) < 4096);
}
