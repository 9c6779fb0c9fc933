// SPDX-License-Identifier: BSD-3-Clause
// The centre line as a factor: Jacobian, sign, what it is blind to, and what the loss does with another lane.
#include <searvins/imu/centreline_factor.hpp>

#include "imu/factor_check.hpp"
#include "support/property.hpp"

using namespace searvins;
using namespace searvins::test;
using imu::CentrelineFactor;

namespace {

CentrelineFactor factor_beside(Rng& rng, const smoother::Key<imu::NavigationState>& key, const imu::NavigationState& x) {
  CentrelineFactor f;
  f.state = key;
  f.antenna.lever_arm_b_m = random_vector<3>(rng, 2);
  const double heading = uniform(rng, -3.1, 3.1);
  f.right_w = {std::cos(heading), -std::sin(heading), 0};
  f.point_w_m = f.antenna.position_w_m(x) + random_vector<3>(rng, 3);
  f.sigma_m = uniform(rng, 0.2, 2);
  return f;
}

}  // namespace

TEST_CASE("centre line: the Jacobian is that of the residual") {
  for_all_seeds(100, [](Rng& rng) {
    NavigationValues values;
    const auto key = values.add(random_navigation_state(rng));
    const CentrelineFactor f = factor_beside(rng, key, values.at(key));
    double e = 0, plus = 0, minus = 0;
    Eigen::Matrix<double, 1, 15> J = Eigen::Matrix<double, 1, 15>::Zero();
    f.linearise(values, &e, {J.data(), 1});
    const imu::NavigationState x = values.at(key);
    for (int axis = 0; axis < 15; ++axis) {
      imu::NavigationState::Step d = imu::NavigationState::Step::Zero();
      d[axis] = 1e-4;
      values.at(key) = x.retract(d), f.evaluate(values, &plus);
      values.at(key) = x.retract(-d), f.evaluate(values, &minus);
      CHECK(J(0, axis) == doctest::Approx((plus - minus) / 2e-4).epsilon(1e-6).scale(10));
    }
  });
}

TEST_CASE("centre line: an antenna to the right has a positive residual in sigmas; along the lane and up nothing changes, nor with the line turned round") {
  for_all_seeds(100, [](Rng& rng) {
    NavigationValues values;
    const auto key = values.add(random_navigation_state(rng));
    CentrelineFactor f = factor_beside(rng, key, values.at(key));
    const double right_m = uniform(rng, -3, 3);
    const Eigen::Vector3d along{-f.right_w.y(), f.right_w.x(), 0};
    f.point_w_m = f.antenna.position_w_m(values.at(key)) - right_m * f.right_w;
    double e = 0, moved = 0, w = 0, turned_w = 0;
    f.evaluate(values, &e);
    CHECK(e == doctest::Approx(right_m / f.sigma_m).epsilon(1e-9));
    CentrelineFactor other = f;
    other.point_w_m += uniform(rng, -50, 50) * along + Eigen::Vector3d{0, 0, uniform(rng, -50, 50)};
    other.evaluate(values, &moved);
    CHECK(moved == doctest::Approx(e).epsilon(1e-9));
    other.right_w = -f.right_w;
    other.evaluate(values, &moved);
    CHECK(f.weigh(&e, &w) == doctest::Approx(other.weigh(&moved, &turned_w)).epsilon(1e-9));
    CHECK(w == doctest::Approx(turned_w).epsilon(1e-9));
  });
}

TEST_CASE("centre line: ten sigmas off, another lane weighs next to nothing") {
  CentrelineFactor f;
  double e = 10, w = 1;
  (void)f.weigh(&e, &w);
  CHECK(w < 0.01);
  e = 0.5;
  (void)f.weigh(&e, &w);
  CHECK(w == 1);
}
