// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The GNSS-only motion model: position, velocity and acceleration of the antenna, driven by white jerk.
///
/// Without an inertial sensor consecutive epochs are tied by what a vehicle can do. With jerk of power spectral density q per axis (m^2/s^5),
/// integrated over dt [Bar-Shalom, Li, Kirubarajan 2001, sec. 6.2.3]:
///
///     x+ = F x + w,    F = | 1 dt dt^2/2 |      cov(w) = q | dt^5/20 dt^4/8 dt^3/6 |      (per axis: position, velocity, acceleration)
///                          | 0 1  dt     |                 | .       dt^3/3 dt^2/2 |
///                          | 0 0  1      |                 | .       .      dt     |
///
/// Its whitening follows from the Cholesky factor of the matrix at dt = 1, because scaling the three rows by dt^(5/2), dt^(3/2), dt^(1/2) takes one
/// interval to any other: R(dt) = R(1) diag(dt^-5/2, dt^-3/2, dt^-1/2) / sqrt(q) with R(1)' R(1) the inverse of
/// [[1/20, 1/8, 1/6], [1/8, 1/3, 1/2], [1/6, 1/2, 1]], which is [[720, -360, 60], [-360, 192, -36], [60, -36, 9]].
#pragma once

#include <Eigen/Core>

#include <cmath>

#include <searvins/math/deferred.hpp>
#include <searvins/smoother/factor.hpp>
#include <searvins/smoother/variable.hpp>

namespace searvins::gnss {

/// Position, velocity and acceleration of the antenna in the local frame w. Tangent order: position, velocity, acceleration.
template <class S>
struct BasicPva {
  using Scalar = S;
  using Vector3 = Eigen::Matrix<Scalar, 3, 1>;
  using Step = Eigen::Matrix<Scalar, 9, 1>;
  static constexpr int dof = 9;
  static constexpr smoother::Role role = smoother::Role::state;
  static constexpr const char* name = "position-velocity-acceleration";
  static constexpr const char* axis_name(int i) {
    constexpr const char* names[] = {"east", "north", "up", "east velocity", "north velocity", "up velocity", "east acceleration", "north acceleration", "up acceleration"};
    return i >= 0 && i < 9 ? names[i] : "?";
  }

  Vector3 p_wa_m{Vector3::Zero()};       ///< antenna in w, m
  Vector3 v_wa_mps{Vector3::Zero()};     ///< its velocity relative to the Earth, in w, m/s
  Vector3 a_wa_mps2{Vector3::Zero()};    ///< its acceleration, in w, m/s^2

  [[nodiscard]] BasicPva retract(const Step& d) const {
    return {p_wa_m + d.template head<3>(), v_wa_mps + d.template segment<3>(3), a_wa_mps2 + d.template tail<3>()};
  }
  [[nodiscard]] Step local(const BasicPva& y) const {
    Step d;
    d << y.p_wa_m - p_wa_m, y.v_wa_mps - v_wa_mps, y.a_wa_mps2 - a_wa_mps2;
    return d;
  }
  /// A range bends by d^2 / (2 * 2e7 m): over one metre it is linear to 25 nm.
  [[nodiscard]] static Step linearisation_scale() { return Step::Ones(); }

  /// The state dt seconds later under constant acceleration.
  [[nodiscard]] BasicPva predict(Scalar dt_s) const {
    return {p_wa_m + dt_s * v_wa_mps + dt_s * dt_s / 2 * a_wa_mps2, v_wa_mps + dt_s * a_wa_mps2, a_wa_mps2};
  }
};
using Pva = BasicPva<double>;  ///< in double precision

/// Antenna position of a state in w, metres; optionally d p / d state.
template <class Scalar>
inline Eigen::Matrix<Scalar, 3, 1> antenna_position_w_m(const BasicPva<Scalar>& x, math::Matrix<Scalar, 3, 9>* jacobian = nullptr) {
  if (jacobian) {
    jacobian->setZero();
    jacobian->template leftCols<3>().setIdentity();
  }
  return x.p_wa_m;
}

/// Antenna velocity of a state in w, m/s; optionally d v / d state.
template <class Scalar>
inline Eigen::Matrix<Scalar, 3, 1> antenna_velocity_w_mps(const BasicPva<Scalar>& x, math::Matrix<Scalar, 3, 9>* jacobian = nullptr) {
  if (jacobian) {
    jacobian->setZero();
    jacobian->template middleCols<3>(3).setIdentity();
  }
  return x.v_wa_mps;
}

/// White jerk between two states dt > 0 apart.
template <class S>
struct BasicWhiteJerkFactor {
  using Scalar = S;
  using State = BasicPva<Scalar>;
  using Vector3 = Eigen::Matrix<Scalar, 3, 1>;
  using Matrix3 = Eigen::Matrix<Scalar, 3, 3>;
  static constexpr int max_rows = 9, max_keys = 2, max_columns = 18;
  static constexpr const char* name = "white jerk";
  smoother::Key<State> from{}, to{};
  Scalar dt_s{1};
  Scalar jerk_psd_m2ps5{1};  ///< horizontal and vertical alike

  [[nodiscard]] int rows() const { return 9; }
  template <class Visit>
  void for_each_key(Visit&& visit) const {
    visit(from), visit(to);
  }
  template <class Values>
  void evaluate(const Values& values, Scalar* e) const {
    const State& b = values(to);
    const State predicted = values(from).predict(dt_s);
    const Matrix3 R = whitening();
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3 r{b.p_wa_m[axis] - predicted.p_wa_m[axis], b.v_wa_mps[axis] - predicted.v_wa_mps[axis], b.a_wa_mps2[axis] - predicted.a_wa_mps2[axis]};
      Eigen::Map<Vector3>(e + 3 * axis).noalias() = R * r;
    }
  }
  template <class Values>
  void linearise(const Values& values, Scalar* e, smoother::JacobianRef<Scalar> J) const {
    evaluate(values, e);
    Matrix3 F;
    F << 1, dt_s, dt_s * dt_s / 2, 0, 1, dt_s, 0, 0, 1;
    const Matrix3 R = whitening(), RF = R * F;
    for (int axis = 0; axis < 3; ++axis)
      for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) {
          J(3 * axis + i, 3 * k + axis) = -RF(i, k);
          J(3 * axis + i, 9 + 3 * k + axis) = R(i, k);
        }
  }
  Scalar weigh(const Scalar* e, Scalar* w) const { return smoother::weigh_gaussian(e, 9, w); }

  /// R with R'R = cov(w)^-1 for one axis.
  [[nodiscard]] Matrix3 whitening() const {
    // Upper Cholesky factor of [[720, -360, 60], [-360, 192, -36], [60, -36, 9]].
    const Scalar a = std::sqrt(Scalar{720}), b = -360 / a, c = 60 / a, d = std::sqrt(192 - b * b), f = (-36 - b * c) / d, g = std::sqrt(9 - c * c - f * f);
    Matrix3 R;
    R << a, b, c, 0, d, f, 0, 0, g;
    const Scalar root = std::sqrt(dt_s), scale = 1 / std::sqrt(jerk_psd_m2ps5);
    R.col(0) *= scale / (dt_s * dt_s * root);
    R.col(1) *= scale / (dt_s * root);
    R.col(2) *= scale / root;
    return R;
  }
};
using WhiteJerkFactor = BasicWhiteJerkFactor<double>;  ///< in double precision

/// A Gaussian prior on a state, independent per group: the start of a trajectory.
template <class S>
struct BasicPvaPriorFactor {
  using Scalar = S;
  using State = BasicPva<Scalar>;
  static constexpr int max_rows = 9, max_keys = 1, max_columns = 9;
  static constexpr const char* name = "state prior";
  smoother::Key<State> state{};
  State mean{};
  Scalar sigma_position_m{100}, sigma_velocity_mps{50}, sigma_acceleration_mps2{5};

  [[nodiscard]] int rows() const { return 9; }
  template <class Visit>
  void for_each_key(Visit&& visit) const {
    visit(state);
  }
  template <class Values>
  void evaluate(const Values& values, Scalar* e) const {
    const typename State::Step d = mean.local(values(state));
    for (int i = 0; i < 9; ++i) e[i] = d[i] / sigma(i);
  }
  template <class Values>
  void linearise(const Values& values, Scalar* e, smoother::JacobianRef<Scalar> J) const {
    evaluate(values, e);
    for (int i = 0; i < 9; ++i) J(i, i) = 1 / sigma(i);
  }
  Scalar weigh(const Scalar* e, Scalar* w) const { return smoother::weigh_gaussian(e, 9, w); }

 private:
  [[nodiscard]] Scalar sigma(int i) const { return i < 3 ? sigma_position_m : i < 6 ? sigma_velocity_mps : sigma_acceleration_mps2; }
};
using PvaPriorFactor = BasicPvaPriorFactor<double>;  ///< in double precision

static_assert(smoother::Variable<Pva> && smoother::Factor<WhiteJerkFactor> && smoother::Factor<PvaPriorFactor>);

}  // namespace searvins::gnss
