// SPDX-License-Identifier: BSD-3-Clause
// The antenna of a body: Jacobians by every axis, the velocity as the derivative of the position along a true motion over the turning Earth, and the
// differenced observations of an antenna on a lever arm.
#include <searvins/imu/lever_arm.hpp>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <type_traits>
#include <vector>

#include <searvins/gnss/gnss_factors.hpp>
#include <searvins/robust/loss.hpp>

#include "imu/factor_check.hpp"
#include "imu/simulated_motion.hpp"
#include "support/factor_values.hpp"
#include "support/property.hpp"

using namespace searvins;
using namespace searvins::test;
using imu::LeverArm;
using imu::NavigationState;

namespace {

LeverArm random_antenna(Rng& rng) {
  LeverArm a;
  a.lever_arm_b_m = random_vector<3>(rng, 3), a.gyro_b_radps = random_vector<3>(rng, 2);
  a.earth_rate_w_radps = random_vector<3>(rng, 0.5);  // far beyond the Earth's, so that its terms count
  return a;
}

/// Central differences of f(x) by the axes of the state.
template <class F>
LeverArm::Jacobian numeric(const NavigationState& x, const F& f) {
  LeverArm::Jacobian J;
  for (int axis = 0; axis < NavigationState::dof; ++axis) {
    NavigationState::Step d = NavigationState::Step::Zero();
    d[axis] = 1e-5;
    J.col(axis) = (f(x.retract(d)) - f(x.retract(-d))) / 2e-5;
  }
  return J;
}

}  // namespace

TEST_CASE("Jacobians of position and velocity by every axis of the state equal differences, the Earth's share included") {
  for_all_seeds(100, [](Rng& rng) {
    const LeverArm a = random_antenna(rng);
    const NavigationState x = random_navigation_state(rng);
    LeverArm::Jacobian J = LeverArm::Jacobian::Constant(7);
    CHECK(a.position_w_m(x, &J) == a.position_w_m(x));
    CHECK(close(J, numeric(x, [&](const NavigationState& y) { return a.position_w_m(y); }), 1e-8));
    J.setConstant(7);
    CHECK(a.velocity_w_mps(x, &J) == a.velocity_w_mps(x));
    CHECK(close(J, numeric(x, [&](const NavigationState& y) { return a.velocity_w_mps(y); }), 1e-8));
    CHECK(J.middleCols<3>(NavigationState::gyro_bias).norm() > 0);
    CHECK(J.middleCols<3>(NavigationState::accel_bias).norm() == 0);
  });
}

TEST_CASE("P16 the antenna is where the body carries it: right, forward, up of a body that faces north, east, and lies on its side") {
  LeverArm a;
  a.lever_arm_b_m = {1, 2, 3};
  NavigationState x;
  x.p_wb_m = {10, 20, 30};
  CHECK(close(a.position_w_m(x), Eigen::Vector3d{11, 22, 33}, 1e-15));
  x.R_wb = so3::exp(Eigen::Vector3d{0, 0, -std::numbers::pi / 2});  // forward is east, right is south
  CHECK(close(a.position_w_m(x), Eigen::Vector3d{12, 19, 33}, 1e-15));
  x.R_wb = so3::exp(Eigen::Vector3d{0, std::numbers::pi / 2, 0});  // right is down, up is east
  CHECK(close(a.position_w_m(x), Eigen::Vector3d{13, 22, 29}, 1e-15));
  x = {};
  a.gyro_b_radps = {0, 0, 0.5};  // a left turn: the point ahead moves to the left, the point on the right moves ahead
  CHECK(close(a.velocity_w_mps(x), Eigen::Vector3d{-1, 0.5, 0}, 1e-15));
  x.gyro_bias_b_radps = {0, 0, 0.5};
  CHECK(a.velocity_w_mps(x).norm() < 1e-15);
}

TEST_CASE("along a true motion over the turning Earth the velocity is the derivative of the position, whatever the unit's bias") {
  for_all_seeds(20, [](Rng& rng) {
    const SimulatedMotion m = SimulatedMotion::random(rng);
    const Eigen::Vector3d bias = random_vector<3>(rng, 0.02), earth_w = geodesy::kEarthRateRadps * m.frame.R_ew.row(2).transpose();
    LeverArm a;
    a.lever_arm_b_m = random_vector<3>(rng, 5), a.earth_rate_w_radps = earth_w;
    const double t = uniform(rng, 0.1, 0.8), h = 2e-3;
    const auto at = [&](double time) {
      NavigationState x = m.truth(time);
      x.gyro_bias_b_radps = bias;
      return x;
    };
    // The truth gives the body's own velocity; the swing is what is asked for. The body's position is subtracted, its 20 km would cost digits.
    const auto arm_w = [&](double time) { return Eigen::Vector3d{a.position_w_m(at(time)) - at(time).p_wb_m}; };
    const Eigen::Vector3d swing = (8 * (arm_w(t + h) - arm_w(t - h)) - (arm_w(t + 2 * h) - arm_w(t - 2 * h))) / (12 * h);
    a.gyro_b_radps = m.gyro_b_radps.at(t) + bias;
    const NavigationState x = at(t);
    const Eigen::Vector3d modelled = a.velocity_w_mps(x) - x.v_wb_mps;
    CHECK((modelled - swing).norm() < 1e-8 * (1 + swing.norm()));
    const Eigen::Vector3d body = (8 * (at(t + h).p_wb_m - at(t - h).p_wb_m) - (at(t + 2 * h).p_wb_m - at(t - 2 * h).p_wb_m)) / (12 * h);
    CHECK((x.v_wb_mps - body).norm() < 1e-4);  // rounding of 6000 km in ECEF over the step
    a.earth_rate_w_radps.setZero();            // without the Earth's share the swing is wrong by Omega x l
    const Eigen::Vector3d missed = a.velocity_w_mps(x) - x.v_wb_mps - swing;
    CHECK((missed - earth_w.cross(x.R_wb * a.lever_arm_b_m)).norm() < 1e-8);
  });
}

namespace {

/// Values of navigation states, ambiguities and pivot errors by key.
using BatchValues = FactorValuesOf<NavigationState, gnss::Ambiguity, gnss::PivotError>;

/// Every column of the whitened Jacobian against central differences. Steps: half a metre, metre per second or cycle; half a milliradian of attitude,
/// whose antenna moves on an arc.
template <class F>
void check_batch_jacobian(const F& f, BatchValues values, double rounding) {
  using Matrix = Eigen::Matrix<double, F::max_rows, F::max_columns>;
  const auto J = std::make_unique<Matrix>(Matrix::Zero());
  std::vector<double> e(F::max_rows), plain(F::max_rows), plus(F::max_rows), minus(F::max_rows);
  f.evaluate(values, plain.data());
  f.linearise(values, e.data(), {J->data(), F::max_rows});
  const auto rows = static_cast<std::size_t>(f.rows());
  for (std::size_t i = 0; i < rows; ++i) CHECK(e[i] == plain[i]);
  int column = 0, alive = 0;
  f.for_each_key([&](const auto& key) {
    auto& value = values.at(key);
    const auto before = value;
    using V = std::remove_cvref_t<decltype(before)>;
    for (int axis = 0; axis < V::dof; ++axis, ++column) {
      const bool is_turn = V::dof == NavigationState::dof && axis < 3;
      const double step = is_turn ? 5e-4 : 0.5;
      typename V::Step d = V::Step::Zero();
      d[axis] = step;
      value = before.retract(d);
      f.evaluate(values, plus.data());
      value = before.retract(-d);
      f.evaluate(values, minus.data());
      value = before;
      const double largest = J->col(column).head(f.rows()).cwiseAbs().maxCoeff();
      alive += largest > 0 ? 1 : 0;
      for (std::size_t i = 0; i < rows; ++i) {
        CAPTURE(column);
        CAPTURE(i);
        CHECK(std::abs((plus[i] - minus[i]) / (2 * step) - (*J)(static_cast<int>(i), column)) <= 2e-6 * largest + rounding / step);
      }
    }
  });
  CHECK(column <= F::max_columns);
  CHECK(alive >= 6);
}

template <gnss::Observable kObservable>
void check_observable(Rng& rng, bool single_difference) {
  using Form = robust::LatentPivotSymmetric<robust::Dcs<double>>;
  using F = gnss::DifferenceFactor<NavigationState, Form, kObservable, 10, LeverArm>;
  F f;
  f.frame = geodesy::LocalFrame::at(geodesy::ecef_from_geodetic({uniform(rng, -1.1, 1.1), uniform(rng, -3.1, 3.1), 100}));
  f.antenna = random_antenna(rng);
  f.wavelength_m = 0.19;
  const NavigationState x = random_navigation_state(rng);
  BatchValues values;
  f.state = values.add(x);
  const Eigen::Vector3d antenna_e_m = f.frame.to_ecef(f.antenna.position_w_m(x)), velocity_e = f.frame.R_ew * f.antenna.velocity_w_mps(x);
  double variances[10];
  const int n = integer(rng, 2, 10);
  for (int i = 0; i <= n; ++i) {
    const double azimuth = uniform(rng, -3.14, 3.14), elevation = uniform(rng, 0.25, 1.5);
    gnss::BatchMember m;
    m.satellite_e_m = f.frame.to_ecef(
        2.2e7 * Eigen::Vector3d{std::cos(elevation) * std::sin(azimuth), std::cos(elevation) * std::cos(azimuth), std::sin(elevation)});
    if constexpr (kObservable == gnss::Observable::doppler) {
      m.satellite_e_m = gnss::direction_from_satellite(antenna_e_m, m.satellite_e_m);
      m.z = m.satellite_e_m.dot(velocity_e) + normal(rng, 0.1);
    } else {
      m.z = gnss::range_m(antenna_e_m, m.satellite_e_m) + normal(rng, 0.3);
    }
    if (i == n) {
      f.pivot = m;
    } else {
      REQUIRE(f.candidates.push_back(m));
      variances[i] = uniform(rng, 0.05, 0.2);
    }
  }
  const auto covariance = robust::SharedPivot<double, 10>::from(variances, n, 0.1);
  REQUIRE(covariance.ok());
  f.covariance = *covariance;
  gnss::Ambiguity a;
  if constexpr (F::is_phase)
    for (int i = 0; i <= n; ++i) {
      a.value = uniform(rng, -1, 1);
      if (i < n) REQUIRE(f.ambiguities.push_back(values.add(a)));
      if (i == n && single_difference) f.pivot_ambiguity = values.add(a);
    }
  gnss::PivotError latent;
  latent.value = normal(rng, 0.3);
  f.latent = values.add(latent);
  check_batch_jacobian(f, values, 4e-8 / 0.2);
}

}  // namespace

TEST_CASE("differences of an antenna on a lever arm: Jacobians of code, phase and Doppler by every axis and key equal differences") {
  for_all_seeds(30, [](Rng& rng) {
    check_observable<gnss::Observable::code>(rng, false);
    check_observable<gnss::Observable::phase>(rng, false);
    check_observable<gnss::Observable::phase>(rng, true);
    check_observable<gnss::Observable::doppler>(rng, false);
  });
}
