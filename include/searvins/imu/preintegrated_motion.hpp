// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// What an interval of inertial readings says about the motion between its ends, whatever the state at its start [Forster et al., TRO
/// 2017].
///
/// In axes of the body at the start, biases b held, no gravity (that is the factor's affair):
///
///     dR = prod Exp((w - b_g) h)        dv = integral of dR (a - b_a)        dp = integral of dv
///
/// Their errors are n = (phi, n_p, n_v), ordered as in the navigation state, with  dR_true = dR Exp(phi),  dp_true = dp + n_p,  dv_true =
/// dv + n_v. Moved biases enter to first order [Forster eq. (44)]; with d = b - bias:
///
///     dR(b) = dR Exp(d_R d_g)        dv(b) = dv + d_v/d_ba d_a + d_v/d_bg d_g        dp(b) likewise
///
/// Neglected in velocity: second order, |f| T (d_g T)^2 / 2 and |d_a| |d_g| T^2 / 2, that is 5 and 25 um/s after one second for 1e-3 rad/s,
/// 0.05 m/s^2.
#pragma once

#include <Eigen/Core>

#include <searvins/core/time.hpp>
#include <searvins/imu/navigation_state.hpp>
#include <searvins/math/so3.hpp>

namespace searvins::imu {

/// Biases of a unit, in axes of b: what a reading shows too much.
template <class S>
struct ImuBias {
  Eigen::Matrix<S, 3, 1> accel_b_mps2{Eigen::Matrix<S, 3, 1>::Zero()};
  Eigen::Matrix<S, 3, 1> gyro_b_radps{Eigen::Matrix<S, 3, 1>::Zero()};

  [[nodiscard]] bool finite() const { return accel_b_mps2.allFinite() && gyro_b_radps.allFinite(); }
  template <class T>
  [[nodiscard]] ImuBias<T> cast() const {
    return {accel_b_mps2.template cast<T>(), gyro_b_radps.template cast<T>()};
  }
};

/// The biases of a navigation state.
template <class S>
[[nodiscard]] inline ImuBias<S> bias_of(const BasicNavigationState<S>& x) {
  return {x.accel_bias_b_mps2, x.gyro_bias_b_radps};
}

/// See the file comment. Axes: the body at the start (dR maps the body at the end to it).
template <class S>
struct PreintegratedMotion {
  using Vector3 = Eigen::Matrix<S, 3, 1>;
  using Matrix3 = Eigen::Matrix<S, 3, 3>;
  using Matrix9 = Eigen::Matrix<S, 9, 9>;

  GpsTime start{}, end{};
  S duration_s{0};
  ImuBias<S> bias{};  ///< the biases it was integrated with
  Matrix3 dR{Matrix3::Identity()};
  Vector3 dp_m{Vector3::Zero()}, dv_mps{Vector3::Zero()};
  Matrix9 covariance{Matrix9::Zero()};  ///< of (phi, n_p, n_v); rad, m, m/s
  Matrix3 d_R_d_gyro_bias{Matrix3::Zero()};
  Matrix3 d_p_d_accel_bias{Matrix3::Zero()}, d_p_d_gyro_bias{Matrix3::Zero()};
  Matrix3 d_v_d_accel_bias{Matrix3::Zero()}, d_v_d_gyro_bias{Matrix3::Zero()};

  /// The motion under other biases, to first order.
  struct Corrected {
    Matrix3 dR;
    Vector3 dp_m, dv_mps;
    Vector3 turn_rad;  ///< d_R d_g: what dR was turned by
  };
  [[nodiscard]] Corrected corrected(const ImuBias<S>& b) const {
    const Vector3 da = b.accel_b_mps2 - bias.accel_b_mps2, dg = b.gyro_b_radps - bias.gyro_b_radps, turn = d_R_d_gyro_bias * dg;
    return {dR * so3::exp(turn), dp_m + d_p_d_accel_bias * da + d_p_d_gyro_bias * dg, dv_mps + d_v_d_accel_bias * da + d_v_d_gyro_bias * dg,
            turn};
  }

  template <class T>
  [[nodiscard]] PreintegratedMotion<T> cast() const {
    PreintegratedMotion<T> m;
    m.start = start, m.end = end, m.duration_s = static_cast<T>(duration_s), m.bias = bias.template cast<T>();
    m.dR = dR.template cast<T>(), m.dp_m = dp_m.template cast<T>(), m.dv_mps = dv_mps.template cast<T>();
    m.covariance = covariance.template cast<T>(), m.d_R_d_gyro_bias = d_R_d_gyro_bias.template cast<T>();
    m.d_p_d_accel_bias = d_p_d_accel_bias.template cast<T>(), m.d_p_d_gyro_bias = d_p_d_gyro_bias.template cast<T>();
    m.d_v_d_accel_bias = d_v_d_accel_bias.template cast<T>(), m.d_v_d_gyro_bias = d_v_d_gyro_bias.template cast<T>();
    return m;
  }
  [[nodiscard]] bool finite() const {
    return dR.allFinite() && dp_m.allFinite() && dv_mps.allFinite() && covariance.allFinite() && d_R_d_gyro_bias.allFinite() &&
           d_p_d_accel_bias.allFinite() && d_p_d_gyro_bias.allFinite() && d_v_d_accel_bias.allFinite() && d_v_d_gyro_bias.allFinite();
  }
};

}  // namespace searvins::imu
