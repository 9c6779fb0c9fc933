// SPDX-License-Identifier: BSD-3-Clause
// The loosely coupled position: Jacobian, whitening, sign, and what is refused.
#include <searvins/imu/position_factor.hpp>

#include <cmath>
#include <limits>

#include "imu/factor_check.hpp"
#include "support/property.hpp"

using namespace searvins;
using namespace searvins::test;
using imu::PositionFactor;

namespace {

Eigen::Matrix3d random_covariance(Rng& rng) { return 0.04 * random_spd(rng, 3, 100); }

}  // namespace

TEST_CASE("the Jacobian is that of the whitened residual, and the residual vanishes where the antenna is at the fix") {
  for_all_seeds(100, [](Rng& rng) {
    NavigationValues values;
    const auto key = values.add(random_navigation_state(rng));
    const imu::LeverArm antenna{random_vector<3>(rng, 2), random_vector<3>(rng, 0.5), {}};
    const Eigen::Vector3d at = antenna.position_w_m(values.at(key));
    const auto f = PositionFactor::make(key, antenna, at + random_vector<3>(rng, 1), random_covariance(rng), 0.05);
    REQUIRE(f.ok());
    double e[3], plus[3], minus[3];
    Eigen::Matrix<double, 3, 15> J = Eigen::Matrix<double, 3, 15>::Zero();
    f->linearise(values, e, {J.data(), 3});
    const imu::NavigationState x = values.at(key);
    for (int axis = 0; axis < 15; ++axis) {
      imu::NavigationState::Step d = imu::NavigationState::Step::Zero();
      d[axis] = 1e-4;
      values.at(key) = x.retract(d), f->evaluate(values, plus);
      values.at(key) = x.retract(-d), f->evaluate(values, minus);
      for (int i = 0; i < 3; ++i) CHECK(J(i, axis) == doctest::Approx((plus[i] - minus[i]) / 2e-4).epsilon(1e-6).scale(10));
    }
    values.at(key) = x;
    const auto exact = PositionFactor::make(key, antenna, at, random_covariance(rng), 0.05);
    exact->evaluate(values, e);
    CHECK(Eigen::Map<Eigen::Vector3d>(e).norm() < 1e-9);
  });
}

TEST_CASE("the squared norm is the Mahalanobis distance with the floor, and one weight counts for all three rows") {
  for_all_seeds(100, [](Rng& rng) {
    NavigationValues values;
    const auto key = values.add(random_navigation_state(rng));
    const imu::LeverArm antenna{random_vector<3>(rng, 2), {}, {}};
    const Eigen::Matrix3d C = random_covariance(rng);
    const double floor_m = uniform(rng, 0.01, 0.5);
    const Eigen::Vector3d error = random_vector<3>(rng, 2);
    const auto f = PositionFactor::make(key, antenna, antenna.position_w_m(values.at(key)) - error, C, floor_m);
    REQUIRE(f.ok());
    double e[3], w[3];
    f->evaluate(values, e);
    const Eigen::Matrix3d S = C + floor_m * floor_m * Eigen::Matrix3d::Identity();
    const double expected = error.dot(S.inverse() * error), z2 = Eigen::Map<Eigen::Vector3d>(e).squaredNorm();
    CHECK(z2 == doctest::Approx(expected).epsilon(1e-9));
    CHECK(f->weigh(e, w) == doctest::Approx(f->loss.rho(z2)));
    CHECK((w[0] == w[1] && w[1] == w[2] && w[0] == f->loss.weight(z2)));
  });
}

TEST_CASE("a covariance that is none and a position that is not finite are refused") {
  const smoother::Key<imu::NavigationState> key{0, 1};
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Eigen::Matrix3d I = Eigen::Matrix3d::Identity();
  CHECK(PositionFactor::make(key, {}, {0, 0, 0}, -I, 0.05).status().code == StatusCode::not_positive_definite);
  CHECK(PositionFactor::make(key, {}, {0, 0, 0}, nan * I, 0.05).status().code == StatusCode::not_positive_definite);
  CHECK(PositionFactor::make(key, {}, {0, nan, 0}, I, 0.05).status().code == StatusCode::non_finite);
}
