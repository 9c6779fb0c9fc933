// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Rotations as 3x3 matrices, unit quaternions (Hamilton: ij = k) and rotation vectors theta = angle * axis, radians.
///
/// With K = [theta]x, t = |theta|, h = t/2 [Sola, Deray, Atchuthan, "A micro Lie theory", arXiv:1812.01537v9; Forster et al., TRO 2017]:
///
///     exp(theta) = I + A K + B K^2                  A = sin t / t                          [Sola (132), Forster (3)]
///     Jl(theta)  = I + B K + C K^2                  B = (1 - cos t)/t^2 = (sin h / h)^2/2  [Sola (145)]
///     Jr(theta)  = I - B K + C K^2 = Jl(-theta)     C = (t - sin t)/t^3                    [Sola (143), Forster (8)]
///     Jl^-1      = I - K/2 + D K^2                  D = (1 - h cot h)/t^2                  [Sola (146)]
///     Jr^-1      = I + K/2 + D K^2                                                         [Sola (144), Forster below (9)]
///
/// (D is 1/t^2 - (1 + cos t)/(2 t sin t); Forster prints a plus sign there.) The Jacobians say how a change of theta shows on a side:
///
///     exp(theta + d) = exp(theta) exp(Jr d) = exp(Jl d) exp(theta)        log(R exp(d)) = log(R) + Jr^-1 d        to first order
///
/// Numbers. A and B as written lose nothing at any t > 0. C and D cancel like eps/t^2: for t < 1 both use the one series
///
///     sum_k (-1)^k c_k x^2k / (2k+3)!        C: c_k = 1, x = t        4 D sin h / h: c_k = 2k + 2, x = h
///
/// summed until a term falls below numeric_limits<Scalar>::epsilon, so the same code is exact to a few epsilon in float and double.
/// Through the seam at t = 1 the closed forms lose a factor of 12 at most. log takes the half angle from atan2 of the quaternion, so
/// it needs no branch near 0 and none near pi.
///
/// Nothing here fails on finite input unless it says so; NaN or infinity in gives NaN out, and so does an overflow of |theta|^2.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cmath>
#include <limits>

#include <searvins/core/status.hpp>

namespace searvins::so3 {

/// A vector of three scalars.
template <class S>
using Vector3 = Eigen::Matrix<S, 3, 1>;
/// A 3 x 3 matrix.
template <class S>
using Matrix3 = Eigen::Matrix<S, 3, 3>;

namespace detail {

/// All four components are 0. (A maximum would not do: it may skip a NaN.)
template <class Derived>
[[nodiscard]] bool is_zero(const Eigen::QuaternionBase<Derived>& q) {
  using S = typename Derived::Scalar;
  return q.x() == S(0) && q.y() == S(0) && q.z() == S(0) && q.w() == S(0);
}

/// sin(t)/t, even in t. sin is exact to the last bit near 0, so only 0/0 needs care.
template <class S>
[[nodiscard]] S sine_ratio(S t) {
  return t == S(0) ? S(1) : std::sin(t) / t;
}

/// sum_k (-1)^k c_k x2^k / (2k+3)! with c_k = 1 + k * growth + offset; converges for every x2, meant for |x2| <= 1.
template <class S>
[[nodiscard]] S alternating_series(S x2, S offset, S growth) {
  S power = S(1) / S(6), sum = (S(1) + offset) * power;
  for (int k = 1; k < 12; ++k) {
    power *= -x2 / static_cast<S>((2 * k + 2) * (2 * k + 3));
    const S term = (S(1) + offset + static_cast<S>(k) * growth) * power;
    sum += term;
    if (std::abs(term) < std::numeric_limits<S>::epsilon() / S(16) * sum) break;
  }
  return sum;
}

/// B = (1 - cos t)/t^2, 1/2 at 0.
template <class S>
[[nodiscard]] S cosine_coefficient(S t) {
  const S ratio = sine_ratio(t / S(2));
  return ratio * ratio / S(2);
}

/// C = (t - sin t)/t^3, 1/6 at 0.
template <class S>
[[nodiscard]] S jacobian_coefficient(S t) {
  const S t2 = t * t;
  return t2 < S(1) ? alternating_series(t2, S(0), S(0)) : (t - std::sin(t)) / (t2 * t);
}

/// D = (1 - h cot h)/t^2 with h = t/2, 1/12 at 0; infinite at t = 2 pi, where the Jacobians are singular.
template <class S>
[[nodiscard]] S inverse_jacobian_coefficient(S t) {
  const S h = t / S(2), t2 = t * t;
  if (t2 < S(1)) return alternating_series(h * h, S(1), S(2)) / (S(4) * sine_ratio(h));
  return (S(1) - h * std::cos(h) / std::sin(h)) / t2;
}

/// I + first [theta]x + second [theta]x^2, the square written out so that its diagonal keeps its relative precision.
template <class S>
[[nodiscard]] Matrix3<S> quadratic_in_skew(const Vector3<S>& theta, S first, S second) {
  const S x = theta.x(), y = theta.y(), z = theta.z();
  const S xy = second * x * y, xz = second * x * z, yz = second * y * z;
  Matrix3<S> m;
  m << S(1) - second * (y * y + z * z), xy - first * z, xz + first * y,  //
      xy + first * z, S(1) - second * (x * x + z * z), yz - first * x,   //
      xz - first * y, yz + first * x, S(1) - second * (x * x + y * y);
  return m;
}

}  // namespace detail

/// [v]x, so that [v]x u = v x u.
template <class Derived>
[[nodiscard]] Matrix3<typename Derived::Scalar> skew(const Eigen::MatrixBase<Derived>& v) {
  using S = typename Derived::Scalar;
  const Vector3<S> a = v;
  Matrix3<S> m;
  m << S(0), -a.z(), a.y(),  //
      a.z(), S(0), -a.x(),   //
      -a.y(), a.x(), S(0);
  return m;
}

/// The vector of the antisymmetric part of a matrix: vee(skew(v)) = v.
template <class Derived>
[[nodiscard]] Vector3<typename Derived::Scalar> vee(const Eigen::MatrixBase<Derived>& matrix) {
  using S = typename Derived::Scalar;
  const Matrix3<S> m = matrix;
  return Vector3<S>{m(2, 1) - m(1, 2), m(0, 2) - m(2, 0), m(1, 0) - m(0, 1)} / S(2);
}

/// Rotation matrix of a rotation vector (radians), any length.
template <class Derived>
[[nodiscard]] Matrix3<typename Derived::Scalar> exp(const Eigen::MatrixBase<Derived>& theta) {
  using S = typename Derived::Scalar;
  const Vector3<S> v = theta;
  const S t = v.norm();
  return detail::quadratic_in_skew(v, detail::sine_ratio(t), detail::cosine_coefficient(t));
}

/// Right Jacobian Jr of exp.
template <class Derived>
[[nodiscard]] Matrix3<typename Derived::Scalar> right_jacobian(const Eigen::MatrixBase<Derived>& theta) {
  using S = typename Derived::Scalar;
  const Vector3<S> v = theta;
  const S t = v.norm();
  return detail::quadratic_in_skew(v, -detail::cosine_coefficient(t), detail::jacobian_coefficient(t));
}

/// Left Jacobian Jl of exp.
template <class Derived>
[[nodiscard]] Matrix3<typename Derived::Scalar> left_jacobian(const Eigen::MatrixBase<Derived>& theta) {
  return right_jacobian(-theta);
}

/// Inverse of the right Jacobian, for |theta| < 2 pi. The values of log have |theta| <= pi.
template <class Derived>
[[nodiscard]] Matrix3<typename Derived::Scalar> right_jacobian_inverse(const Eigen::MatrixBase<Derived>& theta) {
  using S = typename Derived::Scalar;
  const Vector3<S> v = theta;
  return detail::quadratic_in_skew(v, S(1) / S(2), detail::inverse_jacobian_coefficient(v.norm()));
}

/// Inverse of the left Jacobian, for |theta| < 2 pi.
template <class Derived>
[[nodiscard]] Matrix3<typename Derived::Scalar> left_jacobian_inverse(const Eigen::MatrixBase<Derived>& theta) {
  return right_jacobian_inverse(-theta);
}

/// Unit quaternion of a rotation vector: (cos h, sin h * axis).
template <class Derived>
[[nodiscard]] Eigen::Quaternion<typename Derived::Scalar> quaternion_exp(const Eigen::MatrixBase<Derived>& theta) {
  using S = typename Derived::Scalar;
  const Vector3<S> v = theta;
  const S h = v.norm() / S(2), scale = detail::sine_ratio(h) / S(2);
  return {std::cos(h), scale * v.x(), scale * v.y(), scale * v.z()};
}

/// Rotation vector of a quaternion of any length, |theta| <= pi; q and -q give the same. The zero quaternion names no rotation: it
/// gives zero.
///
///     theta = 2 atan2(|v|, w) v / |v|        for q = (w, v), w >= 0
///
/// At a half turn (w = 0) both signs of the axis are right: the one that stands in v is returned.
template <class Derived>
[[nodiscard]] Vector3<typename Derived::Scalar> quaternion_log(const Eigen::QuaternionBase<Derived>& q) {
  using S = typename Derived::Scalar;
  if (detail::is_zero(q)) return Vector3<S>::Zero();
  const S size = q.coeffs().cwiseAbs().maxCoeff();
  const S sign = q.w() < S(0) ? S(-1) : S(1);
  const S w = sign * q.w() / size;
  const Vector3<S> v = sign * q.vec() / size;
  const S n = v.norm();
  if (n == S(0)) return (S(2) / w) * v;  // |v| below the root of the smallest number, or NaN throughout
  return (S(2) * std::atan2(n, w) / n) * v;
}

/// Unit quaternion, w >= 0, of a rotation matrix. The largest component is taken from a square root and divides the others, so no
/// digit is lost at any angle [Shepperd, J. Guidance and Control 1978].
template <class Derived>
[[nodiscard]] Eigen::Quaternion<typename Derived::Scalar> quaternion_from_matrix(const Eigen::MatrixBase<Derived>& rotation) {
  using S = typename Derived::Scalar;
  const Matrix3<S> r = rotation;
  const S trace = r.trace();
  Eigen::Matrix<S, 4, 1> xyzw;
  Eigen::Index i = 0;
  const S largest = r.diagonal().maxCoeff(&i);
  if (!(trace < largest)) {
    const S w4 = S(2) * std::sqrt(S(1) + trace);  // 4 w
    xyzw << (r(2, 1) - r(1, 2)) / w4, (r(0, 2) - r(2, 0)) / w4, (r(1, 0) - r(0, 1)) / w4, w4 / S(4);
  } else {
    const Eigen::Index j = (i + 1) % 3, k = (i + 2) % 3;
    const S x4 = S(2) * std::sqrt(S(1) + r(i, i) - r(j, j) - r(k, k));  // 4 times component i
    xyzw[i] = x4 / S(4);
    xyzw[j] = (r(j, i) + r(i, j)) / x4;
    xyzw[k] = (r(k, i) + r(i, k)) / x4;
    xyzw[3] = (r(k, j) - r(j, k)) / x4;
  }
  if (xyzw[3] < S(0)) xyzw = -xyzw;
  return Eigen::Quaternion<S>{xyzw};
}

/// Rotation matrix of a quaternion of any length. The zero quaternion names no rotation: it gives the identity.
template <class Derived>
[[nodiscard]] Matrix3<typename Derived::Scalar> matrix_from_quaternion(const Eigen::QuaternionBase<Derived>& q) {
  using S = typename Derived::Scalar;
  if (detail::is_zero(q)) return Matrix3<S>::Identity();
  const S size = q.coeffs().cwiseAbs().maxCoeff();
  const S w = q.w() / size;
  const Vector3<S> v = q.vec() / size;
  const S two_over_n2 = S(2) / (w * w + v.squaredNorm());
  return detail::quadratic_in_skew(v, two_over_n2 * w, two_over_n2);
}

/// Rotation vector of a rotation matrix, |theta| <= pi. Relative precision of a few epsilon of |theta| up to pi; at pi, the matrix
/// cannot tell the two signs of the axis apart, and either may be returned.
template <class Derived>
[[nodiscard]] Vector3<typename Derived::Scalar> log(const Eigen::MatrixBase<Derived>& rotation) {
  return quaternion_log(quaternion_from_matrix(rotation));
}

/// The unit quaternion in the direction of q; the sign is kept. Errors: non_finite; invalid_argument (zero quaternion).
template <class Derived>
[[nodiscard]] Result<Eigen::Quaternion<typename Derived::Scalar>> normalise(const Eigen::QuaternionBase<Derived>& q) {
  using S = typename Derived::Scalar;
  if (!q.coeffs().allFinite()) return failure(StatusCode::non_finite, "quaternion with a NaN or infinite component");
  if (detail::is_zero(q)) return failure(StatusCode::invalid_argument, "the zero quaternion names no rotation");
  const Eigen::Matrix<S, 4, 1> scaled =
      q.coeffs() / q.coeffs().cwiseAbs().maxCoeff();  // so that neither tiny nor huge components lose their squares
  return Eigen::Quaternion<S>{Eigen::Matrix<S, 4, 1>{scaled / scaled.norm()}};
}

/// The rotation nearest to a matrix that has drifted off SO(3): its polar factor, by R <- R (3 I - R'R)/2, which converges
/// quadratically from |R'R - I| < 1 [Higham, Functions of Matrices, 2008, eq. (8.20)].
/// Errors: non_finite; invalid_argument (|R'R - I| >= 0.9 in the Frobenius norm, or a reflection): value = |R'R - I|.
template <class Derived>
[[nodiscard]] Result<Matrix3<typename Derived::Scalar>> orthonormalise(const Eigen::MatrixBase<Derived>& drifted) {
  using S = typename Derived::Scalar;
  Matrix3<S> r = drifted;
  if (!r.allFinite()) return failure(StatusCode::non_finite, "matrix with a NaN or infinite element");
  Matrix3<S> defect = r.transpose() * r - Matrix3<S>::Identity();
  const S start = defect.norm();
  const S handedness = r.col(0).dot(r.col(1).cross(r.col(2)));
  if (!(start < S(9) / S(10)) || handedness < S(0))
    return failure(StatusCode::invalid_argument, "matrix too far from a rotation", -1, -1, static_cast<double>(start));
  const S tolerance = std::sqrt(std::numeric_limits<S>::epsilon());
  for (int i = 0; i < 10; ++i) {
    const bool last = defect.norm() < tolerance;  // this step squares the defect: below epsilon afterwards
    r = (r - r * defect / S(2)).eval();
    if (last) break;
    defect = r.transpose() * r - Matrix3<S>::Identity();
  }
  return r;
}

}  // namespace searvins::so3
