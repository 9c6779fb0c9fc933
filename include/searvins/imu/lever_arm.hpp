// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Where the GNSS antenna of a body is, and how fast it moves [paper eqs. (antenna-position), (antenna-velocity)].
///
/// With the lever arm l from the inertial unit to the phase centre, in b:
///
///     p_wa = p_wb + R_wb l
///     v_wa = v_wb + R_wb (w x l)          w = gyro - b_g - u,   u = R_wb' Omega_w        rate of b relative to the Earth
///
/// Under R_wb Exp(d), u becomes u + [u]x d, so w loses [u]x d, and x -> R_wb x gains -R_wb [x]x d:
///
///     d p_wa / d d = -R_wb [l]x                                       d p_wa / d p_wb = I
///     d v_wa / d d = -R_wb [w x l]x + R_wb [l]x [u]x                  d v_wa / d v_wb = I        d v_wa / d b_g = R_wb [l]x
#pragma once

#include <Eigen/Core>

#include <searvins/imu/navigation_state.hpp>
#include <searvins/math/so3.hpp>

namespace searvins::imu {

/// See the file comment. The antenna model of gnss/gnss_factors.hpp for navigation states.
template <class Scalar>
struct BasicLeverArm {
  using Vector3 = Eigen::Matrix<Scalar, 3, 1>;
  using Matrix3 = Eigen::Matrix<Scalar, 3, 3>;
  using State = BasicNavigationState<Scalar>;
  using Jacobian = Eigen::Matrix<Scalar, 3, State::dof>;
  Vector3 lever_arm_b_m{Vector3::Zero()};       ///< l
  Vector3 gyro_b_radps{Vector3::Zero()};        ///< reading at the state's time
  Vector3 earth_rate_w_radps{Vector3::Zero()};  ///< Omega_w

  /// Antenna in w, m; optionally its Jacobian.
  [[nodiscard]] Vector3 position_w_m(const State& x, Jacobian* d_state = nullptr) const {
    if (d_state) {
      d_state->setZero();
      d_state->template middleCols<3>(State::attitude) = -x.R_wb * so3::skew(lever_arm_b_m);
      d_state->template middleCols<3>(State::position).setIdentity();
    }
    return x.p_wb_m + x.R_wb * lever_arm_b_m;
  }

  /// Velocity of the antenna relative to the Earth, in w, m/s; optionally its Jacobian.
  [[nodiscard]] Vector3 velocity_w_mps(const State& x, Jacobian* d_state = nullptr) const {
    const Vector3 u = x.R_wb.transpose() * earth_rate_w_radps;
    const Vector3 swing = (gyro_b_radps - x.gyro_bias_b_radps - u).cross(lever_arm_b_m);
    if (d_state) {
      const Matrix3 arm = so3::skew(lever_arm_b_m);
      d_state->setZero();
      d_state->template middleCols<3>(State::attitude) = x.R_wb * (arm * so3::skew(u) - so3::skew(swing));
      d_state->template middleCols<3>(State::velocity).setIdentity();
      d_state->template middleCols<3>(State::gyro_bias) = x.R_wb * arm;
    }
    return x.v_wb_mps + x.R_wb * swing;
  }
};
using LeverArm = BasicLeverArm<double>;  ///< in double precision

}  // namespace searvins::imu
