// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Factors on navigation states outside a smoother: values by key, and the analytic Jacobian against central differences.
#pragma once

#include <doctest/doctest.h>

#include <array>
#include <vector>

#include <searvins/imu/navigation_state.hpp>
#include <searvins/smoother/factor.hpp>

#include "support/factor_values.hpp"
#include "support/property.hpp"

namespace searvins::test {

using NavigationValues = FactorValuesOf<imu::NavigationState>;

inline imu::NavigationState random_navigation_state(Rng& rng) {
  imu::NavigationState x;
  x.R_wb = so3::exp(random_vector<3>(rng, 1.7)), x.p_wb_m = random_vector<3>(rng, 100), x.v_wb_mps = random_vector<3>(rng, 20);
  x.accel_bias_b_mps2 = random_vector<3>(rng, 0.1), x.gyro_bias_b_radps = random_vector<3>(rng, 0.01);
  return x;
}

/// Every column of the whitened Jacobian against central differences (steps in the scale of each axis: a hundredth of its linearisation
/// scale), relative to the column's largest entry; `rounding` is the error of one whitened residual. linearise() gives the rows of
/// evaluate().
template <class F>
void check_navigation_jacobian(const F& f, NavigationValues values, double tolerance, double rounding) {
  constexpr int rows = F::max_rows;
  Eigen::Matrix<double, rows, F::max_columns> J;
  J.setZero();
  std::array<double, static_cast<std::size_t>(rows)> e{}, plain{}, plus{}, minus{};
  f.evaluate(values, plain.data());
  f.linearise(values, e.data(), {J.data(), rows});
  CHECK(e == plain);
  int column = 0;
  f.for_each_key([&](const auto& key) {
    auto& value = values.at(key);
    const imu::NavigationState before = value;
    for (int axis = 0; axis < imu::NavigationState::dof; ++axis, ++column) {
      const double step = 1e-2 * imu::NavigationState::linearisation_scale()[axis];
      imu::NavigationState::Step d = imu::NavigationState::Step::Zero();
      d[axis] = step;
      value = before.retract(d);
      f.evaluate(values, plus.data());
      value = before.retract(-d);
      f.evaluate(values, minus.data());
      value = before;
      const double largest = J.col(column).cwiseAbs().maxCoeff();
      CHECK(largest > 0);
      for (std::size_t i = 0; i < e.size(); ++i) {
        const double numeric = (plus[i] - minus[i]) / (2 * step);
        CAPTURE(column);
        CAPTURE(i);
        CHECK(std::abs(numeric - J(static_cast<int>(i), column)) <= tolerance * largest + rounding / step);
      }
    }
  });
  CHECK(column == F::max_columns);
}

}  // namespace searvins::test
