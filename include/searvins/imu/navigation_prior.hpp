// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// A Gaussian prior on a navigation state: the start of a trajectory, or what another estimator says of it.
///
///     e = R (x (-) mean)        R' R = Sigma^-1, 15 x 15 in the order of the state's axes
///
///     d e / d x = R diag(Jr^-1(r_theta), I, I, I, I)        r_theta: the attitude part of x (-) mean
///
/// R is upper triangular; with sigmas per group it is diagonal.
#pragma once

#include <Eigen/Core>

#include <searvins/core/status.hpp>
#include <searvins/imu/imu_factor.hpp>
#include <searvins/imu/navigation_state.hpp>
#include <searvins/math/so3.hpp>
#include <searvins/smoother/factor.hpp>

namespace searvins::imu {

/// One standard deviation of each group of axes, alike and independent on its three axes; attitude about body axes.
struct NavigationSigmas {
  double attitude_rad{0.1}, position_m{10}, velocity_mps{1}, accel_bias_mps2{0.05}, gyro_bias_radps{9e-4};
  double heading_rad{0};  ///< about the up axis of w where it is known less (or better) than levelling; 0: as `attitude_rad`
};

/// See the file comment.
template <class S>
struct BasicNavigationPriorFactor {
  using Scalar = S;
  using State = BasicNavigationState<S>;
  using Vector3 = Eigen::Matrix<S, 3, 1>;
  using Matrix3 = Eigen::Matrix<S, 3, 3>;
  using Matrix15 = Eigen::Matrix<S, 15, 15>;
  static constexpr int max_rows = 15, max_keys = 1, max_columns = 15;
  static constexpr const char* name = "navigation prior";

  smoother::Key<State> state{};
  State mean{};
  Matrix15 root_information{Matrix15::Identity()};

  /// From sigmas. Errors: invalid_argument (a sigma that is not positive).
  [[nodiscard]] static Result<BasicNavigationPriorFactor> make(const smoother::Key<State>& state, const State& mean,
                                                               const NavigationSigmas& s) {
    const double heading = s.heading_rad == 0 ? s.attitude_rad : s.heading_rad;
    const double sigmas[] = {s.attitude_rad, s.position_m, s.velocity_mps, s.accel_bias_mps2, s.gyro_bias_radps, heading};
    for (double sigma : sigmas)
      if (!(sigma > 0 && sigma * sigma > 0 && sigma * sigma < 1e300))
        return failure(StatusCode::invalid_argument, "sigmas of a prior must be positive", -1, -1, sigma);
    Matrix15 covariance = Matrix15::Zero();
    for (int i = 0; i < 15; ++i) covariance(i, i) = sigmas[i / 3] * sigmas[i / 3];
    const Vector3 up_b = mean.R_wb.row(2).transpose();  // turning about the up axis of w: dtheta = R_wb' e_up
    covariance.template topLeftCorner<3, 3>() += (heading * heading - s.attitude_rad * s.attitude_rad) * up_b * up_b.transpose();
    return make(state, mean, covariance);
  }
  /// From a covariance in the order of the state's axes. Errors: not_positive_definite.
  [[nodiscard]] static Result<BasicNavigationPriorFactor> make(const smoother::Key<State>& state, const State& mean,
                                                               const Matrix15& covariance) {
    const auto root = square_root_information<15, S>(covariance);
    if (!root) return root.status();
    return BasicNavigationPriorFactor{state, mean, *root};
  }

  [[nodiscard]] int rows() const { return 15; }
  template <class Visit>
  void for_each_key(Visit&& visit) const {
    visit(state);
  }
  template <class Values>
  void evaluate(const Values& values, Scalar* e) const {
    whiten(mean.local(values(state)), e);
  }
  template <class Values>
  void linearise(const Values& values, Scalar* e, smoother::JacobianRef<Scalar> J) const {
    const typename State::Step r = mean.local(values(state));
    whiten(r, e);
    const Matrix3 turn = so3::right_jacobian_inverse(r.template head<3>());
    for (int c = 0; c < 3; ++c)
      for (int i = 0; i < 3; ++i) {
        Scalar sum = 0;
        for (int k = i; k < 3; ++k) sum += root_information(i, k) * turn(k, c);
        J(i, c) = sum;
      }
    for (int c = 3; c < 15; ++c)
      for (int i = 0; i <= c; ++i) J(i, c) = root_information(i, c);
  }
  Scalar weigh(const Scalar* e, Scalar* w) const { return smoother::weigh_gaussian(e, 15, w); }

 private:
  void whiten(const typename State::Step& r, Scalar* e) const {
    for (int i = 0; i < 15; ++i) {
      e[i] = 0;
      for (int k = i; k < 15; ++k) e[i] += root_information(i, k) * r[k];
    }
  }
};
using NavigationPriorFactor = BasicNavigationPriorFactor<double>;  ///< in double precision

static_assert(smoother::Factor<NavigationPriorFactor>);

}  // namespace searvins::imu
