// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// What a vehicle at rest, and one on wheels, says about its state.
///
///     zero velocity [paper eq. (vision-stationary-factors)]     r = v_wb
///     zero angular rate                                         r = b_g + R_bw Omega_w - mean gyro       the gyroscope sees the Earth turn
///     non-holonomic, at the point l of the body                 r = (x, z) of R_vb (R_bw v_wb + w_bw x l)
///
/// with w_bw = gyro - b_g - R_bw Omega_w the rate relative to the Earth. R_wb Exp(d) gives R_bw x -> R_bw x + [R_bw x]x d, hence
///
///     d r_rate / d d = [R_bw Omega_w]x          d r_rate / d b_g = I
///     d c / d d      = [R_bw v]x + [l]x [R_bw Omega_w]x          d c / d v = R_bw          d c / d b_g = [l]x       c = R_bw v + w x l
///
/// A wheeled vehicle moves along its forward axis at the axle that does not steer: l leads there, R_vb turns the body into the vehicle's axes. It does
/// slip: centimetres per second in a turn, so the factor is opt-in and its sigma generous.
#pragma once

#include <Eigen/Core>

#include <searvins/imu/navigation_state.hpp>
#include <searvins/math/so3.hpp>
#include <searvins/smoother/factor.hpp>

namespace searvins::stationary {

/// The body does not move relative to the Earth.
template <class S>
struct BasicZeroVelocityFactor {
  using Scalar = S;
  using Vector3 = Eigen::Matrix<S, 3, 1>;
  static constexpr int max_rows = 3, max_keys = 1, max_columns = 15;
  static constexpr const char* name = "zero velocity";
  smoother::Key<imu::NavigationState> state{};
  Scalar sigma_mps{0.03};

  [[nodiscard]] int rows() const { return 3; }
  template <class Visit>
  void for_each_key(Visit&& visit) const {
    visit(state);
  }
  template <class Values>
  void evaluate(const Values& values, Scalar* e) const {
    Eigen::Map<Vector3>{e} = values(state).v_wb_mps / sigma_mps;
  }
  template <class Values>
  void linearise(const Values& values, Scalar* e, smoother::JacobianRef<Scalar> J) const {
    evaluate(values, e);
    for (int i = 0; i < 3; ++i) J(i, imu::NavigationState::velocity + i) = 1.0 / sigma_mps;
  }
  Scalar weigh(const Scalar* e, Scalar* w) const { return smoother::weigh_gaussian(e, 3, w); }
};
using ZeroVelocityFactor = BasicZeroVelocityFactor<double>;  ///< in double precision

/// The body does not turn relative to the Earth: the mean of the gyroscope over an interval around the state is its bias and the Earth.
template <class S>
struct BasicZeroAngularRateFactor {
  using Scalar = S;
  using Vector3 = Eigen::Matrix<S, 3, 1>;
  using Matrix3 = Eigen::Matrix<S, 3, 3>;
  static constexpr int max_rows = 3, max_keys = 1, max_columns = 15;
  static constexpr const char* name = "zero angular rate";
  smoother::Key<imu::NavigationState> state{};
  Vector3 mean_gyro_b_radps{Vector3::Zero()};
  Vector3 earth_rate_w_radps{Vector3::Zero()};
  Scalar sigma_radps{1e-3};  ///< of the mean: density / sqrt(duration), and what an idling engine adds

  [[nodiscard]] int rows() const { return 3; }
  template <class Visit>
  void for_each_key(Visit&& visit) const {
    visit(state);
  }
  template <class Values>
  void evaluate(const Values& values, Scalar* e) const {
    const auto& x = values(state);
    Eigen::Map<Vector3>{e} = (x.gyro_bias_b_radps + x.R_wb.transpose() * earth_rate_w_radps - mean_gyro_b_radps) / sigma_radps;
  }
  template <class Values>
  void linearise(const Values& values, Scalar* e, smoother::JacobianRef<Scalar> J) const {
    evaluate(values, e);
    const Vector3 earth_b = values(state).R_wb.transpose() * earth_rate_w_radps;
    J.template block<3, 3>(0, imu::NavigationState::attitude) = so3::skew(earth_b) / sigma_radps;
    J.template block<3, 3>(0, imu::NavigationState::gyro_bias) = Matrix3::Identity() / sigma_radps;
  }
  Scalar weigh(const Scalar* e, Scalar* w) const { return smoother::weigh_gaussian(e, 3, w); }
};
using ZeroAngularRateFactor = BasicZeroAngularRateFactor<double>;  ///< in double precision

/// The vehicle neither slides sideways nor lifts off.
template <class S>
struct BasicNonHolonomicFactor {
  using Scalar = S;
  using Vector3 = Eigen::Matrix<S, 3, 1>;
  using Matrix3 = Eigen::Matrix<S, 3, 3>;
  static constexpr int max_rows = 2, max_keys = 1, max_columns = 15;
  static constexpr const char* name = "non-holonomic";
  smoother::Key<imu::NavigationState> state{};
  Vector3 gyro_b_radps{Vector3::Zero()};  ///< reading at the state's time
  Vector3 earth_rate_w_radps{Vector3::Zero()};
  Vector3 point_b_m{Vector3::Zero()};  ///< l: from the unit to the middle of the rear axle
  Matrix3 R_vb{Matrix3::Identity()};   ///< vehicle axes (right, forward, up) from body axes
  Scalar sigma_lateral_mps{0.1}, sigma_vertical_mps{0.1};

  [[nodiscard]] int rows() const { return 2; }
  template <class Visit>
  void for_each_key(Visit&& visit) const {
    visit(state);
  }
  template <class Values>
  void evaluate(const Values& values, Scalar* e) const {
    const auto& x = values(state);
    const Vector3 rate_b = gyro_b_radps - x.gyro_bias_b_radps - x.R_wb.transpose() * earth_rate_w_radps;
    const Vector3 v_v = R_vb * (x.R_wb.transpose() * x.v_wb_mps + rate_b.cross(point_b_m));
    e[0] = v_v.x() / sigma_lateral_mps;
    e[1] = v_v.z() / sigma_vertical_mps;
  }
  template <class Values>
  void linearise(const Values& values, Scalar* e, smoother::JacobianRef<Scalar> J) const {
    evaluate(values, e);
    const auto& x = values(state);
    const Matrix3 R_bw = x.R_wb.transpose(), L = so3::skew(point_b_m);
    const Matrix3 by_attitude = R_vb * (so3::skew(R_bw * x.v_wb_mps) + L * so3::skew(R_bw * earth_rate_w_radps));
    const Matrix3 by_velocity = R_vb * R_bw, by_bias = R_vb * L;
    for (int row = 0; row < 2; ++row) {
      const Scalar sigma = row == 0 ? sigma_lateral_mps : sigma_vertical_mps;
      for (int i = 0; i < 3; ++i) {
        J(row, imu::NavigationState::attitude + i) = by_attitude(2 * row, i) / sigma;
        J(row, imu::NavigationState::velocity + i) = by_velocity(2 * row, i) / sigma;
        J(row, imu::NavigationState::gyro_bias + i) = by_bias(2 * row, i) / sigma;
      }
    }
  }
  Scalar weigh(const Scalar* e, Scalar* w) const { return smoother::weigh_gaussian(e, 2, w); }
};
using NonHolonomicFactor = BasicNonHolonomicFactor<double>;  ///< in double precision

static_assert(smoother::Factor<ZeroVelocityFactor> && smoother::Factor<ZeroAngularRateFactor> && smoother::Factor<NonHolonomicFactor>);

}  // namespace searvins::stationary
