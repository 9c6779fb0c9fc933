// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include <searvins/robust/shared_pivot.hpp>

#include "linear_batch.hpp"

using searvins::StatusCode;
using searvins::robust::SharedPivot;
using namespace searvins::test;

namespace {

template <class S>
using Array = std::array<S, kMost>;
using Wide = MatrixX<long double>;

template <class S>
Cov<S> random_cov(Rng& rng, int m, double decades) {
  Array<S> d{};
  for (int i = 0; i < m; ++i) d[static_cast<std::size_t>(i)] = static_cast<S>(std::pow(10.0, uniform(rng, -decades, decades)));
  const S s = chance(rng, 0.1) ? S(0) : static_cast<S>(std::pow(10.0, uniform(rng, -decades, decades)));
  return Cov<S>::from(d.data(), m, s).value();
}

/// Sigma in long double. Its condition number is up to 1 + s sum 1/d_i: within 1.5 decades the dense inverse below keeps a few units of
/// double's last place; wider spreads are tested without an inverse.
template <class S>
Wide dense(const Cov<S>& cov) {
  Wide sigma = Wide::Constant(cov.size(), cov.size(), static_cast<long double>(cov.pivot_variance()));
  for (int i = 0; i < cov.size(); ++i) sigma(i, i) += static_cast<long double>(cov.candidate_variance(i));
  return sigma;
}

/// R, column by column of the identity.
template <class S>
Wide whitening(const Cov<S>& cov) {
  Eigen::Matrix<S, Eigen::Dynamic, Eigen::Dynamic> r = Eigen::Matrix<S, Eigen::Dynamic, Eigen::Dynamic>::Identity(cov.size(), cov.size());
  cov.whiten_rows(r, r);
  return r.template cast<long double>();
}

Wide inverse_of(const Wide& a) { return solve_dense<long double>(a, Wide::Identity(a.rows(), a.cols())); }

/// ln det by elimination.
long double log_det_of(Wide a) {
  long double sum = 0;
  for (int k = 0; k < a.rows(); ++k) {
    sum += std::log(a(k, k));
    for (int i = k + 1; i < a.rows(); ++i)
      for (int j = static_cast<int>(a.cols()) - 1; j >= k; --j) a(i, j) -= a(i, k) / a(k, k) * a(k, j);
  }
  return sum;
}

/// R Sigma R' = I is the statement that needs no inverse. |R| Sigma |R|' is the size of the terms that cancel.
template <class S>
void check_whitens(const Cov<S>& cov) {
  const int m = cov.size();
  const Wide R = whitening(cov), sigma = dense(cov), size = times(R.cwiseAbs(), times(sigma, R.cwiseAbs().transpose()));
  const Wide error = times(R, times(sigma, R.transpose())) - Wide::Identity(m, m);
  CHECK(R.allFinite());
  CHECK(static_cast<double>((error.cwiseAbs() - 8 * m * static_cast<long double>(std::numeric_limits<S>::epsilon()) * size).maxCoeff()) <=
        0);
}

/// Largest |a - b| relative to sqrt of the diagonals, as correlations are: ill-scaled rows count like the others.
double scaled_difference(const Wide& a, const Wide& b) {
  const Wide s = b.diagonal().array().sqrt().inverse().matrix();
  return static_cast<double>((s.asDiagonal() * (a - b) * s.asDiagonal()).cwiseAbs().maxCoeff());
}

}  // namespace

TEST_CASE_TEMPLATE("R is upper triangular with positive diagonal and R'R is the inverse of Sigma", S, float, double) {
  const double epsilon = static_cast<double>(std::numeric_limits<S>::epsilon());
  for_all_seeds(200, [&](Rng& rng) {
    const Cov<S> cov = random_cov<S>(rng, integer(rng, 1, kMost), 1.5);
    const Wide R = whitening(cov), inverse = inverse_of(dense(cov));
    for (int i = 0; i < cov.size(); ++i) {
      CHECK(R(i, i) > 0);
      for (int j = 0; j < i; ++j) CHECK(R(i, j) == 0);
    }
    CHECK(scaled_difference(times(R.transpose(), R), inverse) <= 50 * epsilon);
    check_whitens(random_cov<S>(rng, integer(rng, 1, kMost), 6.0));
  });
}

TEST_CASE("R has the documented entries: a diagonal, and a row constant times 1/d_j; the last row sees the last candidate only") {
  for_all_seeds(100, [](Rng& rng) {
    const int m = integer(rng, 2, kMost);
    const Cov<double> cov = random_cov<double>(rng, m, 2.0);
    const Wide R = whitening(cov);
    const double s = cov.pivot_variance();
    double precision = s > 0 ? 1 / s : std::numeric_limits<double>::infinity();
    for (int i = m - 1; i >= 0; --i) {
      const double t = 1 / precision, diagonal = 1 / std::sqrt(cov.candidate_variance(i) + t);
      CHECK(static_cast<double>(R(i, i)) == doctest::Approx(diagonal).epsilon(1e-12));
      for (int j = i + 1; j < m; ++j)
        CHECK(static_cast<double>(R(i, j)) == doctest::Approx(-t * diagonal / cov.candidate_variance(j)).epsilon(1e-10));
      precision += 1 / cov.candidate_variance(i);
    }
  });
}

TEST_CASE_TEMPLATE("quadratic form, inverse times vector, log det and whitened norm equal the dense ones", S, float, double) {
  const double epsilon = static_cast<double>(std::numeric_limits<S>::epsilon());
  for_all_seeds(200, [&](Rng& rng) {
    const int m = integer(rng, 1, kMost);
    const Cov<S> cov = random_cov<S>(rng, m, 1.5);
    const Wide sigma = dense(cov), inverse = inverse_of(sigma);
    Array<S> r{}, e{}, x{};
    Wide wide_r(m, 1);
    for (int i = 0; i < m; ++i) {
      r[static_cast<std::size_t>(i)] = static_cast<S>(normal(rng, 3.0));
      wide_r(i, 0) = static_cast<long double>(r[static_cast<std::size_t>(i)]);
    }
    const Wide exact_x = times(inverse, wide_r);
    const double exact = static_cast<double>(times(wide_r.transpose(), exact_x)(0, 0));
    // Conditioning: r_i - q may cancel, so errors are relative to the terms, sum r_i^2/d_i, not to their result.
    double terms = 0;
    for (int i = 0; i < m; ++i) terms += static_cast<double>(wide_r(i, 0) * wide_r(i, 0)) / static_cast<double>(cov.candidate_variance(i));
    CHECK(std::abs(static_cast<double>(cov.quadratic_form(r.data())) - exact) <=
          50 * epsilon * (exact + epsilon * terms + std::sqrt(exact * terms)));

    cov.whiten(r.data(), e.data());
    double norm2 = 0;
    for (int i = 0; i < m; ++i)
      norm2 += static_cast<double>(e[static_cast<std::size_t>(i)]) * static_cast<double>(e[static_cast<std::size_t>(i)]);
    CHECK(std::abs(norm2 - exact) <= 50 * epsilon * (exact + epsilon * terms + std::sqrt(exact * terms)));

    cov.apply_inverse(r.data(), x.data());
    double largest = 0;
    for (int i = 0; i < m; ++i) largest = std::max(largest, std::abs(static_cast<double>(wide_r(i, 0))));
    for (int i = 0; i < m; ++i)
      CHECK(std::abs(static_cast<double>(x[static_cast<std::size_t>(i)]) - static_cast<double>(exact_x(i, 0))) <=
            100 * epsilon * largest / static_cast<double>(cov.candidate_variance(i)));

    const double exact_log_det = static_cast<double>(log_det_of(sigma));
    CHECK(std::abs(static_cast<double>(cov.log_det()) - exact_log_det) <= 50 * epsilon * m);

    std::array<S, kMost> in_place = r;
    cov.whiten(in_place.data(), in_place.data());
    CHECK(in_place == e);
    in_place = r;
    cov.apply_inverse(in_place.data(), in_place.data());
    for (int i = 0; i < m; ++i) CHECK(in_place[static_cast<std::size_t>(i)] == x[static_cast<std::size_t>(i)]);
  });
}

TEST_CASE("whitening the rows of a Jacobian is whitening each column, in row-major, column-major and block storage, also in place") {
  for_all_seeds(100, [](Rng& rng) {
    const int m = integer(rng, 1, kMost);
    const Cov<double> cov = random_cov<double>(rng, m, 3.0);
    Eigen::Matrix<double, kMost + 1, 7> J, out;
    Eigen::Matrix<double, kMost + 1, 7, Eigen::RowMajor> row_major;
    for (int i = 0; i <= kMost; ++i)
      for (int c = 0; c < 7; ++c) J(i, c) = normal(rng);
    out.setConstant(99);
    row_major.setConstant(99);
    cov.whiten_rows(J, out);
    cov.whiten_rows(J, row_major);
    for (int c = 0; c < 7; ++c) {
      Array<double> e{};
      cov.whiten(J.col(c).data(), e.data());
      for (int i = 0; i < m; ++i) CHECK(out(i, c) == e[static_cast<std::size_t>(i)]);
    }
    CHECK(row_major == out);
    for (int i = m; i <= kMost; ++i) CHECK((out.row(i).array() == 99.0).all());  // nothing else is touched
    cov.whiten_rows(J.topRows(m).rightCols(2), J.topRows(m).rightCols(2));
    CHECK(J.topRows(m).rightCols(2) == out.topRows(m).rightCols(2));
  });
}

TEST_CASE_TEMPLATE("extremes: no pivot error, one candidate, variances twelve decades apart, a pivot that is not known at all", S, float,
                   double) {
  const double epsilon = static_cast<double>(std::numeric_limits<S>::epsilon());
  const auto check = [&](const Array<S>& d, int m, S s) {
    const Cov<S> cov = Cov<S>::from(d.data(), m, s).value();
    check_whitens(cov);
    CHECK(std::isfinite(cov.log_det()));
    CHECK(std::isfinite(cov.inverse_pivot_sigma()));
  };
  check({S(2)}, 1, S(0));
  check({S(2)}, 1, S(3));
  check({S(1e-6), S(1e6), S(1), S(1e-6)}, 4, S(0));
  check({S(1e-6), S(1e6), S(1), S(1e-6)}, 4, S(1e-6));
  check({S(1e6), S(1e-6), S(1e6)}, 3, S(1));
  check({S(1), S(2), S(3), S(4), S(5)}, 5, S(1e12));
  check({S(9e-6), S(9e-6), S(4e-4)}, 3, S(1e-30));

  const Array<S> d{S(4), S(0.25), S(1)};
  const Cov<S> none = Cov<S>::from(d.data(), 3, S(0)).value();
  const Array<S> r{S(2), S(3), S(-1)};
  Array<S> e{};
  none.whiten(r.data(), e.data());
  CHECK(e[0] == S(1));  // s = 0: each residual by its own sigma
  CHECK(e[1] == S(6));
  CHECK(e[2] == S(-1));
  CHECK(none.quadratic_form(r.data()) == S(38));
  CHECK(none.common_part(r.data()) == S(0));

  const Cov<S> one = Cov<S>::from(d.data(), 1, S(5)).value();
  one.whiten(r.data(), e.data());
  CHECK(static_cast<double>(e[0]) == doctest::Approx(2.0 / 3.0).epsilon(4 * epsilon));
  CHECK(static_cast<double>(one.log_det()) == doctest::Approx(std::log(9.0)).epsilon(8 * epsilon));
}

TEST_CASE("bad variances and counts are refused with the index of the offender") {
  const Array<double> good{1, 2, 3};
  CHECK(Cov<double>::from(good.data(), 3, 0.0).ok());
  CHECK(Cov<double>::from(good.data(), 0, 1.0).status().code == StatusCode::no_data);
  CHECK(SharedPivot<double, 2>::from(good.data(), 3, 1.0).status().code == StatusCode::capacity_exceeded);
  CHECK(SharedPivot<double, 3>::from(good.data(), 3, 1.0).ok());
  const auto refuse = [&](int at, double value, double pivot, StatusCode code, int index) {
    Array<double> d = good;
    if (at >= 0) d[static_cast<std::size_t>(at)] = value;
    const auto result = Cov<double>::from(d.data(), 3, pivot);
    CHECK(result.status().code == code);
    CHECK(result.status().index == index);
  };
  refuse(1, 0.0, 1.0, StatusCode::invalid_argument, 1);
  refuse(2, -1.0, 1.0, StatusCode::invalid_argument, 2);
  refuse(0, std::numeric_limits<double>::quiet_NaN(), 1.0, StatusCode::non_finite, 0);
  refuse(-1, 0.0, -1.0, StatusCode::invalid_argument, 3);
  refuse(-1, 0.0, std::numeric_limits<double>::infinity(), StatusCode::non_finite, 3);
}

TEST_CASE("an empty covariance does nothing") {
  const Cov<double> cov;
  double untouched = 7;
  cov.whiten(&untouched, &untouched);
  cov.apply_inverse(&untouched, &untouched);
  CHECK(untouched == 7);
  CHECK(cov.size() == 0);
  CHECK(cov.quadratic_form(&untouched) == 0);
  CHECK(cov.log_det() == 0);
}
