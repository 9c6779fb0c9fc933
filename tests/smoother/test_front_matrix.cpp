// SPDX-License-Identifier: BSD-3-Clause
// The numbers of a front: assembly by runs and partial factorisation, against dense matrices and the plain partial Cholesky.
#include <searvins/smoother/front_matrix.hpp>

#include <Eigen/Dense>

#include <algorithm>
#include <limits>
#include <vector>

#include "front_under_test.hpp"
#include "support/property.hpp"

using namespace searvins;
using namespace searvins::test;
using math::ZeroPivot;
using smoother::Run;

namespace {

template <class Scalar>
using Matrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;
template <class Scalar>
using Vector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;

constexpr int kMaxRank = 40;

template <class Scalar>
math::PivotReport<Scalar> factorise(const FrontUnderTest<Scalar>& f, const Vector<Scalar>& reference, ZeroPivot policy) {
  smoother::ColumnTile<Scalar, kMaxRank> tile;
  return f.front().factorise(tile, reference.data(), policy);
}

/// By math::partial_cholesky and by the front: the same report, and the same lower triangle if both came to an end.
template <class Scalar>
math::PivotReport<Scalar> check_same(const Matrix<Scalar>& A, const Vector<Scalar>& reference, int rows_e, ZeroPivot policy, double tolerance) {
  const int n = static_cast<int>(A.rows());
  FrontUnderTest<Scalar> front{rows_e, n - 1 - rows_e};
  front.set(A);
  Matrix<Scalar> plain = A;
  const auto expected = math::partial_cholesky(plain.data(), n, n, rows_e, reference.data(), policy);
  const auto report = factorise(front, reference, policy);
  CHECK(report.failed == expected.failed);
  CHECK(report.skipped == expected.skipped);
  CHECK(report.non_finite == expected.non_finite);
  if (expected.ok()) CHECK(close(front.lower(), lower_of(plain), tolerance));
  return report;
}

/// U of `runs` scattered to the same rows of an n x n matrix.
template <class Scalar>
Matrix<Scalar> scattered(const Matrix<Scalar>& U, const std::vector<int>& rows, int n) {
  Matrix<Scalar> out = Matrix<Scalar>::Zero(n, n);
  for (std::size_t i = 0; i < rows.size(); ++i)
    for (std::size_t j = 0; j < rows.size(); ++j) out(rows[i], rows[j]) = U(static_cast<int>(i), static_cast<int>(j));
  return out;
}

/// An update matrix of as many rows as the runs have, NaN where nothing may read; and its runs, one after the other, in U's own rows.
struct Update {
  Matrix<double> full, lower;
  std::vector<Run> runs;
  std::vector<int> to, rows;

  Update(Rng& rng, const std::vector<Run>& targets) : rows(rows_of(targets)) {
    const int m = static_cast<int>(rows.size());
    full = random_spd(rng, std::max(m, 1));
    lower = Matrix<double>::Constant(full.rows(), full.cols(), std::numeric_limits<double>::quiet_NaN());
    lower.triangularView<Eigen::Lower>() = full;
    for (int first = 0; const Run& target : targets) {
      runs.push_back({first, target.count});
      to.push_back(target.first);
      first += target.count;
    }
  }
  [[nodiscard]] int ld() const { return static_cast<int>(lower.rows()); }
  [[nodiscard]] int count() const { return static_cast<int>(runs.size()); }
};

}  // namespace

TEST_CASE("front matrix: L L' is H_EE, the rest its Schur complement, and the gradient goes along as a row") {
  for_all_seeds(200, [](Rng& rng) {
    const int e = integer(rng, 0, 30), s = integer(rng, 0, 20), n = e + s + 1;
    const Matrix<double> A = random_spd(rng, n, 1e2);
    FrontUnderTest<double> f{e, s};
    f.set(A);
    REQUIRE(factorise<double>(f, A.diagonal(), ZeroPivot::fail).ok());
    const Matrix<double> lower = f.lower(), L = lower.topLeftCorner(e, e);
    CHECK(close(L * L.transpose(), A.topLeftCorner(e, e), 1e-12));
    CHECK(close(lower.bottomLeftCorner(s + 1, e) * L.transpose(), A.bottomLeftCorner(s + 1, e), 1e-12));
    const Matrix<double> schur =
        A.bottomRightCorner(s + 1, s + 1) - A.bottomLeftCorner(s + 1, e) * A.topLeftCorner(e, e).llt().solve(A.topRightCorner(e, s + 1));
    CHECK(close(Matrix<double>(lower.bottomRightCorner(s + 1, s + 1)), lower_of(schur), 1e-11));
  });
}

TEST_CASE("front matrix: factor and report are those of the plain partial Cholesky") {
  for_all_seeds(200, [](Rng& rng) {
    const int e = integer(rng, 1, 30), n = e + 1 + integer(rng, 0, 10);
    const Matrix<double> A = random_spd(rng, n, 1e2);
    SUBCASE("double") { CHECK(check_same<double>(A, A.diagonal(), e, ZeroPivot::fail, 1e-12).ok()); }
    SUBCASE("float") { CHECK(check_same<float>(A.cast<float>(), A.diagonal().cast<float>(), e, ZeroPivot::fail, 1e-4).ok()); }
    SUBCASE("an axis that no information reaches") {
      Matrix<double> holed = A;
      const int axis = integer(rng, 0, e - 1);
      holed.row(axis).setZero(), holed.col(axis).setZero();
      CHECK(check_same<double>(holed, holed.diagonal(), e, ZeroPivot::fail, 0).failed == axis);
      CHECK(check_same<double>(holed, holed.diagonal(), e, ZeroPivot::skip, 1e-12).skipped == 1);
    }
    SUBCASE("an axis that the axes before it explain") {
      Matrix<double> J = Matrix<double>::Random(2 * n, n);
      const int axis = integer(rng, 0, e - 1);
      if (axis > 0) J.col(axis) = J.leftCols(axis) * Eigen::VectorXd::Random(axis);
      if (axis == 0) J.col(0).setZero();
      const Matrix<double> singular = J.transpose() * J;
      CHECK(check_same<double>(singular, singular.diagonal(), e, ZeroPivot::fail, 0).failed == axis);
    }
    SUBCASE("a number that is none") {
      Matrix<double> broken = A;
      const int axis = integer(rng, 0, e - 1);
      broken(axis, axis) = std::numeric_limits<double>::quiet_NaN();
      const auto report = check_same<double>(broken, A.diagonal(), e, ZeroPivot::skip, 0);
      CHECK(report.failed == axis);
      CHECK(report.non_finite);
    }
  });
}

TEST_CASE("front matrix: adding an update matrix puts each of its elements once where its rows belong, in any order of its runs") {
  for_all_seeds(200, [](Rng& rng) {
    const int e = integer(rng, 0, 15), s = integer(rng, 0, 15), n = e + s + 1;
    FrontUnderTest<double> f{e, s};
    const Matrix<double> before = random_spd(rng, n);
    f.set(before);
    std::vector<Run> targets = random_runs(rng, n, e);
    std::shuffle(targets.begin(), targets.end(), rng);
    const Update update{rng, targets};
    f.front().add(update.lower.data(), update.ld(), update.runs.data(), update.to.data(), update.count());
    CHECK(close(f.lower(), lower_of(before + scattered(update.full, update.rows, n)), 1e-14));
  });
}

TEST_CASE("front matrix: assigning leaves exactly the update matrix, whatever was there before") {
  for_all_seeds(200, [](Rng& rng) {
    const int e = integer(rng, 0, 15), s = integer(rng, 0, 15), n = e + s + 1;
    FrontUnderTest<double> f{e, s};
    const Update update{rng, random_runs(rng, n, e)};
    f.front().assign(update.lower.data(), update.ld(), update.runs.data(), update.to.data(), update.count());
    CHECK(f.lower() == lower_of(scattered(update.full, update.rows, n)));
  });
}

TEST_CASE("front matrix: clearing takes the columns asked for and no other element of the triangle") {
  FrontUnderTest<double> f{5, 4};
  const Matrix<double> full = Matrix<double>::Ones(10, 10);
  f.set(full);
  f.front().clear(3, 7);
  Matrix<double> expected = full;
  expected.middleCols(3, 4).setZero();
  CHECK(f.lower() == lower_of(expected));
}

TEST_CASE("front matrix: a product over scattered columns is taken off as if it were dense") {
  for_all_seeds(200, [](Rng& rng) {
    const int e = integer(rng, 0, 15), s = integer(rng, 0, 15), n = e + s + 1, rank = integer(rng, 1, 3);
    FrontUnderTest<double> f{e, s};
    const Matrix<double> before = random_spd(rng, n);
    f.set(before);
    const std::vector<Run> runs = random_runs(rng, n, e);
    const std::vector<int> rows = rows_of(runs);
    Matrix<double> packed = Matrix<double>::Zero(n, 3), dense = Matrix<double>::Zero(n, 3);
    for (int p = 0; p < rank; ++p)
      for (std::size_t i = 0; i < rows.size(); ++i) dense(rows[i], p) = packed(static_cast<int>(i), p) = normal(rng);
    smoother::ColumnTile<double, 3> tile;
    f.front().subtract(tile, runs.data(), static_cast<int>(runs.size()), packed.data(), n, rank);
    CHECK(close(f.lower(), lower_of(before - dense * dense.transpose()), 1e-14));
  });
}

TEST_CASE("front matrix: symmetric() names one element for both orders") {
  FrontUnderTest<double> f{3, 2};
  for (int a = 0; a < f.size(); ++a)
    for (int b = 0; b < f.size(); ++b) {
      CHECK(&f.front().symmetric(a, b) == &f.front().symmetric(b, a));
      CHECK(&f.front().symmetric(a, b) == &f.front()(std::max(a, b), std::min(a, b)));
    }
}
