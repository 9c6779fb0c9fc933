// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The inertial factor between two navigation states, on a rotating Earth [Forster et al., TRO 2017, eqs. (36)-(37); paper,
/// preintegration].
///
/// Equations of motion in inertial axes I that coincide with w at the start (earth.hpp: C, K, J1, J2; r from the Earth's centre,
/// gravitation gamma):
///
///     x_I = C x_w          d/dt (C R_wb) = C R_wb [gyro]x          d^2/dt^2 (C r) = C R_wb f + C gamma          r = r_0 + p
///
/// The velocity in I is d/dt (C r) = C (v + K r), and gamma = g + K^2 r, since gravity g = gamma - Omega x (Omega x r). With d = p_j - p_i
/// integration gives
///
///     C R_j            = R_i dR
///     C (v_j + K r_j)  = v_i + K r_i + int C gamma + R_i dv
///     C r_j            = r_i + T (v_i + K r_i) + int int C gamma + R_i dp
///
/// Along the path gamma = g(p_i) + K^2 r_i + G (p - p_i), G the gradient of gravitation. The terms in r_i cancel exactly, because K^3 =
/// -omega^2 K makes int C K^2 r_i equal C K r_i - K r_i, and the double integral C r_i - r_i - T K r_i. There remains, with p - p_i = d t/T
/// inside G,
///
///     r_theta = Log(dR(b)' R_i' C R_j)
///     r_p     = R_i' (C d - T v_i - J2 (g_i + G d/3)) - dp(b)
///     r_v     = R_i' (C v_j + K C d - v_i - J1 (g_i + G d/2)) - dv(b)
///
/// where C v_j + K C d is the Coriolis acceleration -2 Omega x v once it is integrated: T K v from either term. With C = I, K = G = 0 this
/// is [Forster (37)]. Neglected: how the path departs from the chord d t/T within G, |G| a T^3/12, 0.6 um/s for a = 5 m/s^2 over T = 1 s (0
/// at constant velocity), and the error of G itself (earth.hpp), 0.5 % of 1.5e-6 x 30 m / 2: 0.1 um/s and 0.1 um over 1 s at 30 m/s.
///
/// Jacobians, X = dR(b)' R_i' C R_j, Jr the right Jacobian, D = d dR / d b_g:
///
///     r_theta:  theta_i  -Jr^-1(r) R_j' C' R_i       theta_j  Jr^-1(r)        b_g,i  -Jr^-1(r) X' Jr(D d_g) D
///     r_p:      theta_i  [R_i' y_p]x                 p_i  -R_i'(C + 2/3 J2 G)    p_j  R_i'(C - J2 G/3)    v_i  -T R_i'     b_i  -d_p/db
///     r_v:      theta_i  [R_i' y_v]x                 p_i  -R_i'(K C + J1 G/2)    p_j  R_i'(K C - J1 G/2)  v_i  -R_i'       b_i  -d_v/db
///               v_j  R_i' C
///
/// Biases walk: r_b = b_j - b_i with variance walk^2 T. Its share in the motion, walk^2 T^3/3 in velocity against noise^2 T, is neglected
/// (5e-4 at 1 s).
#pragma once

#include <Eigen/Core>

#include <cmath>

#include <searvins/core/status.hpp>
#include <searvins/imu/earth.hpp>
#include <searvins/imu/imu_sample.hpp>
#include <searvins/imu/navigation_state.hpp>
#include <searvins/imu/preintegrated_motion.hpp>
#include <searvins/math/block_cholesky.hpp>
#include <searvins/math/deferred.hpp>
#include <searvins/math/so3.hpp>
#include <searvins/smoother/factor.hpp>

namespace searvins::imu {

/// R, upper triangular, with R' R = Q^-1 for a positive definite N x N matrix Q. Errors: not_positive_definite (index: the row), also for
/// NaN.
template <int N, class Scalar = double>
[[nodiscard]] Result<math::Matrix<Scalar, N, N>> square_root_information(const math::Matrix<Scalar, N, N>& Q) {
  // Q = U U' with U upper is the Cholesky factor of Q with rows and columns reversed; R = U^-1.
  math::Matrix<Scalar, N, N> L = Q.reverse();
  const math::Vector<Scalar, N> reference = L.diagonal();
  const auto report = math::partial_cholesky(L.data(), N, N, N, reference.data());
  if (!report.ok())
    return failure(StatusCode::not_positive_definite, "covariance is not positive definite", N - 1 - report.failed, -1,
                   static_cast<double>(report.value));
  math::Matrix<Scalar, N, N> inverse = math::Matrix<Scalar, N, N>::Identity();
  for (int j = 0; j < N; ++j) math::solve_lower(L.data(), N, N, inverse.col(j).data());
  return math::Matrix<Scalar, N, N>{inverse.reverse()};
}

/// See the file comment. Rows in the order of the state's axes: attitude, position, velocity, accelerometer bias, gyroscope bias.
template <EarthModel Earth = RotatingEarth>
struct ImuFactor {
  using Scalar = typename Earth::Scalar;
  using Vector3 = Eigen::Matrix<Scalar, 3, 1>;
  using Matrix3 = Eigen::Matrix<Scalar, 3, 3>;
  using Matrix9 = Eigen::Matrix<Scalar, 9, 9>;
  using State = BasicNavigationState<Scalar>;
  using Turn = BasicEarthTurn<Scalar>;
  static constexpr int max_rows = 15, max_keys = 2, max_columns = 30;
  static constexpr const char* name = "inertial";

  smoother::Key<State> from{}, to{};
  PreintegratedMotion<Scalar> motion{};
  Vector3 earth_rate_w_radps{Vector3::Zero()};
  BasicGravityField<Scalar> gravity{};
  Matrix9 root_information{Matrix9::Identity()};     ///< of the motion
  Scalar accel_walk_weight{1}, gyro_walk_weight{1};  ///< 1 / sigma of the biases' walk over the interval

  /// A factor from a motion. `near_w_m`: where the interval begins, to some 100 m; gravity and its gradient are taken there.
  /// Errors: not_positive_definite (motion's covariance), invalid_argument (duration, walk densities).
  [[nodiscard]] static Result<ImuFactor> make(const smoother::Key<State>& from, const smoother::Key<State>& to,
                                              const PreintegratedMotion<Scalar>& motion, const ImuNoise& noise, const Earth& earth,
                                              const Vector3& near_w_m) {
    const double accel_walk = noise.accel_bias_walk_mps3_sqrt_hz, gyro_walk = noise.gyro_bias_walk_radps2_sqrt_hz;
    if (!(motion.duration_s > 0)) return failure(StatusCode::invalid_argument, "an inertial factor needs an interval of positive length");
    if (!(accel_walk > 0 && gyro_walk > 0)) return failure(StatusCode::invalid_argument, "densities of the bias walks must be positive");
    const auto root = square_root_information<9, Scalar>(motion.covariance);
    if (!root) return root.status();
    const Scalar root_T = std::sqrt(motion.duration_s);
    return ImuFactor{from,
                     to,
                     motion,
                     earth.rate_w_radps(),
                     earth.gravity_field(near_w_m),
                     *root,
                     1.0 / (accel_walk * root_T),
                     1.0 / (gyro_walk * root_T)};
  }

  [[nodiscard]] int rows() const { return 15; }
  template <class Visit>
  void for_each_key(Visit&& visit) const {
    visit(from), visit(to);
  }
  template <class Values>
  void evaluate(const Values& values, Scalar* e) const {
    residual(values(from), values(to), e, nullptr);
  }
  template <class Values>
  void linearise(const Values& values, Scalar* e, smoother::JacobianRef<Scalar> J) const {
    MotionJacobian d;
    residual(values(from), values(to), e, &d);
    for (int c = 0; c < kMotionColumns; ++c)
      for (int i = 0; i < 9; ++i) {
        Scalar sum = 0;
        for (int k = i; k < 9; ++k) sum += root_information(i, k) * d(k, c);
        J(i, c) = sum;
      }
    for (int i = 0; i < 3; ++i) {
      J(State::accel_bias + i, State::accel_bias + i) = -accel_walk_weight;
      J(State::accel_bias + i, 15 + State::accel_bias + i) = accel_walk_weight;
      J(State::gyro_bias + i, State::gyro_bias + i) = -gyro_walk_weight;
      J(State::gyro_bias + i, 15 + State::gyro_bias + i) = gyro_walk_weight;
    }
  }
  Scalar weigh(const Scalar* e, Scalar* w) const { return smoother::weigh_gaussian(e, 15, w); }

 private:
  static constexpr int kMotionColumns = 24;  // all of state i; attitude, position and velocity of state j
  using MotionJacobian = Eigen::Matrix<Scalar, 9, kMotionColumns>;

  [[nodiscard]] Turn turn() const {
    if constexpr (Earth::rotates) return Turn::over(earth_rate_w_radps, motion.duration_s);
    return Turn::none(motion.duration_s);
  }

  void residual(const State& x, const State& y, Scalar* e, MotionJacobian* J) const {
    const Scalar T = motion.duration_s;
    const Turn w = turn();
    const auto m = motion.corrected(bias_of(x));
    const Matrix3 Rt = x.R_wb.transpose(), X = m.dR.transpose() * Rt * w.C * y.R_wb;
    const Vector3 d = y.p_wb_m - x.p_wb_m, g = gravity.at(x.p_wb_m), Gd = gravity.gradient_w_ps2 * d, Cd = w.C * d;
    const Vector3 z_p = Rt * (Cd - T * x.v_wb_mps - w.J2 * (g + Gd / 3));
    const Vector3 z_v = Rt * (w.C * y.v_wb_mps + w.K * Cd - x.v_wb_mps - w.J1 * (g + Gd / 2));
    Eigen::Matrix<Scalar, 9, 1> r;
    r << so3::log(X), z_p - m.dp_m, z_v - m.dv_mps;
    for (int i = 0; i < 9; ++i) {
      e[i] = 0;
      for (int k = i; k < 9; ++k) e[i] += root_information(i, k) * r[k];
    }
    for (int i = 0; i < 3; ++i) {
      e[State::accel_bias + i] = accel_walk_weight * (y.accel_bias_b_mps2[i] - x.accel_bias_b_mps2[i]);
      e[State::gyro_bias + i] = gyro_walk_weight * (y.gyro_bias_b_radps[i] - x.gyro_bias_b_radps[i]);
    }
    if (J) motion_jacobian(r.template head<3>(), X, Rt, z_p, z_v, m.turn_rad, y, w, *J);
  }

  void motion_jacobian(const Vector3& r_theta, const Matrix3& X, const Matrix3& Rt, const Vector3& z_p, const Vector3& z_v,
                       const Vector3& turn_rad, const State& y, const Turn& w, MotionJacobian& J) const {
    constexpr int t = State::attitude, p = State::position, v = State::velocity, ba = State::accel_bias, bg = State::gyro_bias, next = 15;
    const Matrix3 inverse = so3::right_jacobian_inverse(r_theta), RtC = Rt * w.C, RtKC = Rt * w.K * w.C;
    const Matrix3 G2 = Rt * w.J2 * gravity.gradient_w_ps2 / 3, G1 = Rt * w.J1 * gravity.gradient_w_ps2 / 2;
    J.setZero();
    J.template block<3, 3>(t, t) = -inverse * y.R_wb.transpose() * RtC.transpose();
    J.template block<3, 3>(t, bg) = -inverse * X.transpose() * so3::right_jacobian(turn_rad) * motion.d_R_d_gyro_bias;
    J.template block<3, 3>(t, next + t) = inverse;
    J.template block<3, 3>(p, t) = so3::skew(z_p);
    J.template block<3, 3>(p, p) = -RtC - 2 * G2;
    J.template block<3, 3>(p, v) = -motion.duration_s * Rt;
    J.template block<3, 3>(p, ba) = -motion.d_p_d_accel_bias;
    J.template block<3, 3>(p, bg) = -motion.d_p_d_gyro_bias;
    J.template block<3, 3>(p, next + p) = RtC - G2;
    J.template block<3, 3>(v, t) = so3::skew(z_v);
    J.template block<3, 3>(v, p) = -RtKC - G1;
    J.template block<3, 3>(v, v) = -Rt;
    J.template block<3, 3>(v, ba) = -motion.d_v_d_accel_bias;
    J.template block<3, 3>(v, bg) = -motion.d_v_d_gyro_bias;
    J.template block<3, 3>(v, next + p) = RtKC - G1;
    J.template block<3, 3>(v, next + v) = RtC;
  }
};

static_assert(smoother::Factor<ImuFactor<RotatingEarth>> && smoother::Factor<ImuFactor<FlatEarth>> &&
              smoother::Factor<ImuFactor<ConstantGravity>>);

}  // namespace searvins::imu
