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

#include <searvins/smoother/factor.hpp>
#include <searvins/smoother/variable.hpp>

namespace searvins::gnss {

/// Position, velocity and acceleration of the antenna in the local frame w. Tangent order: position, velocity, acceleration.
struct Pva {
  using Scalar = double;
  using Step = Eigen::Matrix<double, 9, 1>;
  static constexpr int dof = 9;
  static constexpr smoother::Role role = smoother::Role::state;
  static constexpr const char* name = "position-velocity-acceleration";
  static constexpr const char* axis_name(int i) {
    constexpr const char* names[] = {"east", "north", "up", "east velocity", "north velocity", "up velocity", "east acceleration", "north acceleration", "up acceleration"};
    return i >= 0 && i < 9 ? names[i] : "?";
  }

  Eigen::Vector3d p_wa_m{Eigen::Vector3d::Zero()};       ///< antenna in w, m
  Eigen::Vector3d v_wa_mps{Eigen::Vector3d::Zero()};     ///< its velocity relative to the Earth, in w, m/s
  Eigen::Vector3d a_wa_mps2{Eigen::Vector3d::Zero()};    ///< its acceleration, in w, m/s^2

  [[nodiscard]] Pva retract(const Step& d) const { return {p_wa_m + d.head<3>(), v_wa_mps + d.segment<3>(3), a_wa_mps2 + d.tail<3>()}; }
  [[nodiscard]] Step local(const Pva& y) const {
    Step d;
    d << y.p_wa_m - p_wa_m, y.v_wa_mps - v_wa_mps, y.a_wa_mps2 - a_wa_mps2;
    return d;
  }
  /// A range bends by d^2 / (2 * 2e7 m): over one metre it is linear to 25 nm.
  [[nodiscard]] static Step linearisation_scale() { return Step::Ones(); }

  /// The state dt seconds later under constant acceleration.
  [[nodiscard]] Pva predict(double dt_s) const { return {p_wa_m + dt_s * v_wa_mps + dt_s * dt_s / 2 * a_wa_mps2, v_wa_mps + dt_s * a_wa_mps2, a_wa_mps2}; }
};

/// Antenna position of a state in w, metres; optionally d p / d state.
inline Eigen::Vector3d antenna_position_w_m(const Pva& x, Eigen::Matrix<double, 3, 9>* jacobian = nullptr) {
  if (jacobian) {
    jacobian->setZero();
    jacobian->leftCols<3>().setIdentity();
  }
  return x.p_wa_m;
}

/// Antenna velocity of a state in w, m/s; optionally d v / d state.
inline Eigen::Vector3d antenna_velocity_w_mps(const Pva& x, Eigen::Matrix<double, 3, 9>* jacobian = nullptr) {
  if (jacobian) {
    jacobian->setZero();
    jacobian->middleCols<3>(3).setIdentity();
  }
  return x.v_wa_mps;
}

/// White jerk between two states dt > 0 apart.
struct WhiteJerkFactor {
  using Scalar = double;
  static constexpr int max_rows = 9, max_keys = 2, max_columns = 18;
  static constexpr const char* name = "white jerk";
  smoother::Key<Pva> from{}, to{};
  double dt_s{1};
  double jerk_psd_m2ps5{1};  ///< horizontal and vertical alike

  [[nodiscard]] int rows() const { return 9; }
  template <class Visit>
  void for_each_key(Visit&& visit) const {
    visit(from), visit(to);
  }
  template <class Values>
  void evaluate(const Values& values, double* e) const {
    const Pva& b = values(to);
    const Pva predicted = values(from).predict(dt_s);
    const Eigen::Matrix3d R = whitening();
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d r{b.p_wa_m[axis] - predicted.p_wa_m[axis], b.v_wa_mps[axis] - predicted.v_wa_mps[axis], b.a_wa_mps2[axis] - predicted.a_wa_mps2[axis]};
      Eigen::Map<Eigen::Vector3d>(e + 3 * axis).noalias() = R * r;
    }
  }
  template <class Values>
  void linearise(const Values& values, double* e, smoother::JacobianRef<double> J) const {
    evaluate(values, e);
    Eigen::Matrix3d F;
    F << 1, dt_s, dt_s * dt_s / 2, 0, 1, dt_s, 0, 0, 1;
    const Eigen::Matrix3d R = whitening(), RF = R * F;
    for (int axis = 0; axis < 3; ++axis)
      for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) {
          J(3 * axis + i, 3 * k + axis) = -RF(i, k);
          J(3 * axis + i, 9 + 3 * k + axis) = R(i, k);
        }
  }
  double weigh(const double* e, double* w) const { return smoother::weigh_gaussian(e, 9, w); }

  /// R with R'R = cov(w)^-1 for one axis.
  [[nodiscard]] Eigen::Matrix3d whitening() const {
    // Upper Cholesky factor of [[720, -360, 60], [-360, 192, -36], [60, -36, 9]].
    const double a = std::sqrt(720.0), b = -360.0 / a, c = 60.0 / a, d = std::sqrt(192.0 - b * b), f = (-36.0 - b * c) / d, g = std::sqrt(9.0 - c * c - f * f);
    Eigen::Matrix3d R;
    R << a, b, c, 0, d, f, 0, 0, g;
    const double root = std::sqrt(dt_s), scale = 1.0 / std::sqrt(jerk_psd_m2ps5);
    R.col(0) *= scale / (dt_s * dt_s * root);
    R.col(1) *= scale / (dt_s * root);
    R.col(2) *= scale / root;
    return R;
  }
};

/// A Gaussian prior on a state, independent per group: the start of a trajectory.
struct PvaPriorFactor {
  using Scalar = double;
  static constexpr int max_rows = 9, max_keys = 1, max_columns = 9;
  static constexpr const char* name = "state prior";
  smoother::Key<Pva> state{};
  Pva mean{};
  double sigma_position_m{100}, sigma_velocity_mps{50}, sigma_acceleration_mps2{5};

  [[nodiscard]] int rows() const { return 9; }
  template <class Visit>
  void for_each_key(Visit&& visit) const {
    visit(state);
  }
  template <class Values>
  void evaluate(const Values& values, double* e) const {
    const Pva::Step d = mean.local(values(state));
    for (int i = 0; i < 9; ++i) e[i] = d[i] / sigma(i);
  }
  template <class Values>
  void linearise(const Values& values, double* e, smoother::JacobianRef<double> J) const {
    evaluate(values, e);
    for (int i = 0; i < 9; ++i) J(i, i) = 1.0 / sigma(i);
  }
  double weigh(const double* e, double* w) const { return smoother::weigh_gaussian(e, 9, w); }

 private:
  [[nodiscard]] double sigma(int i) const { return i < 3 ? sigma_position_m : i < 6 ? sigma_velocity_mps : sigma_acceleration_mps2; }
};

static_assert(smoother::Variable<Pva> && smoother::Factor<WhiteJerkFactor> && smoother::Factor<PvaPriorFactor>);

}  // namespace searvins::gnss
