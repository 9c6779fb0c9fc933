// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Preintegration of one segment after another: the kernel, without times, samples or checks.
///
/// A segment of h seconds has one mean rate w and one mean specific force f (biases taken off). Midpoint rule, second order, with eta = w h
/// / 2 and t the time from the start to the middle of the segment:
///
///     M = R Exp(eta)   attitude at the middle        a = h M f   gain of velocity        R <- M Exp(eta)
///     dv += a          dq -= t a                     dp = dq + T dv   at the end T, that is the sum of (T - t) a
///
/// Keeping q = p - T v instead of p spares moving all of it by h v in each segment. Errors of attitude are kept as psi, R_true = Exp(psi)
/// R, on the left: in axes that do not turn psi stays as it is, and  n_v <- n_v - a x psi_m,  n_q <- n_q + t a x psi_m,  psi <- psi +
/// noise.
///
/// White noise that is alike on all axes looks alike from all axes. So cov(psi) = rho I is a scalar, cov(psi, n_v) = [u]x and cov(psi, n_q)
/// = [z]x are vectors, and no 9x9 product is ever needed. From [a]x [g]x = g a' - a'g I, with u+ = u + rho a, z+ = z - t rho a and means
/// u~, z~ of old and new:
///
///     V = cov(n_v):       V <- V - (a u~' + u~ a' - 2 a'u~ I)
///     X = cov(n_v, n_q):  X <- X - (z a' - a'z I) + t (a u+' - a'u+ I)
///     P = cov(n_q):       P <- P + t (a z~' + z~ a' - 2 a'z~ I)
///
/// The gyro's noise q_g h enters in halves before and after; the accelerometer's is that of white noise within the segment, (1, -t, t^2 +
/// h^2/12) q_a h in (V, X, P), so one segment already has full rank.
///
/// Biases: R Exp(eta + d) = Exp(R Jl(eta) d) M, hence d psi / d b_g = -h/2 (R + M) Jl(eta), the first summand of which counts at the
/// middle.
#pragma once

#include <Eigen/Core>

#include <searvins/imu/preintegrated_motion.hpp>
#include <searvins/math/so3.hpp>

namespace searvins::imu {

/// See the file comment.
template <class S>
class MotionAccumulator {
 public:
  using Vector3 = Eigen::Matrix<S, 3, 1>;
  using Matrix3 = Eigen::Matrix<S, 3, 3>;

  MotionAccumulator() = default;
  explicit MotionAccumulator(const ImuBias<S>& bias) : bias_(bias) {}

  /// Appends h > 0 seconds of mean readings; noise as power spectral densities, (m/s^2)^2/Hz and (rad/s)^2/Hz.
  void advance(S h, const Vector3& gyro_b_radps, const Vector3& accel_b_mps2, S accel_psd, S gyro_psd) {
    const S half = h / S(2);
    Matrix3 E, J;
    half_turn(half * (gyro_b_radps - bias_.gyro_b_radps), E, J);
    Matrix3 M, L, N;
    M.noalias() = R_ * E;
    L.noalias() = R_ * J;
    N.noalias() = M * J;
    R_.noalias() = M * E;
    const Vector3 a = h * (M * (accel_b_mps2 - bias_.accel_b_mps2));

    const S t = duration_ + half;
    duration_ += h;
    dv_ += a;
    dq_ -= t * a;
    dpsi_dbg_ -= half * L;
    for (int c = 0; c < 3; ++c) {
      const Vector3 kick = a.cross(dpsi_dbg_.col(c)), push = h * M.col(c);
      dv_dbg_.col(c) -= kick;
      dq_dbg_.col(c) += t * kick;
      dv_dba_.col(c) -= push;
      dq_dba_.col(c) += t * push;
    }
    dpsi_dbg_ -= half * N;
    add_covariance(a, t, h, accel_psd, gyro_psd);
    if (++segments_ % kOrthonormaliseEvery == 0) R_ = (S(3) * R_ - R_ * (R_.transpose() * R_)) / S(2);
  }

  /// What has been accumulated; times and duration are the caller's.
  void write(PreintegratedMotion<S>& motion) const {
    motion.bias = bias_;
    const S T = duration_;
    motion.dR = R_, motion.dp_m = dq_ + T * dv_, motion.dv_mps = dv_;
    const Matrix3 Rt = R_.transpose();
    motion.d_R_d_gyro_bias.noalias() = Rt * dpsi_dbg_;  // phi = R' psi
    motion.d_p_d_accel_bias = dq_dba_ + T * dv_dba_, motion.d_p_d_gyro_bias = dq_dbg_ + T * dv_dbg_;
    motion.d_v_d_accel_bias = dv_dba_, motion.d_v_d_gyro_bias = dv_dbg_;
    auto& Q = motion.covariance;
    Q.template block<3, 3>(0, 0) = rho_ * Matrix3::Identity();
    Q.template block<3, 3>(0, 3).noalias() = Rt * so3::skew(Vector3{z_ + T * u_});
    Q.template block<3, 3>(0, 6).noalias() = Rt * so3::skew(u_);
    Q.template block<3, 3>(3, 3) = P_ + T * (X_ + X_.transpose() + T * V_);
    Q.template block<3, 3>(3, 6) = X_.transpose() + T * V_;
    Q.template block<3, 3>(6, 6) = V_;
    for (int i = 0; i < 9; ++i)
      for (int j = 0; j < i; ++j) Q(i, j) = Q(j, i);
  }

 private:
  static constexpr unsigned kOrthonormaliseEvery = 32;  // rounding of that many products stays below 1e-5 rad in float

  /// E = Exp(eta), J = Jl(eta): the series of C and B to 1e-17 below a quarter of a radian, else the closed forms.
  static void half_turn(const Vector3& eta, Matrix3& E, Matrix3& J) {
    const S x = eta.squaredNorm();
    if (!(x < S(0.0625))) {
      E = so3::exp(eta), J = so3::left_jacobian(eta);
      return;
    }
    const auto next = [x](S divisor, S rest) { return S(1) - x * (S(1) / divisor) * rest; };
    const S B = next(S(12), next(S(30), next(S(56), next(S(90), next(S(132), S(1)))))) / S(2);
    const S C = next(S(20), next(S(42), next(S(72), next(S(110), next(S(156), S(1)))))) / S(6);
    E = so3::detail::quadratic_in_skew<S>(eta, S(1) - x * C, B);
    J = so3::detail::quadratic_in_skew<S>(eta, B, C);
  }

  /// The covariance after a segment: see the file comment.
  void add_covariance(const Vector3& a, S t, S h, S accel_psd, S gyro_psd) {
    const S half_noise = gyro_psd * h / S(2), rho = rho_ + half_noise;
    const Vector3 u = u_ + rho * a, z = z_ - (t * rho) * a;
    const Vector3 g = (u_ + u) / S(2), y = t * (z_ + z) / S(2), ta = t * a;
    const S q = accel_psd * h;
    for (int j = 0; j < 3; ++j)
      for (int i = 0; i < 3; ++i) {
        V_(i, j) -= a[i] * g[j] + g[i] * a[j];
        X_(i, j) += ta[i] * u[j] - z_[i] * a[j];
        P_(i, j) += a[i] * y[j] + y[i] * a[j];
      }
    V_.diagonal().array() += S(2) * a.dot(g) + q;
    X_.diagonal().array() += a.dot(z_) - ta.dot(u) - q * t;
    P_.diagonal().array() += q * (t * t + h * h / S(12)) - S(2) * a.dot(y);
    u_ = u, z_ = z, rho_ = rho + half_noise;
  }

  ImuBias<S> bias_{};
  Matrix3 R_{Matrix3::Identity()};
  S duration_{0};
  Vector3 dq_{Vector3::Zero()}, dv_{Vector3::Zero()};
  Matrix3 dpsi_dbg_{Matrix3::Zero()};
  Matrix3 dq_dba_{Matrix3::Zero()}, dq_dbg_{Matrix3::Zero()}, dv_dba_{Matrix3::Zero()}, dv_dbg_{Matrix3::Zero()};
  S rho_{0};
  Vector3 u_{Vector3::Zero()}, z_{Vector3::Zero()};
  Matrix3 V_{Matrix3::Zero()}, X_{Matrix3::Zero()}, P_{Matrix3::Zero()};
  unsigned segments_{0};
};

}  // namespace searvins::imu
