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
struct LeverArm {
  using Jacobian = Eigen::Matrix<double, 3, NavigationState::dof>;
  Eigen::Vector3d lever_arm_b_m{Eigen::Vector3d::Zero()};      ///< l
  Eigen::Vector3d gyro_b_radps{Eigen::Vector3d::Zero()};       ///< reading at the state's time
  Eigen::Vector3d earth_rate_w_radps{Eigen::Vector3d::Zero()};  ///< Omega_w

  /// Antenna in w, m; optionally its Jacobian.
  [[nodiscard]] Eigen::Vector3d position_w_m(const NavigationState& x, Jacobian* d_state = nullptr) const {
    if (d_state) {
      d_state->setZero();
      d_state->middleCols<3>(NavigationState::attitude) = -x.R_wb * so3::skew(lever_arm_b_m);
      d_state->middleCols<3>(NavigationState::position).setIdentity();
    }
    return x.p_wb_m + x.R_wb * lever_arm_b_m;
  }

  /// Velocity of the antenna relative to the Earth, in w, m/s; optionally its Jacobian.
  [[nodiscard]] Eigen::Vector3d velocity_w_mps(const NavigationState& x, Jacobian* d_state = nullptr) const {
    const Eigen::Vector3d u = x.R_wb.transpose() * earth_rate_w_radps;
    const Eigen::Vector3d swing = (gyro_b_radps - x.gyro_bias_b_radps - u).cross(lever_arm_b_m);
    if (d_state) {
      const Eigen::Matrix3d arm = so3::skew(lever_arm_b_m);
      d_state->setZero();
      d_state->middleCols<3>(NavigationState::attitude) = x.R_wb * (arm * so3::skew(u) - so3::skew(swing));
      d_state->middleCols<3>(NavigationState::velocity).setIdentity();
      d_state->middleCols<3>(NavigationState::gyro_bias) = x.R_wb * arm;
    }
    return x.v_wb_mps + x.R_wb * swing;
  }
};

}  // namespace searvins::imu
