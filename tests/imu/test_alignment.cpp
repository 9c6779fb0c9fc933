// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include <searvins/geodesy/local_frame.hpp>
#include <searvins/imu/alignment.hpp>
#include <searvins/imu/heading.hpp>
#include <searvins/io/trajectory_export.hpp>
#include <searvins/math/small_cholesky.hpp>

#include "tests/support/property.hpp"

using namespace searvins;
using imu::ImuSample;
using test::for_all_seeds;
using test::normal;
using test::Rng;
using test::uniform;

namespace {

using std::numbers::pi;
const Eigen::Vector3d kGravity{0, 0, -9.8};

/// Attitude of any heading and of up to `tilt` radians of roll and pitch.
Eigen::Matrix3d random_attitude(Rng& rng, double tilt) {
  return imu::R_wb_from({uniform(rng, -tilt, tilt), uniform(rng, -tilt, tilt), uniform(rng, -pi, pi)});
}

/// A rest of `seconds` at 100 Hz.
imu::RestStatistics rest_of(Rng& rng, const Eigen::Matrix3d& R_wb, const Eigen::Vector3d& accel_bias, const Eigen::Vector3d& gyro_bias,
                            const Eigen::Vector3d& earth_w, const imu::ImuNoise& noise, double seconds) {
  imu::RestStatistics rest;
  const Eigen::Vector3d f = -(R_wb.transpose() * kGravity) + accel_bias, w = R_wb.transpose() * earth_w + gyro_bias;
  for (int i = 0; i <= static_cast<int>(seconds * 100); ++i) {
    ImuSample s{GpsTime{i * 10'000'000LL}, w, f};
    for (int k = 0; k < 3; ++k) {
      s.gyro_b_radps[k] += normal(rng, noise.gyro_noise_radps_sqrt_hz * 10);
      s.accel_b_mps2[k] += normal(rng, noise.accel_noise_mps2_sqrt_hz * 10);
    }
    rest.add(s);
  }
  return rest;
}

}  // namespace

TEST_CASE("attitude angles: a level body driving east heads 90 degrees, its forward axis is east and its right axis south") {
  const Eigen::Matrix3d east = imu::R_wb_from({0, 0, pi / 2});
  CHECK((east.col(1) - Eigen::Vector3d::UnitX()).norm() < 1e-15);
  CHECK((east.col(0) + Eigen::Vector3d::UnitY()).norm() < 1e-15);
  CHECK((east.col(2) - Eigen::Vector3d::UnitZ()).norm() < 1e-15);
  CHECK(imu::heading_of(east) == doctest::Approx(pi / 2));
  CHECK(imu::course_of({3, 0, 1}) == doctest::Approx(pi / 2));
  CHECK(imu::course_of({0, -2, 0}) == doctest::Approx(pi));
  CHECK(imu::course_of({-1, 1, 0}) == doctest::Approx(-pi / 4));
  const Eigen::Matrix3d nose_up = imu::R_wb_from({0, 0.2, 0});
  CHECK(nose_up(2, 1) == doctest::Approx(std::sin(0.2)));  // forward axis rises
  const Eigen::Matrix3d right_down = imu::R_wb_from({0.3, 0, 0});
  CHECK(right_down(2, 0) == doctest::Approx(-std::sin(0.3)));  // right axis sinks
}

TEST_CASE("attitude angles: property: to angles and back, and the writer of trajectories agrees") {
  for_all_seeds(200, [](Rng& rng) {
    const imu::AttitudeAngles a{uniform(rng, -pi, pi), uniform(rng, -1.5, 1.5), uniform(rng, -pi, pi)};
    const Eigen::Matrix3d R = imu::R_wb_from(a);
    CHECK((R.transpose() * R - Eigen::Matrix3d::Identity()).norm() < 1e-14);
    CHECK(R.determinant() == doctest::Approx(1));
    CHECK((R - io::R_wb_from_angles(a.roll_rad * 180 / pi, a.pitch_rad * 180 / pi, a.heading_rad * 180 / pi)).norm() < 1e-13);
    const imu::AttitudeAngles b = imu::attitude_angles(R);
    CHECK(std::abs(imu::wrapped(a.roll_rad - b.roll_rad)) < 1e-10);
    CHECK(std::abs(a.pitch_rad - b.pitch_rad) < 1e-10);
    CHECK(std::abs(imu::wrapped(a.heading_rad - b.heading_rad)) < 1e-10);
  });
}

TEST_CASE("rest statistics: property: mean and covariance are those of the samples, however the samples are split") {
  for_all_seeds(50, [](Rng& rng) {
    imu::RestStatistics whole, first, second;
    std::vector<Eigen::Vector3d> values;
    const int n = test::integer(rng, 2, 60), cut = test::integer(rng, 0, n);
    for (int i = 0; i < n; ++i) {
      const ImuSample s{GpsTime{i * 1000LL}, test::random_vector<3>(rng), Eigen::Vector3d{0, 0, 1e4} + test::random_vector<3>(rng, 1e-3)};
      values.push_back(s.accel_b_mps2);
      whole.add(s);
      (i < cut ? first : second).add(s);
    }
    first.merge(second);
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& v : values) mean += v / n;
    Eigen::Matrix3d cov = Eigen::Matrix3d::Zero();
    for (const Eigen::Vector3d& v : values) cov += (v - mean) * (v - mean).transpose() / (n - 1);
    for (const imu::RestStatistics* r : {&whole, &first}) {
      CHECK(r->count() == n);
      CHECK((r->mean_accel_b_mps2() - mean).norm() < 1e-11);
      CHECK((r->accel_covariance() - cov).norm() < 1e-6 * cov.norm());
      CHECK(r->duration_s() == doctest::Approx((n - 1) * 1e-6));
    }
    CHECK((whole.gyro_covariance() - first.gyro_covariance()).norm() < 1e-12);
  });
  imu::RestStatistics rest;
  rest.add({GpsTime{1}, Eigen::Vector3d{std::nan(""), 0, 0}, Eigen::Vector3d::Zero()});
  CHECK(rest.count() == 0);
}

TEST_CASE("attitude from force: property: the force is met exactly, and so is the heading, also where the force is not vertical") {
  for_all_seeds(200, [](Rng& rng) {
    const Eigen::Matrix3d truth = random_attitude(rng, 0.7);
    const Eigen::Vector3d force_w = Eigen::Vector3d{0, 0, 9.8} + test::random_vector<3>(rng, 3.0);
    const Eigen::Vector3d force_b = uniform(rng, 0.5, 2) * truth.transpose() * force_w;
    const auto R = imu::attitude_from_force(force_b, force_w, imu::heading_of(truth));
    REQUIRE(R.ok());
    CHECK((*R * force_b.normalized() - force_w.normalized()).norm() < 1e-12);
    CHECK(std::abs(imu::wrapped(imu::heading_of(*R) - imu::heading_of(truth))) < 1e-10);
    CHECK(so3::log(R->transpose() * truth).norm() < 1e-9);
  });
}

TEST_CASE("attitude from force: what cannot level is refused") {
  CHECK(imu::attitude_from_force({0, 0, 1}, -kGravity, 0).status().code == StatusCode::invalid_argument);  // in g
  CHECK(imu::attitude_from_force({0, 9.8, 0}, -kGravity, 0).status().code == StatusCode::invalid_argument);
  CHECK(imu::attitude_from_force({0, std::nan(""), 9}, -kGravity, 0).status().code == StatusCode::non_finite);
  imu::RestStatistics few;
  for (int i = 0; i < 9; ++i) few.add({GpsTime{i * 1000LL}, Eigen::Vector3d::Zero(), -kGravity});
  CHECK(imu::align_at_rest(few, {}, kGravity, Eigen::Vector3d::Zero(), 0, 1).status().code == StatusCode::too_few);
  imu::RestStatistics ft;
  for (int i = 0; i < 20; ++i) ft.add({GpsTime{i * 1000LL}, Eigen::Vector3d::Zero(), Eigen::Vector3d{0, 0, 12}});
  CHECK(imu::align_at_rest(ft, {}, kGravity, Eigen::Vector3d::Zero(), 0, 1).status().code == StatusCode::rejected);
}

TEST_CASE("alignment at rest: property: attitude, gyroscope bias and the tie of tilt to accelerometer bias have the covariance they claim") {
  // Errors (d, b_a, gyro bias error) of 9 dimensions against the joint covariance: the mean NEES is 9.
  const geodesy::Geodetic place{0.61, 2.39, 80};
  const Eigen::Vector3d earth_w = geodesy::ecef_from_enu(place).transpose() * Eigen::Vector3d{0, 0, geodesy::kEarthRateRadps};
  double nees = 0, nees_tilt = 0;
  int n = 0;
  for_all_seeds(300, [&](Rng& rng) {
    imu::ImuNoise noise;
    noise.accel_bias_sigma_mps2 = 0.02;
    const Eigen::Matrix3d truth = random_attitude(rng, 0.5);
    Eigen::Vector3d accel_bias, gyro_bias = test::random_vector<3>(rng, 0.01);
    for (int k = 0; k < 3; ++k) accel_bias[k] = normal(rng, noise.accel_bias_sigma_mps2);
    const imu::RestStatistics rest = rest_of(rng, truth, accel_bias, gyro_bias, earth_w, noise, 3);
    const double sigma_heading = 0.02, heading = imu::heading_of(truth) + normal(rng, sigma_heading);
    const auto a = imu::align_at_rest(rest, noise, kGravity, earth_w, heading, sigma_heading);
    REQUIRE(a.ok());
    Eigen::Matrix<double, 6, 1> error;
    error << so3::log(a->R_wb.transpose() * truth), accel_bias;
    Eigen::Matrix<double, 6, 6> C;
    C << a->attitude_covariance, a->attitude_accel_bias, a->attitude_accel_bias.transpose(),
        noise.accel_bias_sigma_mps2 * noise.accel_bias_sigma_mps2 * Eigen::Matrix3d::Identity();
    const math::SmallCholesky<6> joint{C};
    const math::SmallCholesky<3> gyro{a->gyro_bias_covariance}, tilt{a->attitude_covariance};
    REQUIRE(joint.ok());
    REQUIRE(gyro.ok());
    const Eigen::Vector3d gyro_error = gyro_bias - a->gyro_bias_b_radps;
    nees += error.dot(joint.solve(error)) + gyro_error.dot(gyro.solve(gyro_error));
    nees_tilt += error.head<3>().dot(tilt.solve(error.head<3>()));
    ++n;
    CHECK(error.head<3>().norm() < 5 * std::sqrt(a->attitude_covariance.trace()));
  });
  if (n >= 100) {  // chi-square of 9 n degrees: relative sigma sqrt(2 / (9 n)), 2.7 % at 300
    MESSAGE("NEES of attitude, accelerometer and gyroscope bias: " << nees / n << " of 9; of attitude alone " << nees_tilt / n << " of 3");
    CHECK(nees / n > 9 * (1 - 5 * std::sqrt(2.0 / (9 * n))));
    CHECK(nees / n < 9 * (1 + 5 * std::sqrt(2.0 / (9 * n))));
    CHECK(nees_tilt / n > 3 * (1 - 5 * std::sqrt(2.0 / (3 * n))));
    CHECK(nees_tilt / n < 3 * (1 + 5 * std::sqrt(2.0 / (3 * n))));
  }
}

TEST_CASE("heading from velocity: the antenna's own motion in a turn is taken out") {
  // A vehicle heads 30 degrees at 5 m/s and turns left at 0.2 rad/s; the antenna is 2 m forward: it moves sideways to the left.
  const double heading = 30 * pi / 180;
  const Eigen::Vector3d rate{0, 0, 0.2}, arm{0.3, 2, 1};
  const Eigen::Vector3d v_level = Eigen::Vector3d{0, 5, 0} + rate.cross(arm);
  CHECK(v_level.x() == doctest::Approx(-0.4));
  const Eigen::Vector3d v_w = imu::upright_axes(Eigen::Vector3d::UnitZ(), heading) * v_level;
  const imu::HeadingEstimate h = imu::heading_from_velocity(v_w, 0.1, rate, arm);
  CHECK(h.heading_rad == doctest::Approx(heading));
  CHECK(h.sigma_rad == doctest::Approx(std::sqrt((0.01 + 0.09) / v_w.head<2>().squaredNorm() + 0.035 * 0.035)));
}

TEST_CASE("heading: property: from velocities and displacements with noise, the errors have the sigma they claim") {
  for_all_seeds(200, [](Rng& rng) {
    const double heading = uniform(rng, -pi, pi), speed = uniform(rng, 2, 20), sigma = 0.05;
    const Eigen::Vector3d forward{std::sin(heading), std::cos(heading), 0};
    const Eigen::Vector3d noise{normal(rng, sigma), normal(rng, sigma), normal(rng, sigma)};
    imu::CourseModel exact;
    exact.sigma_course_rad = 0;
    const auto v = imu::heading_from_velocity(speed * forward + noise, sigma, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), exact);
    CHECK(std::abs(imu::wrapped(v.heading_rad - heading)) < 5 * v.sigma_rad);
    CHECK(v.sigma_rad < 1.2 * sigma / speed);
    const auto d = imu::heading_from_displacement(speed * forward + noise, sigma, 0, 1, exact);
    CHECK(std::abs(imu::wrapped(d.heading_rad - heading)) < 5 * d.sigma_rad);
    CHECK(imu::heading_from_displacement(speed * forward, sigma, 0.05, 1, exact).sigma_rad > 0.025);
  });
}
