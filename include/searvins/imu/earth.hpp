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
struct GravityField {
  Eigen::Vector3d reference_w_m{Eigen::Vector3d::Zero()};
  Eigen::Vector3d gravity_w_mps2{Eigen::Vector3d::Zero()};  ///< at the reference point
  Eigen::Matrix3d gradient_w_ps2{Eigen::Matrix3d::Zero()};  ///< d gravity / d position, 1/s^2

  [[nodiscard]] Eigen::Vector3d at(const Eigen::Vector3d& p_w_m) const { return gravity_w_mps2 + gradient_w_ps2 * (p_w_m - reference_w_m); }
};

/// How the Earth enters: whether w turns (a compile-time policy), how fast, and the gravity near a position.
template <class E>
concept EarthModel = std::copyable<E> && requires(const E& earth, const Eigen::Vector3d& p_w_m) {
  { E::rotates } -> std::convertible_to<bool>;
  { earth.rate_w_radps() } -> std::convertible_to<Eigen::Vector3d>;
  { earth.gravity_field(p_w_m) } -> std::same_as<GravityField>;
};

/// The WGS-84 Earth seen from a local frame. Rotates = false switches off its rotation (and with it the Coriolis acceleration); gravity
/// stays that of the position.
template <bool Rotates>
struct LocalEarth {
  static constexpr bool rotates = Rotates;
  geodesy::LocalFrame frame{};

  /// Rotation of w against inertial space, rad/s in axes of w.
  [[nodiscard]] Eigen::Vector3d rate_w_radps() const {
    if constexpr (Rotates) return geodesy::kEarthRateRadps * frame.R_ew.row(2).transpose();
    return Eigen::Vector3d::Zero();
  }
  /// Gravity at a position, m/s^2, both in w.
  [[nodiscard]] Eigen::Vector3d gravity_w_mps2(const Eigen::Vector3d& p_w_m) const {
    return frame.R_ew.transpose() * geodesy::gravity_e_mps2(frame.to_ecef(p_w_m));
  }
  /// Gravity and its gradient at a position. Costs a geodetic conversion: make it once an interval.
  [[nodiscard]] GravityField gravity_field(const Eigen::Vector3d& p_w_m) const {
    const Eigen::Vector3d r_w_m = frame.R_ew.transpose() * frame.to_ecef(p_w_m), g = gravity_w_mps2(p_w_m);
    const double radius_m = r_w_m.norm();
    const Eigen::Vector3d n = r_w_m / radius_m;
    return {p_w_m, g, -g.norm() / radius_m * (Eigen::Matrix3d::Identity() - 3.0 * n * n.transpose())};
  }
};

/// The default.
using RotatingEarth = LocalEarth<true>;
/// An Earth that stands still: for hardware that cannot tell, and to show what rotation is worth.
using FlatEarth = LocalEarth<false>;

/// Gravity alone, the same everywhere: a laboratory frame whose place on the Earth is unknown.
struct ConstantGravity {
  static constexpr bool rotates = false;
  Eigen::Vector3d gravity_w_mps2{0, 0, -9.80665};

  [[nodiscard]] Eigen::Vector3d rate_w_radps() const { return Eigen::Vector3d::Zero(); }
  [[nodiscard]] GravityField gravity_field(const Eigen::Vector3d& p_w_m) const { return {p_w_m, gravity_w_mps2, Eigen::Matrix3d::Zero()}; }
};

static_assert(EarthModel<RotatingEarth> && EarthModel<FlatEarth> && EarthModel<ConstantGravity>);

/// The turn of w over an interval: C, K, J1, J2 of the file comment.
struct EarthTurn {
  Eigen::Matrix3d C{Eigen::Matrix3d::Identity()};
  Eigen::Matrix3d K{Eigen::Matrix3d::Zero()};
  Eigen::Matrix3d J1{Eigen::Matrix3d::Zero()};
  Eigen::Matrix3d J2{Eigen::Matrix3d::Zero()};

  /// Over `duration_s` seconds at `rate_w_radps`.
  [[nodiscard]] static EarthTurn over(const Eigen::Vector3d& rate_w_radps, double duration_s) {
    const double T = duration_s;
    const Eigen::Matrix3d I = Eigen::Matrix3d::Identity(), K = so3::skew(rate_w_radps), K2 = K * K;
    return {so3::exp(Eigen::Vector3d{rate_w_radps * T}), K, T * I + T * T / 2 * K + T * T * T / 6 * K2,
            T * T / 2 * I + T * T * T / 6 * K + T * T * T * T / 24 * K2};
  }
  /// Without rotation.
  [[nodiscard]] static EarthTurn none(double duration_s) {
    EarthTurn turn;
    turn.J1 = duration_s * Eigen::Matrix3d::Identity();
    turn.J2 = duration_s * duration_s / 2 * Eigen::Matrix3d::Identity();
    return turn;
  }
};

}  // namespace searvins::imu
