// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <cmath>
#include <vector>

#include <searvins/math/small_cholesky.hpp>
#include <searvins/stationary/position_anchor.hpp>
#include <searvins/stationary/stationary_factors.hpp>

#include "tests/support/factor_values.hpp"
#include "tests/support/property.hpp"

using namespace searvins;
using imu::NavigationState;
using stationary::PositionAnchor;
using test::for_all_seeds;
using test::random_vector;
using test::Rng;
using test::uniform;

namespace {

/// Values of states and anchors by key.
using Values = test::FactorValuesOf<NavigationState, PositionAnchor>;

/// Analytic Jacobian against central differences, column by column, relative to the largest entry of the whole Jacobian.
template <class F>
void check_jacobian(const F& f, Values values) {
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(F::max_rows, F::max_columns);
  std::array<double, F::max_rows> e{}, plain{}, plus{}, minus{};
  f.evaluate(values, plain.data());
  f.linearise(values, e.data(), {J.data(), F::max_rows});
  CHECK(e == plain);
  const double largest = J.cwiseAbs().maxCoeff();
  CHECK(largest > 0);
  int column = 0;
  f.for_each_key([&](const auto& key) {
    auto& value = values.at(key);
    const auto before = value;
    using V = std::remove_cvref_t<decltype(before)>;
    for (int axis = 0; axis < V::dof; ++axis, ++column) {
      const double step = 1e-5;
      typename V::Step d = V::Step::Zero();
      d[axis] = step;
      value = before.retract(d);
      f.evaluate(values, plus.data());
      value = before.retract(-d);
      f.evaluate(values, minus.data());
      value = before;
      for (int i = 0; i < f.rows(); ++i) {
        CAPTURE(column);
        CAPTURE(i);
        const auto k = static_cast<std::size_t>(i);
        CHECK(std::abs((plus[k] - minus[k]) / (2 * step) - J(i, column)) < 1e-7 * largest);
      }
    }
  });
  CHECK(column == F::max_columns);
}

NavigationState random_state(Rng& rng) {
  NavigationState x;
  x.R_wb = so3::exp(random_vector<3>(rng, 3.0));
  x.p_wb_m = random_vector<3>(rng, 100.0);
  x.v_wb_mps = random_vector<3>(rng, 20.0);
  x.accel_bias_b_mps2 = random_vector<3>(rng, 0.1);
  x.gyro_bias_b_radps = random_vector<3>(rng, 0.01);
  return x;
}

}  // namespace

TEST_CASE("stationary factors: property: Jacobians against central differences") {
  for_all_seeds(50, [](Rng& rng) {
    Values values;
    const auto state = values.add(random_state(rng));
    const auto anchor = values.add(PositionAnchor{random_vector<3>(rng, 100.0)});
    check_jacobian(stationary::ZeroVelocityFactor{state, uniform(rng, 0.01, 1)}, values);
    // The Earth's rate enlarged to 0.1 rad/s, so that its part in the Jacobian is seen.
    check_jacobian(stationary::ZeroAngularRateFactor{state, random_vector<3>(rng, 0.01), random_vector<3>(rng, 0.1), uniform(rng, 1e-4, 1)}, values);
    check_jacobian(stationary::PositionAnchorFactor{state, anchor, uniform(rng, 0.01, 1)}, values);
    check_jacobian(stationary::NonHolonomicFactor{state, random_vector<3>(rng, 0.5), random_vector<3>(rng, 0.1), random_vector<3>(rng, 3.0),
                                                  so3::exp(random_vector<3>(rng, 0.3)), uniform(rng, 0.02, 1), uniform(rng, 0.02, 1)},
                   values);
    const auto prior = stationary::latch(anchor, random_vector<3>(rng, 100.0), test::random_spd(rng, 3, 100.0));
    REQUIRE(prior.ok());
    check_jacobian(*prior, values);
  });
}

TEST_CASE("stationary factors: property: residuals vanish where their statement is true") {
  for_all_seeds(50, [](Rng& rng) {
    Values values;
    NavigationState x = random_state(rng);
    const Eigen::Vector3d earth_w{0, 6e-5, 4e-5}, gyro = random_vector<3>(rng, 0.4), point = random_vector<3>(rng, 3.0);
    const Eigen::Vector3d rate = gyro - x.gyro_bias_b_radps - x.R_wb.transpose() * earth_w;
    // A vehicle whose axle at `point` moves straight ahead: v_b + w x l = (0, s, 0).
    x.v_wb_mps = x.R_wb * (Eigen::Vector3d{0, uniform(rng, -20, 20), 0} - rate.cross(point));
    const auto state = values.add(x);
    const auto anchor = values.add(PositionAnchor{x.p_wb_m});
    double e[3];
    stationary::NonHolonomicFactor wheels{state, gyro, earth_w, point, Eigen::Matrix3d::Identity(), 0.1, 0.2};
    wheels.evaluate(values, e);
    CHECK(std::hypot(e[0], e[1]) < 1e-12);
    values.at(state).v_wb_mps += x.R_wb * Eigen::Vector3d{0.1, 0, -0.2};
    wheels.evaluate(values, e);
    CHECK(e[0] == doctest::Approx(1));
    CHECK(e[1] == doctest::Approx(-1));
    const stationary::ZeroAngularRateFactor turn{state, x.gyro_bias_b_radps + x.R_wb.transpose() * earth_w, earth_w, 1e-4};
    turn.evaluate(values, e);
    CHECK(Eigen::Map<Eigen::Vector3d>{e}.norm() < 1e-10);
    stationary::PositionAnchorFactor{state, anchor, 0.02}.evaluate(values, e);
    CHECK(Eigen::Map<Eigen::Vector3d>{e}.norm() == 0);
    values.at(state).v_wb_mps = {0.03, 0, -0.06};
    stationary::ZeroVelocityFactor{state, 0.03}.evaluate(values, e);
    CHECK(e[0] == doctest::Approx(1));
    CHECK(e[2] == doctest::Approx(-2));
    double w[3];
    CHECK(stationary::ZeroVelocityFactor{}.weigh(e, w) == doctest::Approx(2.5));
    CHECK(w[1] == 1.0);
  });
}

TEST_CASE("position anchor: property: the latched prior whitens by covariance plus floor") {
  for_all_seeds(50, [](Rng& rng) {
    Values values;
    const Eigen::Vector3d mean = random_vector<3>(rng, 10.0), at = mean + random_vector<3>(rng, 1.0);
    const Eigen::Matrix3d C = test::random_spd(rng, 3, 1e4);
    const auto anchor = values.add(PositionAnchor{at});
    const auto prior = stationary::latch(anchor, mean, C, 0.05);
    REQUIRE(prior.ok());
    double e[3];
    prior->evaluate(values, e);
    const math::SmallCholesky<3> cholesky{Eigen::Matrix3d{C + 0.0025 * Eigen::Matrix3d::Identity()}};
    CHECK(Eigen::Map<Eigen::Vector3d>{e}.squaredNorm() == doctest::Approx((at - mean).dot(cholesky.solve(at - mean))).epsilon(1e-9));
  });
  CHECK(stationary::latch({}, Eigen::Vector3d::Zero(), Eigen::Matrix3d::Zero(), 0.05).ok());  // the floor alone
  CHECK(stationary::latch({}, Eigen::Vector3d::Zero(), -Eigen::Matrix3d::Identity(), 0.05).status().code == StatusCode::not_positive_definite);
  CHECK(stationary::latch({}, Eigen::Vector3d{0, std::nan(""), 0}, Eigen::Matrix3d::Identity()).status().code == StatusCode::non_finite);
  CHECK(PositionAnchor{{1, 2, 3}}.local(PositionAnchor{{1, 2, 3}}.retract({4, 5, 6})) == Eigen::Vector3d{4, 5, 6});
}
