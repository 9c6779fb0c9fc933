// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Dead reckoning: the state at the end of an interval, and its covariance, from the state at its start.
///
/// The predicted state is the one at which the motion rows of ImuFactor vanish (notation there), biases held:
///
///     R_j = C' R_i dR(b)
///     d   = C' (T v_i + J2 (g_i + G d/3) + R_i dp(b))                 three passes; each gains a factor |G| T^2, 1e-6 at 1 s
///     v_j = C' (v_i + J1 (g_i + G d/2) + R_i dv(b)) - K d
///
/// To first order, with the errors (phi, n_p, n_v) of the motion and its sensitivities D to the biases (G left out: 1e-6 T^2 of a position
/// error),
///
///     dtheta_j = dR' dtheta_i + D_R db_g + phi
///     dp_j     = dp_i + C' (T dv_i - R_i [dp]x dtheta_i + R_i (D_p db + n_p))
///     dv_j     =        C' (dv_i - R_i [dv]x dtheta_i + R_i (D_v db + n_v)) - K (dp_j - dp_i)
#pragma once

#include <Eigen/Core>

#include <searvins/core/status.hpp>
#include <searvins/imu/earth.hpp>
#include <searvins/imu/imu_sample.hpp>
#include <searvins/imu/navigation_state.hpp>
#include <searvins/imu/preintegrated_motion.hpp>
#include <searvins/math/so3.hpp>

namespace searvins::imu {

/// Covariance of a navigation state, in the order of its tangent vector.
template <class Scalar>
using BasicNavigationCovariance = Eigen::Matrix<Scalar, 15, 15>;
using NavigationCovariance = BasicNavigationCovariance<double>;  ///< in double precision

/// The state at the end of a motion. The motion's first-order bias correction is applied for the biases of `x`.
template <EarthModel Earth>
[[nodiscard]] BasicNavigationState<typename Earth::Scalar> predict(const BasicNavigationState<typename Earth::Scalar>& x,
                                                                   const PreintegratedMotion<typename Earth::Scalar>& motion,
                                                                   const Earth& earth) {
  using Scalar = typename Earth::Scalar;
  using Vector3 = Eigen::Matrix<Scalar, 3, 1>;
  using Turn = BasicEarthTurn<Scalar>;
  const Scalar T = motion.duration_s;
  const BasicGravityField<Scalar> gravity = earth.gravity_field(x.p_wb_m);
  Turn w = Turn::none(T);
  if constexpr (Earth::rotates) w = Turn::over(earth.rate_w_radps(), T);
  const auto m = motion.corrected(bias_of(x));
  const Vector3 g = gravity.gravity_w_mps2, way = T * x.v_wb_mps + x.R_wb * m.dp_m;
  Vector3 d = Vector3::Zero();
  for (int pass = 0; pass < 3; ++pass) d = w.C.transpose() * (way + w.J2 * (g + gravity.gradient_w_ps2 * d / 3));
  BasicNavigationState<Scalar> y = x;
  y.R_wb = w.C.transpose() * x.R_wb * m.dR;
  y.p_wb_m = x.p_wb_m + d;
  y.v_wb_mps = w.C.transpose() * (x.v_wb_mps + w.J1 * (g + gravity.gradient_w_ps2 * d / 2) + x.R_wb * m.dv_mps) - w.K * d;
  return y;
}

/// Covariance of the predicted state from that of `x` (both in the order of the state's axes, about their own states) and the motion's.
template <EarthModel Earth>
[[nodiscard]] BasicNavigationCovariance<typename Earth::Scalar> predict_covariance(
    const BasicNavigationState<typename Earth::Scalar>& x, const BasicNavigationCovariance<typename Earth::Scalar>& covariance,
    const PreintegratedMotion<typename Earth::Scalar>& motion, const ImuNoise& noise, const Earth& earth) {
  using Scalar = typename Earth::Scalar;
  using State = BasicNavigationState<Scalar>;
  using Covariance = BasicNavigationCovariance<Scalar>;
  using Matrix3 = Eigen::Matrix<Scalar, 3, 3>;
  using Matrix9 = Eigen::Matrix<Scalar, 9, 9>;
  using Turn = BasicEarthTurn<Scalar>;
  constexpr int t = State::attitude, p = State::position, v = State::velocity, ba = State::accel_bias, bg = State::gyro_bias;
  const Scalar T = motion.duration_s;
  Turn w = Turn::none(T);
  if constexpr (Earth::rotates) w = Turn::over(earth.rate_w_radps(), T);
  const auto m = motion.corrected(bias_of(x));
  const Matrix3 Ct = w.C.transpose(), CtR = Ct * x.R_wb;

  Covariance F = Covariance::Identity();
  F.template block<3, 3>(t, t) = m.dR.transpose();
  F.template block<3, 3>(t, bg) = so3::right_jacobian(m.turn_rad) * motion.d_R_d_gyro_bias;
  F.template block<3, 3>(p, t) = -CtR * so3::skew(m.dp_m);
  F.template block<3, 3>(p, v) = T * Ct;
  F.template block<3, 3>(p, ba) = CtR * motion.d_p_d_accel_bias;
  F.template block<3, 3>(p, bg) = CtR * motion.d_p_d_gyro_bias;
  F.template block<3, 3>(v, t) = -CtR * so3::skew(m.dv_mps) - w.K * F.template block<3, 3>(p, t);
  F.template block<3, 3>(v, v) = Ct - w.K * F.template block<3, 3>(p, v);
  F.template block<3, 3>(v, ba) = CtR * motion.d_v_d_accel_bias - w.K * F.template block<3, 3>(p, ba);
  F.template block<3, 3>(v, bg) = CtR * motion.d_v_d_gyro_bias - w.K * F.template block<3, 3>(p, bg);

  // The motion's own errors, turned into axes of w at the end.
  Matrix9 N = Matrix9::Identity();
  N.template block<3, 3>(p, p) = CtR;
  N.template block<3, 3>(v, p) = -w.K * CtR;
  N.template block<3, 3>(v, v) = CtR;

  const Covariance FP = F.lazyProduct(covariance);
  Covariance Q = FP.lazyProduct(F.transpose());
  const Matrix9 NQ = N.lazyProduct(motion.covariance);
  Q.template topLeftCorner<9, 9>() += NQ.lazyProduct(N.transpose());
  const double accel_walk = noise.accel_bias_walk_mps3_sqrt_hz, gyro_walk = noise.gyro_bias_walk_radps2_sqrt_hz;
  Q.diagonal().template segment<3>(ba).array() += accel_walk * accel_walk * T;
  Q.diagonal().template segment<3>(bg).array() += gyro_walk * gyro_walk * T;
  for (int j = 0; j < 15; ++j)
    for (int i = 0; i < j; ++i) Q(i, j) = Q(j, i) = (Q(i, j) + Q(j, i)) / 2;
  return Q;
}

}  // namespace searvins::imu
