// SPDX-License-Identifier: BSD-3-Clause
// Small solves against the definition, and matrices that are not positive definite.
#include <doctest/doctest.h>

#include <Eigen/Core>

#include <cmath>
#include <limits>
#include <type_traits>

#include <searvins/math/small_cholesky.hpp>

#include "support/property.hpp"

using namespace searvins;
using math::SmallCholesky;
using test::for_all_seeds;
using test::Rng;

TEST_CASE_TEMPLATE("small Cholesky: A times the solution is the right-hand side, the inverse is symmetric", Size,
                   std::integral_constant<int, 1>, std::integral_constant<int, 4>, std::integral_constant<int, 8>) {
  constexpr int n = Size::value;
  for_all_seeds(100, [](Rng& rng) {
    const Eigen::Matrix<double, n, n> A = test::random_spd(rng, n, 1e6);
    const Eigen::Matrix<double, n, 1> b = test::random_vector<n>(rng, 10);
    const SmallCholesky<n> factor(A);
    REQUIRE(factor.ok());
    CHECK((A * factor.solve(b) - b).norm() <= 1e-9 * (1 + b.norm()));
    const Eigen::Matrix<double, n, n> inverse = factor.inverse();
    CHECK(inverse == inverse.transpose());
    CHECK((A * inverse - Eigen::Matrix<double, n, n>::Identity()).norm() < 1e-7);
    // Variables of very different units: only the lower triangle is read, no explicit scaling is needed.
    Eigen::Matrix<double, n, n> scaled = A;
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) scaled(i, j) = j > i ? 1e300 : A(i, j) * std::pow(10.0, 3 * (i % 3) + 3 * (j % 3));
    CHECK(SmallCholesky<n>(scaled).ok());
  });
}

TEST_CASE("small Cholesky: singular, indefinite and non-finite matrices are refused") {
  Eigen::Matrix3d A = Eigen::Matrix3d::Identity();
  CHECK(SmallCholesky<3>(A).ok());
  A(2, 2) = 0;
  CHECK_FALSE(SmallCholesky<3>(A).ok());
  A(2, 2) = -1;
  CHECK_FALSE(SmallCholesky<3>(A).ok());
  A = Eigen::Vector3d(1, 2, 3) * Eigen::Vector3d(1, 2, 3).transpose();  // rank one
  CHECK_FALSE(SmallCholesky<3>(A).ok());
  A = Eigen::Matrix3d::Identity();
  A(1, 0) = std::numeric_limits<double>::quiet_NaN();
  CHECK_FALSE(SmallCholesky<3>(A).ok());
}
