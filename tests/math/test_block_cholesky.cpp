// SPDX-License-Identifier: BSD-3-Clause
#include <searvins/math/block_cholesky.hpp>

#include <Eigen/Dense>

#include <vector>

#include "support/property.hpp"

using namespace searvins;
using namespace searvins::test;

namespace {

template <class Scalar>
using Matrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;
template <class Scalar>
using Vector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;

template <class Scalar>
math::PivotReport<Scalar> factor(Matrix<Scalar>& a, int k, math::ZeroPivot policy = math::ZeroPivot::fail) {
  const Vector<Scalar> reference = a.diagonal();
  return math::partial_cholesky(a.data(), static_cast<int>(a.outerStride()), static_cast<int>(a.cols()), k, reference.data(), policy);
}

template <class Scalar>
void check_against_dense(Rng& rng, double tolerance) {
  const int n = integer(rng, 1, 40), k = integer(rng, 0, n), ld = n + integer(rng, 0, 3);
  const Matrix<Scalar> full = random_spd(rng, n, 1e2).cast<Scalar>();
  Matrix<Scalar> a = Matrix<Scalar>::Constant(ld, n, Scalar(77));
  a.topRows(n).template triangularView<Eigen::Lower>() = full;
  const Vector<Scalar> reference = full.diagonal();
  REQUIRE(math::partial_cholesky(a.data(), ld, n, k, reference.data()).ok());
  const Matrix<Scalar> L11 = a.topLeftCorner(k, k).template triangularView<Eigen::Lower>();
  CHECK(close(L11 * L11.transpose(), full.topLeftCorner(k, k), tolerance));
  CHECK(close(a.block(k, 0, n - k, k) * L11.transpose(), full.block(k, 0, n - k, k), tolerance));
  const Matrix<Scalar> schur =
      full.bottomRightCorner(n - k, n - k) - full.block(k, 0, n - k, k) * full.topLeftCorner(k, k).llt().solve(full.block(0, k, k, n - k));
  const Matrix<Scalar> kept = a.block(k, k, n - k, n - k).template triangularView<Eigen::Lower>();
  CHECK(close(kept, Matrix<Scalar>(schur.template triangularView<Eigen::Lower>()), 20 * tolerance));
  for (int j = 1; j < n; ++j) CHECK(a(0, j) == Scalar(77));  // the upper triangle is not touched
  if (ld > n) CHECK(a(n, 0) == Scalar(77));

  Vector<Scalar> x = random_spd(rng, std::max(k, 1), 1e2).col(0).head(k).template cast<Scalar>();
  const Vector<Scalar> b = x;
  math::solve_lower(a.data(), ld, k, x.data());
  math::solve_lower_transposed(a.data(), ld, k, x.data());
  CHECK(close(full.topLeftCorner(k, k) * x, b, 50 * tolerance));
}

/// Information of variables whose units differ wildly: D S D with S well conditioned and D^2 from 1e-8 to 1e12.
template <class Scalar>
Matrix<double> spread(Rng& rng, Matrix<Scalar>& out, int n) {
  Matrix<double> s = random_spd(rng, n, 1e2);
  const Vector<double> unit = s.diagonal().cwiseSqrt().cwiseInverse();
  s = unit.asDiagonal() * s * unit.asDiagonal();
  Vector<double> d(n);
  for (int i = 0; i < n; ++i) d[i] = std::pow(10.0, i == 0 ? -4.0 : i == 1 ? 6.0 : uniform(rng, -4.0, 6.0));
  const Matrix<double> A = d.asDiagonal() * s * d.asDiagonal();
  out = A.cast<Scalar>();
  return A;
}

/// Largest error of A x = b in units of each variable's own sigma.
template <class Scalar>
double error_in_sigmas(Rng& rng, int n) {
  Matrix<Scalar> a;
  const Matrix<double> A = spread(rng, a, n);
  const Vector<double> sigma = A.diagonal().cwiseSqrt().cwiseInverse();
  Vector<double> truth(n);
  for (int i = 0; i < n; ++i) truth[i] = normal(rng) * sigma[i];
  Vector<Scalar> x = (A * truth).cast<Scalar>();
  const bool ok = factor(a, n).ok();
  CHECK(ok);
  math::solve_lower(a.data(), n, n, x.data());
  math::solve_lower_transposed(a.data(), n, n, x.data());
  return (x.template cast<double>() - truth).cwiseQuotient(sigma).template lpNorm<Eigen::Infinity>();
}

}  // namespace

TEST_CASE("the partial factor and the Schur complement equal the dense ones, in double and float, lower triangle only") {
  for_all_seeds(200, [](Rng& rng) { check_against_dense<double>(rng, 1e-13); });
  for_all_seeds(200, [](Rng& rng) { check_against_dense<float>(rng, 3e-5); });
}

TEST_CASE("factoring in two parts equals factoring at once") {
  for_all_seeds(50, [](Rng& rng) {
    const int n = integer(rng, 2, 30), k = integer(rng, 1, n - 1);
    Matrix<double> once = random_spd(rng, n, 1e3), parts = once;
    REQUIRE(factor(once, n).ok());
    REQUIRE(factor(parts, k).ok());
    Matrix<double> rest = parts.bottomRightCorner(n - k, n - k);
    REQUIRE(factor(rest, n - k).ok());
    const Matrix<double> expected = once.bottomRightCorner(n - k, n - k).triangularView<Eigen::Lower>();
    CHECK(close(Matrix<double>(rest.triangularView<Eigen::Lower>()), expected, 1e-10));
  });
}

TEST_CASE("a zero pivot stops at its column under `fail` and is passed over under `skip`") {
  for_all_seeds(100, [](Rng& rng) {
    const int n = integer(rng, 2, 24), missing = integer(rng, 0, n - 1);
    Matrix<double> J(n + 5, n);  // column `missing` is a combination of those before it (or zero)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n + 5; ++i) J(i, j) = normal(rng);
    J.col(missing).setZero();
    for (int j = 0; j < missing; ++j) J.col(missing) += J.col(j) / (1 + j);
    Matrix<double> a = J.transpose() * J, b = a;
    const Matrix<double> full = a;
    const auto failed = factor(a, n);
    CHECK(failed.failed == missing);
    CHECK_FALSE(failed.non_finite);
    CHECK(std::abs(failed.value) <= 1e-12 * full(missing, missing) + 1e-300);
    const auto skipped = factor(b, n, math::ZeroPivot::skip);
    CHECK(skipped.ok());
    CHECK(skipped.skipped == 1);
    const Matrix<double> L = b.triangularView<Eigen::Lower>();
    CHECK(L.col(missing).isZero(0));
    CHECK(close(L * L.transpose(), full, 1e-9));
    // A consistent system is solved; the free axis is put to zero.
    Vector<double> x = full * Vector<double>::Ones(n);
    const Vector<double> rhs = x;
    math::solve_lower(b.data(), n, n, x.data());
    math::solve_lower_transposed(b.data(), n, n, x.data());
    CHECK(x[missing] == 0);
    CHECK(close(full * x, rhs, 1e-7));
  });
}

TEST_CASE("P22: NaN and infinity are reported as non-finite, a negative pivot as a failing one; nothing is trapped") {
  for (const double bad : {std::nan(""), HUGE_VAL, -HUGE_VAL}) {
    Matrix<double> a = Matrix<double>::Identity(12, 12);
    a(9, 9) = bad;
    for (const auto policy : {math::ZeroPivot::fail, math::ZeroPivot::skip}) {
      Matrix<double> copy = a;
      const Vector<double> reference = Vector<double>::Ones(12);
      const auto report = math::partial_cholesky(copy.data(), 12, 12, 12, reference.data(), policy);
      CHECK(report.failed == 9);
      CHECK(report.non_finite);
    }
  }
  Matrix<double> negative = Matrix<double>::Identity(3, 3);
  negative(1, 1) = -1;
  CHECK(factor(negative, 3).failed == 1);
  Matrix<double> tiny = Matrix<double>::Identity(3, 3) * 5e-324;  // denormal: no usable root
  CHECK(factor(tiny, 3).failed == 0);
}

TEST_CASE("information from 1e-8 to 1e12 costs no accuracy: each variable is good to its own sigma, double 1e-10, float 1e-2") {
  double worst_double = 0, worst_float = 0;
  for_all_seeds(200, [&](Rng& rng) {
    const int n = integer(rng, 2, 30);
    worst_double = std::max(worst_double, error_in_sigmas<double>(rng, n));
    worst_float = std::max(worst_float, error_in_sigmas<float>(rng, n));
  });
  MESSAGE("worst error in sigmas: double ", worst_double, ", float ", worst_float);
  CHECK(worst_double < 1e-10);
  CHECK(worst_float < 1e-2);
}

TEST_CASE("a pivot share of 1e-12 is resolved in double and called zero in float") {
  const auto two = [](auto share) {
    using Scalar = decltype(share);
    Matrix<Scalar> a(2, 2);
    a << 1, 1, 1, 1 + share;
    return factor(a, 2);
  };
  CHECK(two(1e-12).ok());
  CHECK(two(1e-15).failed == 1);
  CHECK(two(1e-4F).ok());
  CHECK(two(1e-6F).failed == 1);
}
