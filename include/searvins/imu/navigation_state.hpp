// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The navigation state: attitude, position and velocity of the body, and the biases of its inertial unit [paper eq. (navigation-state)].
///
///     x = (R_wb, p_wb, v_wb, b_a, b_g)        tangent: (dtheta, dp, dv, db_a, db_g)
///     R_wb (+) dtheta = R_wb Exp(dtheta)      everything else adds, position and velocity in axes of w
///
/// w is the Earth-fixed local frame (geodesy/local_frame.hpp), velocity is relative to the Earth.
#pragma once

#include <Eigen/Core>

#include <searvins/math/so3.hpp>
#include <searvins/smoother/variable.hpp>

namespace searvins::imu {

/// See the file comment.
template <class S>
struct BasicNavigationState {
  using Scalar = S;
  using Vector3 = Eigen::Matrix<S, 3, 1>;
  using Matrix3 = Eigen::Matrix<S, 3, 3>;
  using Step = Eigen::Matrix<S, 15, 1>;
  static constexpr int dof = 15;
  static constexpr smoother::Role role = smoother::Role::state;
  static constexpr const char* name = "navigation state";
  static constexpr const char* axis_name(int i) {
    constexpr const char* names[] = {"attitude x",   "attitude y",   "attitude z",   "east",        "north",       "up",         "east velocity", "north velocity",
                                     "up velocity",  "accel bias x", "accel bias y", "accel bias z", "gyro bias x", "gyro bias y", "gyro bias z"};
    return i >= 0 && i < 15 ? names[i] : "?";
  }
  /// First axis of each part in the tangent vector.
  enum Axis : int { attitude = 0, position = 3, velocity = 6, accel_bias = 9, gyro_bias = 12 };

  Matrix3 R_wb{Matrix3::Identity()};
  Vector3 p_wb_m{Vector3::Zero()};
  Vector3 v_wb_mps{Vector3::Zero()};
  Vector3 accel_bias_b_mps2{Vector3::Zero()};
  Vector3 gyro_bias_b_radps{Vector3::Zero()};

  [[nodiscard]] BasicNavigationState retract(const Step& d) const {
    BasicNavigationState y;
    y.R_wb = R_wb * so3::exp(d.template segment<3>(attitude));
    y.p_wb_m = p_wb_m + d.template segment<3>(position);
    y.v_wb_mps = v_wb_mps + d.template segment<3>(velocity);
    y.accel_bias_b_mps2 = accel_bias_b_mps2 + d.template segment<3>(accel_bias);
    y.gyro_bias_b_radps = gyro_bias_b_radps + d.template segment<3>(gyro_bias);
    return y;
  }
  [[nodiscard]] Step local(const BasicNavigationState& y) const {
    Step d;
    d.template segment<3>(attitude) = so3::log(R_wb.transpose() * y.R_wb);
    d.template segment<3>(position) = y.p_wb_m - p_wb_m;
    d.template segment<3>(velocity) = y.v_wb_mps - v_wb_mps;
    d.template segment<3>(accel_bias) = y.accel_bias_b_mps2 - accel_bias_b_mps2;
    d.template segment<3>(gyro_bias) = y.gyro_bias_b_radps - gyro_bias_b_radps;
    return d;
  }
  /// How far each part may move before its factors bend noticeably: 10 mrad of attitude turn 10 m/s^2 by 0.5 mm/s^2 in second order.
  [[nodiscard]] static Step linearisation_scale() {
    Step s;
    s << Vector3::Constant(1e-2), Vector3::Ones(), Vector3::Ones(), Vector3::Constant(0.1), Vector3::Constant(1e-2);
    return s;
  }
};
using NavigationState = BasicNavigationState<double>;  ///< in double precision

static_assert(smoother::Variable<NavigationState>);

}  // namespace searvins::imu
