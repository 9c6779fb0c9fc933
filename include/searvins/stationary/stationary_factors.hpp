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
struct ZeroVelocityFactor {
  using Scalar = double;
  static constexpr int max_rows = 3, max_keys = 1, max_columns = 15;
  static constexpr const char* name = "zero velocity";
  smoother::Key<imu::NavigationState> state{};
  double sigma_mps{0.03};

  [[nodiscard]] int rows() const { return 3; }
  template <class Visit>
  void for_each_key(Visit&& visit) const {
    visit(state);
  }
  template <class Values>
  void evaluate(const Values& values, double* e) const {
    Eigen::Map<Eigen::Vector3d>{e} = values(state).v_wb_mps / sigma_mps;
  }
  template <class Values>
  void linearise(const Values& values, double* e, smoother::JacobianRef<double> J) const {
    evaluate(values, e);
    for (int i = 0; i < 3; ++i) J(i, imu::NavigationState::velocity + i) = 1.0 / sigma_mps;
  }
  double weigh(const double* e, double* w) const { return smoother::weigh_gaussian(e, 3, w); }
};

/// The body does not turn relative to the Earth: the mean of the gyroscope over an interval around the state is its bias and the Earth.
struct ZeroAngularRateFactor {
  using Scalar = double;
  static constexpr int max_rows = 3, max_keys = 1, max_columns = 15;
  static constexpr const char* name = "zero angular rate";
  smoother::Key<imu::NavigationState> state{};
  Eigen::Vector3d mean_gyro_b_radps{Eigen::Vector3d::Zero()};
  Eigen::Vector3d earth_rate_w_radps{Eigen::Vector3d::Zero()};
  double sigma_radps{1e-3};  ///< of the mean: density / sqrt(duration), and what an idling engine adds

  [[nodiscard]] int rows() const { return 3; }
  template <class Visit>
  void for_each_key(Visit&& visit) const {
    visit(state);
  }
  template <class Values>
  void evaluate(const Values& values, double* e) const {
    const imu::NavigationState& x = values(state);
    Eigen::Map<Eigen::Vector3d>{e} = (x.gyro_bias_b_radps + x.R_wb.transpose() * earth_rate_w_radps - mean_gyro_b_radps) / sigma_radps;
  }
  template <class Values>
  void linearise(const Values& values, double* e, smoother::JacobianRef<double> J) const {
    evaluate(values, e);
    const Eigen::Vector3d earth_b = values(state).R_wb.transpose() * earth_rate_w_radps;
    J.block<3, 3>(0, imu::NavigationState::attitude) = so3::skew(earth_b) / sigma_radps;
    J.block<3, 3>(0, imu::NavigationState::gyro_bias) = Eigen::Matrix3d::Identity() / sigma_radps;
  }
  double weigh(const double* e, double* w) const { return smoother::weigh_gaussian(e, 3, w); }
};

/// The vehicle neither slides sideways nor lifts off.
struct NonHolonomicFactor {
  using Scalar = double;
  static constexpr int max_rows = 2, max_keys = 1, max_columns = 15;
  static constexpr const char* name = "non-holonomic";
  smoother::Key<imu::NavigationState> state{};
  Eigen::Vector3d gyro_b_radps{Eigen::Vector3d::Zero()};  ///< reading at the state's time
  Eigen::Vector3d earth_rate_w_radps{Eigen::Vector3d::Zero()};
  Eigen::Vector3d point_b_m{Eigen::Vector3d::Zero()};       ///< l: from the unit to the middle of the rear axle
  Eigen::Matrix3d R_vb{Eigen::Matrix3d::Identity()};        ///< vehicle axes (right, forward, up) from body axes
  double sigma_lateral_mps{0.1}, sigma_vertical_mps{0.1};

  [[nodiscard]] int rows() const { return 2; }
  template <class Visit>
  void for_each_key(Visit&& visit) const {
    visit(state);
  }
  template <class Values>
  void evaluate(const Values& values, double* e) const {
    const imu::NavigationState& x = values(state);
    const Eigen::Vector3d rate_b = gyro_b_radps - x.gyro_bias_b_radps - x.R_wb.transpose() * earth_rate_w_radps;
    const Eigen::Vector3d v_v = R_vb * (x.R_wb.transpose() * x.v_wb_mps + rate_b.cross(point_b_m));
    e[0] = v_v.x() / sigma_lateral_mps;
    e[1] = v_v.z() / sigma_vertical_mps;
  }
  template <class Values>
  void linearise(const Values& values, double* e, smoother::JacobianRef<double> J) const {
    evaluate(values, e);
    const imu::NavigationState& x = values(state);
    const Eigen::Matrix3d R_bw = x.R_wb.transpose(), L = so3::skew(point_b_m);
    const Eigen::Matrix3d by_attitude = R_vb * (so3::skew(R_bw * x.v_wb_mps) + L * so3::skew(R_bw * earth_rate_w_radps));
    const Eigen::Matrix3d by_velocity = R_vb * R_bw, by_bias = R_vb * L;
    for (int row = 0; row < 2; ++row) {
      const double sigma = row == 0 ? sigma_lateral_mps : sigma_vertical_mps;
      for (int i = 0; i < 3; ++i) {
        J(row, imu::NavigationState::attitude + i) = by_attitude(2 * row, i) / sigma;
        J(row, imu::NavigationState::velocity + i) = by_velocity(2 * row, i) / sigma;
        J(row, imu::NavigationState::gyro_bias + i) = by_bias(2 * row, i) / sigma;
      }
    }
  }
  double weigh(const double* e, double* w) const { return smoother::weigh_gaussian(e, 2, w); }
};

static_assert(smoother::Factor<ZeroVelocityFactor> && smoother::Factor<ZeroAngularRateFactor> && smoother::Factor<NonHolonomicFactor>);

}  // namespace searvins::stationary
