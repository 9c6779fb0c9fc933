// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// What inertial navigation in the local frame w must know of the Earth: how w turns, and gravity where the body is.
///
/// w is fixed to the Earth, so it turns with  Omega = R_we (0, 0, omega_e)  against inertial space. Let I be the inertial axes that
/// coincide with w at the start of an interval, K = [Omega]x, omega = |Omega|. After T seconds a vector of w reads C x_w in I, where
///
///     C  = Exp(Omega T)                 =  I + s K + c K^2           s = sin(omega T) / omega,  c = (1 - cos(omega T)) / omega^2
///     J1 = integral of C over [0, T]    =  T I + c K + e K^2         e = (T - s) / omega^2      = T^3/6  (1 - (omega T)^2 / 20 ...)
///     J2 = integral of J1 over [0, T]   =  T^2/2 I + e K + ...                                    T^4/24 K^2
///
/// Gravity g (gravitation plus centrifugal) changes by 3 um/s^2 per metre of height and turns by 1/R per metre of way. Around a reference
/// point
///
///     g_w(p) = g_w(p0) + G (p - p0)        G = -(g / r) (I - 3 n n'),   n = r / |r|,  r: from the Earth's centre
///
/// G is the gradient of the gravitation of a sphere: it leaves out the flattening (0.5 % of G) and the centrifugal part (5e-9 /s^2),
/// together 0.02 um/s^2 per metre from the reference point, and the curvature, 0.4 um/s^2 at 1 km. J1 and J2 are cut off at (omega T)^3 T /
/// 24: 2 um/s of gravity's 590 m/s in 60 s.
#pragma once

#include <Eigen/Core>

#include <concepts>

#include <searvins/geodesy/local_frame.hpp>
#include <searvins/math/so3.hpp>

namespace searvins::imu {

/// Gravity near a point, m/s^2 in axes of w: see the file comment.
template <class Scalar>
struct BasicGravityField {
  using Vector3 = Eigen::Matrix<Scalar, 3, 1>;
  using Matrix3 = Eigen::Matrix<Scalar, 3, 3>;

  Vector3 reference_w_m{Vector3::Zero()};
  Vector3 gravity_w_mps2{Vector3::Zero()};  ///< at the reference point
  Matrix3 gradient_w_ps2{Matrix3::Zero()};  ///< d gravity / d position, 1/s^2

  [[nodiscard]] Vector3 at(const Vector3& p_w_m) const { return gravity_w_mps2 + gradient_w_ps2 * (p_w_m - reference_w_m); }
};
using GravityField = BasicGravityField<double>;  ///< in double precision

/// How the Earth enters: whether w turns (a compile-time policy), how fast, and the gravity near a position; all in the model's Scalar.
template <class E>
concept EarthModel = std::copyable<E> && requires(const E& earth, const Eigen::Matrix<typename E::Scalar, 3, 1>& p_w_m) {
  { E::rotates } -> std::convertible_to<bool>;
  { earth.rate_w_radps() } -> std::convertible_to<Eigen::Matrix<typename E::Scalar, 3, 1>>;
  { earth.gravity_field(p_w_m) } -> std::same_as<BasicGravityField<typename E::Scalar>>;
};

/// The WGS-84 Earth seen from a local frame. Rotates = false switches off its rotation (and with it the Coriolis acceleration); gravity
/// stays that of the position.
template <bool Rotates, class S = double>
struct LocalEarth {
  using Scalar = S;
  using Vector3 = Eigen::Matrix<S, 3, 1>;
  using Matrix3 = Eigen::Matrix<S, 3, 3>;
  static constexpr bool rotates = Rotates;
  geodesy::BasicLocalFrame<S> frame{};

  /// Rotation of w against inertial space, rad/s in axes of w.
  [[nodiscard]] Vector3 rate_w_radps() const {
    if constexpr (Rotates) return geodesy::kEarthRateRadps * frame.R_ew.row(2).transpose();
    return Vector3::Zero();
  }
  /// Gravity at a position, m/s^2, both in w.
  [[nodiscard]] Vector3 gravity_w_mps2(const Vector3& p_w_m) const {
    return frame.R_ew.transpose() * geodesy::gravity_e_mps2<S>(frame.to_ecef(p_w_m));
  }
  /// Gravity and its gradient at a position. Costs a geodetic conversion: make it once an interval.
  [[nodiscard]] BasicGravityField<S> gravity_field(const Vector3& p_w_m) const {
    const Vector3 r_w_m = frame.R_ew.transpose() * frame.to_ecef(p_w_m), g = gravity_w_mps2(p_w_m);
    const S radius_m = r_w_m.norm();
    const Vector3 n = r_w_m / radius_m;
    return {p_w_m, g, -g.norm() / radius_m * (Matrix3::Identity() - 3.0 * n * n.transpose())};
  }
};

/// The default.
using RotatingEarth = LocalEarth<true>;
/// An Earth that stands still: for hardware that cannot tell, and to show what rotation is worth.
using FlatEarth = LocalEarth<false>;

/// Gravity alone, the same everywhere: a laboratory frame whose place on the Earth is unknown.
template <class S>
struct BasicConstantGravity {
  using Scalar = S;
  using Vector3 = Eigen::Matrix<S, 3, 1>;
  static constexpr bool rotates = false;
  Vector3 gravity_w_mps2{0, 0, -9.80665};

  [[nodiscard]] Vector3 rate_w_radps() const { return Vector3::Zero(); }
  [[nodiscard]] BasicGravityField<S> gravity_field(const Vector3& p_w_m) const {
    return {p_w_m, gravity_w_mps2, Eigen::Matrix<S, 3, 3>::Zero()};
  }
};
using ConstantGravity = BasicConstantGravity<double>;  ///< in double precision

static_assert(EarthModel<RotatingEarth> && EarthModel<FlatEarth> && EarthModel<ConstantGravity>);

/// The turn of w over an interval: C, K, J1, J2 of the file comment.
template <class Scalar>
struct BasicEarthTurn {
  using Vector3 = Eigen::Matrix<Scalar, 3, 1>;
  using Matrix3 = Eigen::Matrix<Scalar, 3, 3>;

  Matrix3 C{Matrix3::Identity()};
  Matrix3 K{Matrix3::Zero()};
  Matrix3 J1{Matrix3::Zero()};
  Matrix3 J2{Matrix3::Zero()};

  /// Over `duration_s` seconds at `rate_w_radps`.
  [[nodiscard]] static BasicEarthTurn over(const Vector3& rate_w_radps, Scalar duration_s) {
    const Scalar T = duration_s;
    const Matrix3 I = Matrix3::Identity(), K = so3::skew(rate_w_radps), K2 = K * K;
    return {so3::exp(Vector3{rate_w_radps * T}), K, T * I + T * T / 2 * K + T * T * T / 6 * K2,
            T * T / 2 * I + T * T * T / 6 * K + T * T * T * T / 24 * K2};
  }
  /// Without rotation.
  [[nodiscard]] static BasicEarthTurn none(Scalar duration_s) {
    BasicEarthTurn turn;
    turn.J1 = duration_s * Matrix3::Identity();
    turn.J2 = duration_s * duration_s / 2 * Matrix3::Identity();
    return turn;
  }
};
using EarthTurn = BasicEarthTurn<double>;  ///< in double precision

}  // namespace searvins::imu
