// SPDX-License-Identifier: BSD-3-Clause
// The two motion policies by themselves: prediction, the antenna's covariance, where a state is placed, and when integers agree with a prediction.
#include <searvins/estimator/free_motion.hpp>
#include <searvins/estimator/inertial_motion.hpp>

#include <cmath>
#include <limits>
#include <memory>

#include <searvins/imu/preintegrated_motion.hpp>

#include "imu/factor_check.hpp"
#include "imu/simulated_motion.hpp"
#include "support/property.hpp"

using namespace searvins;
using namespace searvins::test;
using estimator::FreeMotion;
using estimator::InertialOptions;
using Inertial = estimator::InertialMotion<>;
using imu::NavigationState;

namespace {

constexpr std::int64_t kStepNs = 10'000'000;

imu::ImuSample reading(std::int64_t k, const Eigen::Vector3d& gyro = {0, 0, 0}, const Eigen::Vector3d& accel = {0, 0, 9.8}) {
  return {GpsTime{k * kStepNs}, gyro, accel};
}

/// A policy with readings of one second at rest, whose state is `x` at time 0.
std::unique_ptr<Inertial> policy_at(const NavigationState& x, const InertialOptions& options = {}) {
  auto motion = std::make_unique<Inertial>(estimator::RtkOptions{}, options);
  motion->set_frame(geodesy::LocalFrame::at({-3959400.631, 3385704.533, 3667523.111}));
  motion->settle(x, imu::NavigationCovariance::Identity() * 1e-4, GpsTime{0}, true);
  for (std::int64_t k = 0; k <= 100; ++k) REQUIRE(motion->add_sample(reading(k)).ok());
  return motion;
}

}  // namespace

TEST_CASE("free motion: the prediction is uniform acceleration, its position variance grows by velocity and jerk") {
  for_all_seeds(50, [](Rng& rng) {
    estimator::RtkOptions options;
    options.jerk_psd_m2ps5 = uniform(rng, 0.1, 3);
    const FreeMotion motion(options);
    const gnss::Pva x{random_vector<3>(rng, 100), random_vector<3>(rng, 20), random_vector<3>(rng, 3)};
    const double dt = uniform(rng, 0.1, 3);
    const GpsTime from{5'000'000'000}, to = from.plus_seconds(dt);
    const auto y = motion.predict(x, from, to);
    REQUIRE(y.ok());
    const Eigen::Vector3d expected = x.p_wa_m + dt * x.v_wa_mps + dt * dt / 2 * x.a_wa_mps2;
    CHECK(close(y->p_wa_m, expected, 1e-8));
    const Eigen::MatrixXd spd = random_spd(rng, 9);
    const FreeMotion::Covariance P = spd, Q = motion.predicted_covariance(x, P, from, to);
    for (int i = 0; i < 3; ++i) CHECK(Q(i, i) == doctest::Approx(P(i, i) + dt * dt * P(3 + i, 3 + i) + options.jerk_psd_m2ps5 * std::pow(dt, 5) / 60).epsilon(1e-6));
    const Eigen::Vector3d p = random_vector<3>(rng, 100), v = random_vector<3>(rng, 20);
    const gnss::Pva placed = motion.placed(x, {}, p, v);
    CHECK((placed.p_wa_m == p && placed.v_wa_mps == v && placed.a_wa_mps2 == x.a_wa_mps2));
  });
}

TEST_CASE("inertial motion: the antenna's covariance is that of perturbed states") {
  for_all_seeds(20, [](Rng& rng) {
    const NavigationState x = random_navigation_state(rng);
    const imu::LeverArm antenna{random_vector<3>(rng, 3), random_vector<3>(rng, 1), random_vector<3>(rng, 0.1)};
    Eigen::Matrix<double, 6, 15> J;
    for (int axis = 0; axis < 15; ++axis) {
      NavigationState::Step d = NavigationState::Step::Zero();
      d[axis] = 1e-5;
      J.col(axis) << (antenna.position_w_m(x.retract(d)) - antenna.position_w_m(x.retract(-d))) / 2e-5,
          (antenna.velocity_w_mps(x.retract(d)) - antenna.velocity_w_mps(x.retract(-d))) / 2e-5;
    }
    const imu::NavigationCovariance P = random_spd(rng, 15);
    const Eigen::Matrix<double, 6, 6> expected = J * P * J.transpose();
    CHECK(close(Inertial::antenna_covariance(x, P, antenna), expected, 1e-6));
  });
}

TEST_CASE("inertial motion: a placed state has its antenna where it was asked for, and nothing else moved") {
  for_all_seeds(20, [](Rng& rng) {
    const NavigationState x = random_navigation_state(rng);
    const imu::LeverArm antenna{random_vector<3>(rng, 3), {}, {}};
    const Eigen::Vector3d p = random_vector<3>(rng, 500);
    const auto motion = policy_at({});
    const NavigationState y = motion->placed(x, antenna, p, {});
    CHECK(close(antenna.position_w_m(y), p, 1e-12));
    CHECK((y.R_wb == x.R_wb && y.v_wb_mps == x.v_wb_mps && y.gyro_bias_b_radps == x.gyro_bias_b_radps));
    const imu::NavigationCovariance P = random_spd(rng, 15), wide = Inertial::widened(P, 10);
    CHECK(wide(NavigationState::position, NavigationState::position) == doctest::Approx(P(NavigationState::position, NavigationState::position) + 100));
    CHECK(wide(NavigationState::accel_bias, NavigationState::accel_bias) == P(NavigationState::accel_bias, NavigationState::accel_bias));
  });
}

TEST_CASE("inertial motion: a prediction inside the readings equals one from the motion itself; beyond them there is none, and the covariance stays") {
  NavigationState x;
  x.v_wb_mps = {3, -2, 0.5};
  const auto motion = policy_at(x);
  CHECK(motion->covers(GpsTime{1'000'000'000}));
  CHECK_FALSE(motion->covers(GpsTime{1'000'000'001}));
  const GpsTime inside{437'000'000};
  std::array<imu::ImuSample, 101> readings{};
  for (std::int64_t k = 0; k <= 100; ++k) readings[static_cast<std::size_t>(k)] = reading(k);
  const auto whole = imu::preintegrate<double>(readings, GpsTime{0}, inside, imu::bias_of(x));
  REQUIRE(whole.ok());
  const imu::NavigationCovariance P = imu::NavigationCovariance::Identity() * 1e-4;
  const auto y = motion->predict(x, GpsTime{0}, inside);
  REQUIRE(y.ok());
  const auto [z, Q] = motion->predict_by(x, P, *whole);
  CHECK(y->local(z).norm() < 1e-12);
  CHECK(close(motion->predicted_covariance(x, P, GpsTime{0}, inside), Q, 1e-12));
  CHECK(motion->predict(x, GpsTime{0}, GpsTime{2'000'000'000}).status().code == StatusCode::no_data);
  CHECK(motion->predicted_covariance(x, P, GpsTime{0}, GpsTime{2'000'000'000}) == P);
}

TEST_CASE("inertial motion: a refused reading changes nothing; the antenna swings with the reading nearest in time") {
  InertialOptions options;
  options.lever_arm_b_m = {0, 1, 0};
  const auto motion = policy_at({}, options);
  imu::ImuSample broken = reading(101);
  broken.gyro_b_radps.x() = std::numeric_limits<double>::quiet_NaN();
  CHECK(motion->add_sample(broken).code == StatusCode::non_finite);
  CHECK(motion->add_sample(reading(100)).code == StatusCode::duplicate);
  CHECK(motion->add_sample(reading(99)).code == StatusCode::out_of_order);
  CHECK(motion->add_sample(reading(300)).code == StatusCode::no_data);
  REQUIRE(motion->add_sample(reading(101, {0, 0, 0.5})).ok());
  CHECK(motion->antenna_at(GpsTime{101 * kStepNs - 4'000'000}).gyro_b_radps.z() == 0.5);
  CHECK(motion->antenna_at(GpsTime{101 * kStepNs - 6'000'000}).gyro_b_radps.z() == 0);
}

TEST_CASE("integers agree with a prediction up to the chi-square bound over both covariances and the floor; without a unit they always do") {
  InertialOptions options;
  options.max_fix_jump_statistic = 25, options.fix_jump_floor_m = 0.02;
  const auto motion = policy_at({}, options);
  const Eigen::Matrix3d fixed = Eigen::Matrix3d::Identity() * 1e-4, predicted = Eigen::Matrix3d::Identity() * 4e-4;
  const double bound_m = 5 * std::sqrt(1e-4 + 4e-4 + 4e-4);
  for_all_seeds(20, [&](Rng& rng) {
    const Eigen::Vector3d at = random_vector<3>(rng, 1000), direction = random_vector<3>(rng, 1).normalized();
    CHECK(motion->agrees(at + 0.99 * bound_m * direction, fixed, at, predicted));
    CHECK_FALSE(motion->agrees(at + 1.01 * bound_m * direction, fixed, at, predicted));
    CHECK(FreeMotion::agrees(at + 1000 * direction, fixed, at, predicted));
  });
  CHECK_FALSE(motion->agrees({0, 0, 0}, -Eigen::Matrix3d::Identity(), {0, 0, 0}, predicted));
}
