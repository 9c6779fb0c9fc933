// SPDX-License-Identifier: BSD-3-Clause
// SO(3) against truth in long double that shares no formula with the header: matrix power series, inverses by the adjugate. Angles
// sweep 1e-9 .. pi on a logarithmic grid from below and from above (pi minus 1e-15 .. 1), tolerances are relative to the scalar.
#include <doctest/doctest.h>

#include <Eigen/Geometry>

#include <cmath>
#include <limits>
#include <vector>

#include <searvins/math/so3.hpp>

#include "support/property.hpp"

namespace so3 = searvins::so3;
using searvins::StatusCode;
using searvins::test::random_direction;
using searvins::test::Rng;

namespace {

using Real = long double;
using RealVector = Eigen::Matrix<Real, 3, 1>;
using RealMatrix = Eigen::Matrix<Real, 3, 3>;

constexpr Real kPi = 3.141592653589793238462643383279502884L;

template <class S>
constexpr S kEps = std::numeric_limits<S>::epsilon();

RealMatrix cross_matrix(const RealVector& v) {
  RealMatrix m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

/// sum_n K^n / (n + shift)! without its first term: exp(K) - I for shift 0, Jl - I for shift 1.
RealMatrix series_without_identity(const RealVector& theta, int shift) {
  const RealMatrix K = cross_matrix(theta);
  RealMatrix term = RealMatrix::Identity(), sum = RealMatrix::Zero();
  for (int n = 1; n < 60; ++n) {
    term = (term * K / static_cast<Real>(n + shift)).eval();
    sum += term;
  }
  return sum;
}

RealMatrix inverse(const RealMatrix& m) {
  RealMatrix inv;
  inv.row(0) = m.col(1).cross(m.col(2));
  inv.row(1) = m.col(2).cross(m.col(0));
  inv.row(2) = m.col(0).cross(m.col(1));
  return inv / m.col(0).dot(inv.row(0));
}

/// Largest error of the antisymmetric part relative to its size: what the diagonal ones would hide for small angles.
template <class S>
Real odd_error(const Eigen::Matrix<S, 3, 3>& a, const RealMatrix& truth) {
  const RealMatrix x = a.template cast<Real>();
  const RealMatrix odd = x - x.transpose(), odd_truth = truth - truth.transpose();
  return (odd - odd_truth).norm() / odd_truth.norm();
}

/// Error of the even part (with the identity).
template <class S>
Real even_error(const Eigen::Matrix<S, 3, 3>& a, const RealMatrix& truth) {
  const RealMatrix x = a.template cast<Real>();
  return ((x + x.transpose()) - (truth + truth.transpose())).norm() / truth.norm();
}

/// Angles on a log-spaced grid from 1e-9 to pi, from pi - 1 towards pi, and on both sides of the seam at 1 (and at 2, where the half
/// angle passes it).
template <class S>
std::vector<S> all_angles() {
  constexpr int kSteps = 60;
  const Real span = std::log10(kPi) + 9;
  std::vector<S> angles;
  for (int i = 0; i <= kSteps; ++i) angles.push_back(static_cast<S>(std::pow(10.0L, -9 + span * i / kSteps)));
  for (int i = 0; i <= kSteps; ++i) angles.push_back(static_cast<S>(kPi - std::pow(10.0L, -15.0L * i / kSteps)));
  for (const S seam : {S(1), S(2)})
    for (const S t : {std::nextafter(seam, S(0)), seam, std::nextafter(seam, S(4))}) angles.push_back(t);
  return angles;
}

/// A matrix or vector in precision S, and the same numbers in long double: input rounding is no error of the function.
template <class S>
struct Angle {
  Eigen::Matrix<S, 3, 1> theta;
  RealVector exact;
};

template <class S>
Angle<S> angle_about(Rng& rng, S t) {
  const Eigen::Matrix<S, 3, 1> theta = random_direction(rng).cast<S>() * t;
  return {theta, theta.template cast<Real>()};
}

}  // namespace

TEST_CASE_TEMPLATE("P23: the scalar coefficients over the sweep, relative to long double", S, float, double) {
  for (const S t : all_angles<S>()) {
    CAPTURE(t);
    // unit-axis series: K^3 = -t^2 K, so column sums of the power series give B, C without a closed form
    const Real x = static_cast<Real>(t);
    Real b = 0, c = 0, term = 1.0L / 2;
    for (int n = 2; n < 60; n += 2) {  // b = sum (-1)^k x^2k/(2k+2)!, c = sum (-1)^k x^2k/(2k+3)!
      b += term;
      c += term / static_cast<Real>(n + 1);
      term *= -x * x / static_cast<Real>((n + 1) * (n + 2));
    }
    const Real a = 1 - x * x * c;
    const Real d = (1 - a / (2 * b)) / (x * x);
    const auto relative = [](S value, Real truth) { return std::abs(static_cast<Real>(value) - truth) / std::abs(truth); };
    CHECK(relative(so3::detail::cosine_coefficient(t), b) <= 4 * kEps<S>);
    CHECK(relative(so3::detail::jacobian_coefficient(t), c) <= 8 * kEps<S>);
    if (a > 0.01L) CHECK(relative(so3::detail::sine_ratio(t), a) <= 4 * kEps<S>);
    if (t > S(0.01)) CHECK(relative(so3::detail::inverse_jacobian_coefficient(t), d) <= 16 * kEps<S>);
    if (t <= S(0.01))
      CHECK(relative(so3::detail::inverse_jacobian_coefficient(t), 1.0L / 12 + x * x / 720 + x * x * x * x / 30240) <= 16 * kEps<S>);
  }
  CHECK(so3::detail::sine_ratio(S(0)) == S(1));
  CHECK(so3::detail::cosine_coefficient(S(0)) == S(1) / S(2));
  CHECK(so3::detail::jacobian_coefficient(S(0)) == S(1) / S(6));
  CHECK(std::abs(so3::detail::inverse_jacobian_coefficient(S(0)) - S(1) / S(12)) <= kEps<S>);
}

TEST_CASE_TEMPLATE("P23: the coefficients are continuous across the seam at t = 1", S, float, double) {
  const S below = std::nextafter(S(1), S(0)), above = S(1);
  const auto jump = [&](auto f) { return std::abs(f(above) - f(below)) / std::abs(f(above)); };
  CHECK(jump([](S t) { return so3::detail::jacobian_coefficient(t); }) <= 8 * kEps<S>);
  CHECK(jump([](S t) { return so3::detail::inverse_jacobian_coefficient(t); }) <= 16 * kEps<S>);
}

TEST_CASE_TEMPLATE("P23: exp and the four Jacobians over the sweep, against power series in long double", S, float, double) {
  searvins::test::for_all_seeds(20, [](Rng& rng) {
    for (const S t : all_angles<S>()) {
      CAPTURE(t);
      const Angle<S> a = angle_about(rng, t);
      const RealMatrix one = RealMatrix::Identity();
      const RealMatrix R = one + series_without_identity(a.exact, 0);
      const RealMatrix Jl = one + series_without_identity(a.exact, 1);
      const RealMatrix Jr = one + series_without_identity(RealVector{-a.exact}, 1);
      // sin t / t itself is ill-conditioned next to pi: there the odd part is compared with the angle, not with its own small size
      const Real own = t < S(2) ? 1 : (R - R.transpose()).norm() / static_cast<Real>(t);
      CHECK(odd_error(so3::exp(a.theta), R) * own <= 8 * kEps<S>);
      CHECK(even_error(so3::exp(a.theta), R) <= 8 * kEps<S>);
      CHECK(odd_error(so3::left_jacobian(a.theta), Jl) <= 8 * kEps<S>);
      CHECK(even_error(so3::left_jacobian(a.theta), Jl) <= 8 * kEps<S>);
      CHECK(odd_error(so3::right_jacobian(a.theta), Jr) <= 8 * kEps<S>);
      CHECK(even_error(so3::right_jacobian(a.theta), Jr) <= 8 * kEps<S>);
      CHECK(odd_error(so3::left_jacobian_inverse(a.theta), inverse(Jl)) <= 16 * kEps<S>);
      CHECK(even_error(so3::left_jacobian_inverse(a.theta), inverse(Jl)) <= 16 * kEps<S>);
      CHECK(odd_error(so3::right_jacobian_inverse(a.theta), inverse(Jr)) <= 16 * kEps<S>);
      CHECK(even_error(so3::right_jacobian_inverse(a.theta), inverse(Jr)) <= 16 * kEps<S>);
    }
  });
}

TEST_CASE_TEMPLATE("P23: log inverts exp over the sweep, matrix and quaternion, relative to the angle", S, float, double) {
  searvins::test::for_all_seeds(50, [](Rng& rng) {
    for (const S t : all_angles<S>()) {
      CAPTURE(t);
      const Angle<S> a = angle_about(rng, t);
      const auto error = [&](const Eigen::Matrix<S, 3, 1>& b) {
        const RealVector x = b.template cast<Real>();
        Real e = (x - a.exact).norm();
        if (t > S(3)) {  // beyond pi (by rounding) the shorter way round has the other sign
          const RealVector other = a.exact * (1 - 2 * kPi / a.exact.norm());
          e = std::min(e, (x - other).norm());
        }
        return e / a.exact.norm();
      };
      CHECK(error(so3::log(so3::exp(a.theta))) <= 10 * kEps<S>);
      CHECK(error(so3::quaternion_log(so3::quaternion_exp(a.theta))) <= 10 * kEps<S>);
      Eigen::Quaternion<S> negated;
      negated.coeffs() = -so3::quaternion_exp(a.theta).coeffs() * S(3);  // same rotation, not unit
      CHECK(error(so3::quaternion_log(negated)) <= 10 * kEps<S>);
    }
  });
}

TEST_CASE_TEMPLATE("log of a rounded rotation is the log of the nearest truth, also exactly at pi about each axis", S, float, double) {
  for (int axis = 0; axis < 3; ++axis) {
    Eigen::Matrix<S, 3, 3> half_turn = -Eigen::Matrix<S, 3, 3>::Identity();
    half_turn(axis, axis) = S(1);
    const Eigen::Matrix<S, 3, 1> theta = so3::log(half_turn);
    CHECK(std::abs(theta[axis]) == doctest::Approx(static_cast<double>(kPi)).epsilon(2 * static_cast<double>(kEps<S>)));
    CHECK(theta.norm() == std::abs(theta[axis]));
  }
  CHECK(so3::log(Eigen::Matrix<S, 3, 3>::Identity().eval()).norm() == S(0));
}

TEST_CASE_TEMPLATE("P22: zeros, denormals, huge, NaN and infinite input: a value, NaN or a status, never a trap", S, float, double) {
  using Vector = Eigen::Matrix<S, 3, 1>;
  using Matrix = Eigen::Matrix<S, 3, 3>;
  const S nan = std::numeric_limits<S>::quiet_NaN(), inf = std::numeric_limits<S>::infinity();
  const S tiny = std::numeric_limits<S>::denorm_min(), small = std::numeric_limits<S>::min();
  for (const S size : {S(0), tiny, small, std::sqrt(small)}) {
    const Vector v{size, -size, size};
    CHECK((so3::exp(v) - Matrix::Identity()).cwiseAbs().maxCoeff() == size);
    CHECK((so3::log(so3::exp(v)) - v).norm() <= kEps<S> * size);
    CHECK((so3::right_jacobian(v) - Matrix::Identity()).norm() <= S(2) * size);
    CHECK((so3::left_jacobian_inverse(v) - Matrix::Identity()).norm() <= S(2) * size);
    CHECK((so3::quaternion_exp(v).coeffs() - Eigen::Quaternion<S>::Identity().coeffs()).norm() <= S(2) * size);
  }
  CHECK(so3::quaternion_log(Eigen::Quaternion<S>{S(0), S(0), S(0), S(0)}).norm() == S(0));
  CHECK(so3::matrix_from_quaternion(Eigen::Quaternion<S>{S(0), S(0), S(0), S(0)}) == Matrix::Identity());
  CHECK(so3::log(Matrix::Zero().eval()).allFinite());
  for (const S bad : {nan, inf, -inf}) {
    for (int i = 0; i < 3; ++i) {
      Vector v = Vector::Constant(S(0.5));
      v[i] = bad;
      CHECK_FALSE(so3::exp(v).allFinite());
      CHECK_FALSE(so3::right_jacobian(v).allFinite());
      CHECK_FALSE(so3::left_jacobian_inverse(v).allFinite());
      CHECK_FALSE(so3::quaternion_exp(v).coeffs().allFinite());
    }
    for (int i = 0; i < 9; ++i) {
      Matrix R = so3::exp(Vector{S(0.3), S(-0.7), S(0.2)});
      R.data()[i] = bad;
      CHECK_FALSE(so3::log(R).allFinite());
      CHECK(so3::orthonormalise(R).status().code == StatusCode::non_finite);
    }
    for (int i = 0; i < 4; ++i) {
      Eigen::Quaternion<S> q = Eigen::Quaternion<S>::Identity();
      q.coeffs()[i] = bad;
      CHECK(so3::normalise(q).status().code == StatusCode::non_finite);
      CHECK_FALSE(so3::quaternion_log(q).allFinite());
      CHECK_FALSE(so3::matrix_from_quaternion(q).allFinite());
    }
  }
  CHECK_FALSE(so3::exp(Vector::Constant(std::numeric_limits<S>::max()).eval()).allFinite());  // |theta|^2 overflows
}
