// SPDX-License-Identifier: BSD-3-Clause
// The prior on a navigation state: sigmas per group, heading apart, a full covariance, Jacobians, refused inputs.
#include <searvins/imu/navigation_prior.hpp>

#include <Eigen/LU>

#include <limits>

#include "imu/factor_check.hpp"
#include "support/property.hpp"

using namespace searvins;
using namespace searvins::test;
using imu::NavigationPriorFactor;
using imu::NavigationSigmas;
using imu::NavigationState;
using Matrix15 = NavigationPriorFactor::Matrix15;

namespace {

NavigationSigmas random_sigmas(Rng& rng) {
  return {uniform(rng, 0.001, 1), uniform(rng, 0.01, 100), uniform(rng, 0.01, 50), uniform(rng, 1e-3, 0.1), uniform(rng, 1e-5, 1e-2)};
}

}  // namespace

TEST_CASE("sigmas per group: a row is the displacement over its sigma") {
  for_all_seeds(60, [](Rng& rng) {
    NavigationValues values;
    const NavigationState mean = random_navigation_state(rng);
    const NavigationSigmas s = random_sigmas(rng);
    const double sigmas[] = {s.attitude_rad, s.position_m, s.velocity_mps, s.accel_bias_mps2, s.gyro_bias_radps};
    const NavigationState::Step d = random_vector<15>(rng, 0.5);
    const auto f = NavigationPriorFactor::make(values.add(mean.retract(d)), mean, s);
    REQUIRE(f.ok());
    double e[15];
    f->evaluate(values, e);
    for (int i = 0; i < 15; ++i) CHECK(e[i] * sigmas[i / 3] == doctest::Approx(d[i]).epsilon(1e-9));
    check_navigation_jacobian(*f, values, 1e-4, 1e-7);
  });
}

TEST_CASE("heading apart: turning about the up axis of w counts by its own sigma, leaning by that of attitude, whatever the attitude") {
  for_all_seeds(60, [](Rng& rng) {
    NavigationValues values;
    const NavigationState mean = random_navigation_state(rng);
    NavigationSigmas s = random_sigmas(rng);
    s.attitude_rad = 0.02, s.heading_rad = chance(rng, 0.5) ? 3.0 : 0.001;
    const auto key = values.add(mean);
    const auto f = NavigationPriorFactor::make(key, mean, s);
    REQUIRE(f.ok());
    const auto cost = [&](const Eigen::Vector3d& turn_w) {
      values.at(key).R_wb = so3::exp(turn_w) * mean.R_wb;
      double e[15];
      f->evaluate(values, e);
      return std::sqrt(Eigen::Map<const Eigen::Matrix<double, 15, 1>>(e).squaredNorm());
    };
    const double lean = uniform(rng, -3, 3), angle = 1e-3;
    CHECK(cost({0, 0, angle}) == doctest::Approx(angle / s.heading_rad).epsilon(1e-6));
    CHECK(cost({angle * std::cos(lean), angle * std::sin(lean), 0}) == doctest::Approx(angle / s.attitude_rad).epsilon(1e-6));
  });
}

TEST_CASE("a full covariance: e'e is the Mahalanobis norm, Jacobians equal differences") {
  for_all_seeds(60, [](Rng& rng) {
    NavigationValues values;
    const NavigationState mean = random_navigation_state(rng);
    const Matrix15 covariance = random_spd(rng, 15, 1e3);
    const NavigationState::Step d = random_vector<15>(rng, 0.5);
    const auto f = NavigationPriorFactor::make(values.add(mean.retract(d)), mean, covariance);
    REQUIRE(f.ok());
    double e[15];
    f->evaluate(values, e);
    CHECK(Eigen::Map<const Eigen::Matrix<double, 15, 1>>(e).squaredNorm() ==
          doctest::Approx(d.dot(covariance.inverse() * d)).epsilon(1e-8));
    check_navigation_jacobian(*f, values, 1e-4, 1e-7);
  });
}

TEST_CASE("sigmas that are not positive and covariances that are none are refused") {
  const NavigationState mean;
  constexpr double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  for (const double bad : {0.0, -1.0, nan, infinity}) {
    const auto code = [&](double NavigationSigmas::*member) {
      NavigationSigmas s;
      s.*member = bad;
      return NavigationPriorFactor::make({}, mean, s).status().code;
    };
    for (auto member : {&NavigationSigmas::attitude_rad, &NavigationSigmas::position_m, &NavigationSigmas::velocity_mps,
                        &NavigationSigmas::accel_bias_mps2, &NavigationSigmas::gyro_bias_radps})
      CHECK(code(member) == StatusCode::invalid_argument);
    if (bad != 0) CHECK(code(&NavigationSigmas::heading_rad) == StatusCode::invalid_argument);  // 0: as attitude
  }
  Matrix15 covariance = Matrix15::Identity();
  covariance(7, 7) = 0;
  const Status s = NavigationPriorFactor::make({}, mean, covariance).status();
  CHECK(s.code == StatusCode::not_positive_definite);
  CHECK(s.index == 7);
}
