// SPDX-License-Identifier: BSD-3-Clause
// How a recording of an unknown unit begins: its axes, and the rest that is played before it.
#include <doctest/doctest.h>

#include <Eigen/Core>

#include <cmath>
#include <cstddef>
#include <vector>

#include <searvins/imu/initializer.hpp>
#include <searvins/stationary/detector.hpp>

#include "examples/searvins/euroc_start.hpp"
#include "support/property.hpp"

using namespace searvins;
using namespace searvins::examples;
using searvins::test::close;
using searvins::test::for_all_seeds;
using searvins::test::integer;
using searvins::test::normal;
using searvins::test::random_vector;
using searvins::test::Rng;
using searvins::test::uniform;

namespace {

constexpr double kRateHz = 200, kGravityMps2 = 9.81;

/// Readings of a body that is held: its means over a tenth of a second wander by the sigmas.
std::vector<imu::ImuSample> held(Rng& rng, double length_s, const Eigen::Vector3d& gyro, const Eigen::Vector3d& accel, double gyro_sigma,
                                 double accel_sigma) {
  std::vector<imu::ImuSample> readings;
  Eigen::Vector3d dg = Eigen::Vector3d::Zero(), da = Eigen::Vector3d::Zero();
  for (int i = 0; i < static_cast<int>(length_s * kRateHz); ++i) {
    if (i % 20 == 0)
      for (int k = 0; k < 3; ++k) dg[k] = normal(rng, gyro_sigma), da[k] = normal(rng, accel_sigma);
    readings.push_back({GpsTime{1'000'000'000'000 + std::int64_t{i} * 5'000'000}, gyro + dg, accel + da});
  }
  return readings;
}

}  // namespace

TEST_CASE("axes: a proper turn by right angles with up up and forward along the camera; EuRoC's by name") {
  for_all_seeds(100, [](Rng& rng) {
    Eigen::Vector3d accel = random_vector(rng, 10), optical = random_vector(rng).normalized();
    const Eigen::Matrix3d R = library_axes(accel, optical);
    CHECK(close(R * R.transpose(), Eigen::Matrix3d::Identity(), 1e-15));
    CHECK(R.determinant() == doctest::Approx(1));
    CHECK((R.cwiseAbs().array() == 1).count() == 3);
    CHECK((R * accel).z() == doctest::Approx(accel.cwiseAbs().maxCoeff()));
    const Eigen::Vector3d seen = R * optical;
    CHECK(seen.y() >= std::abs(seen.x()) - 1e-12);
  });
  // V1_01: x up, the camera along z; its y then points to the left.
  const Eigen::Matrix3d euroc = library_axes({9.06, 0.11, -3.69}, {0.004, 0.026, 0.9997});
  CHECK(close(euroc.row(2), Eigen::RowVector3d{1, 0, 0}, 1e-15));
  CHECK(close(euroc.row(1), Eigen::RowVector3d{0, 0, 1}, 1e-15));
  CHECK(close(euroc.row(0), Eigen::RowVector3d{0, 1, 0}, 1e-15));
  CHECK(close(library_axes({0.1, 0, 9.8}, {0.01, 0.99, 0.1}), Eigen::Matrix3d::Identity(), 1e-15));
  CHECK(library_axes({0, 0, 9.8}, {0, 0, -1}).determinant() == doctest::Approx(1));  // a camera that looks down
}

TEST_CASE("calm beginning: until a tenth of a second is off, nothing of a body that turns or is short") {
  for_all_seeds(20, [](Rng& rng) {
    const Eigen::Vector3d gyro = random_vector(rng, 0.05), accel = kGravityMps2 * random_vector(rng).normalized();
    const double calm_s = uniform(rng, 1.5, 5.0);
    std::vector<imu::ImuSample> readings = held(rng, 8, gyro, accel, 0.005, 0.05);
    const std::size_t ends = static_cast<std::size_t>(calm_s * kRateHz);
    for (std::size_t i = ends; i < readings.size(); ++i) readings[i].accel_b_mps2 += Eigen::Vector3d{1, 1, 0};
    const std::size_t calm = calm_beginning(readings);
    CHECK(calm + 40 <= ends);  // the block in which it ends may be calm in the mean
    CHECK(calm + 81 >= ends);
    CHECK(calm_beginning(held(rng, 8, gyro, accel, 0.005, 0.05)) == static_cast<std::size_t>(6 * kRateHz));
    CHECK(calm_beginning(held(rng, 0.8, gyro, accel, 0.005, 0.05)) == 0);
    CHECK(calm_beginning(held(rng, 8, {0, 0.4, 0}, accel, 0.005, 0.05)) == 0);
  });
  CHECK(calm_beginning({}) == 0);
}

TEST_CASE("rest before: still to the detector, levels and finds the gyroscope's bias as surely as the blocks say, and no more") {
  int inside = 0, all = 0;
  for_all_seeds(30, [&](Rng& rng) {
    const Eigen::Vector3d gyro = random_vector(rng, 0.04), accel{0.3, -0.4, kGravityMps2};
    const double gyro_sigma = 0.006;
    const std::vector<imu::ImuSample> readings = held(rng, 5.02, gyro, accel, gyro_sigma, 0.06);
    const std::size_t calm = calm_beginning(readings);
    REQUIRE(calm == 1000);
    const std::vector<imu::ImuSample> rest = rest_before(readings, calm, 4.5);
    REQUIRE(rest.size() == 900);
    CHECK(seconds_between(rest.back().time, readings.front().time) == doctest::Approx(0.005));
    CHECK(seconds_between(rest.front().time, readings.front().time) == doctest::Approx(4.5));

    imu::ImuNoise noise;
    noise.gyro_bias_sigma_radps = 0.03;
    stationary::Detector detector{noise};
    imu::InitializerSettings settings;
    settings.noise = noise;
    imu::Initializer initializer{settings};
    REQUIRE(initializer.set_local_gravity({0, 0, -kGravityMps2}, Eigen::Vector3d::Zero()).ok());
    (void)initializer.set_heading(0, 1e-3);
    for (const imu::ImuSample& s : rest) {
      REQUIRE(detector.add(s).ok());
      REQUIRE(initializer.add_imu(s, detector.stationary()).ok());
    }
    CHECK(detector.stationary());
    REQUIRE(initializer.state() == imu::AlignmentState::aligned);
    const auto alignment = initializer.alignment(Eigen::Vector3d::Zero(), Eigen::Matrix3d::Identity());
    REQUIRE(alignment.ok());
    CHECK(alignment->from_rest);
    const Eigen::Vector3d error = alignment->state.gyro_bias_b_radps - gyro;
    CHECK(error.norm() < 5 * gyro_sigma / std::sqrt(50.0));
    for (int k = 0; k < 3; ++k) {
      const double sigma = alignment->sigmas()[imu::NavigationState::gyro_bias + k];
      CHECK(sigma > 0.5 * gyro_sigma / std::sqrt(50.0));  // the alignment may take a little less than all of the rest
      CHECK(sigma < 2.5 * gyro_sigma / std::sqrt(50.0));
      inside += std::abs(error[k]) < 2 * sigma, ++all;
    }
  });
  CHECK(inside > 0.8 * all);
}
