// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// A factor under test outside a smoother: values by key, and its analytic Jacobian against central differences.
#pragma once

#include <doctest/doctest.h>

#include <cstddef>
#include <string>
#include <type_traits>
#include <vector>

#include <searvins/gnss/gnss_variables.hpp>
#include <searvins/gnss/motion.hpp>
#include <searvins/smoother/factor.hpp>

#include "support/factor_values.hpp"

namespace searvins::test {

/// Values of states, ambiguities and pivot errors by key.
using FactorValues = FactorValuesOf<gnss::Pva, gnss::Ambiguity, gnss::PivotError>;

/// Every column of the whitened Jacobian against central differences over the keys in the order of for_each_key, relative to the column's largest entry
/// and to the spacing of the doubles that the residual was made from (`absolute`); linearise() gives the rows of evaluate().
template <class F>
void check_jacobian(const F& f, FactorValues values, double tolerance, double step = 1e-3, double absolute = 1e-6) {
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic>;
  const int rows = f.rows();
  Matrix J = Matrix::Constant(F::max_rows, F::max_columns, 0);
  std::vector<double> e(F::max_rows), plain(F::max_rows), plus(F::max_rows), minus(F::max_rows);
  f.evaluate(values, plain.data());
  f.linearise(values, e.data(), {J.data(), F::max_rows});
  for (int i = 0; i < rows; ++i) CHECK(e[static_cast<std::size_t>(i)] == plain[static_cast<std::size_t>(i)]);
  int column = 0;
  f.for_each_key([&](const auto& key) {
    auto& value = values.at(key);
    const auto before = value;
    using V = std::remove_cvref_t<decltype(before)>;
    for (int axis = 0; axis < V::dof; ++axis, ++column) {
      typename V::Step d = V::Step::Zero();
      d[axis] = step;
      value = before.retract(d);
      f.evaluate(values, plus.data());
      value = before.retract(-d);
      f.evaluate(values, minus.data());
      value = before;
      const double largest = J.col(column).head(rows).cwiseAbs().maxCoeff();
      for (int i = 0; i < rows; ++i) {
        const double numeric = (plus[static_cast<std::size_t>(i)] - minus[static_cast<std::size_t>(i)]) / (2 * step);
        CAPTURE(column);
        CAPTURE(i);
        CHECK(std::abs(numeric - J(i, column)) <= tolerance * largest + absolute);
      }
    }
  });
  CHECK(column <= F::max_columns);
}

}  // namespace searvins::test
