// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// A position of the antenna from elsewhere, as a factor on a navigation state: loose coupling.
///
///     e = R (p_wb + R_wb l - p_fix)        R' R = C^-1, C the covariance of the fix in w, floored
///     rho(|e|) under Huber                  a fix is one decision, so its three rows share a weight
///
/// Receivers and RTK programs are optimistic: errors of consecutive fixes are alike, and a wrong integer has a covariance of millimetres. The floor and
/// the loss are for that.
#pragma once

#include <Eigen/Core>

#include <algorithm>

#include <searvins/core/status.hpp>
#include <searvins/imu/imu_factor.hpp>
#include <searvins/imu/lever_arm.hpp>
#include <searvins/imu/navigation_state.hpp>
#include <searvins/robust/loss.hpp>
#include <searvins/smoother/factor.hpp>

namespace searvins::imu {

/// See the file comment.
struct PositionFactor {
  using Scalar = double;
  static constexpr int max_rows = 3, max_keys = 1, max_columns = NavigationState::dof;
  static constexpr const char* name = "position";

  smoother::Key<NavigationState> state{};
  LeverArm antenna{};
  Eigen::Vector3d position_w_m{Eigen::Vector3d::Zero()};         ///< antenna, w
  Eigen::Matrix3d root_information{Eigen::Matrix3d::Identity()};  ///< R
  robust::Huber<double> loss{2.5};

  /// `floor_m`: sigma that is added to every axis. Errors: not_positive_definite, also for NaN.
  [[nodiscard]] static Result<PositionFactor> make(const smoother::Key<NavigationState>& state, const LeverArm& antenna, const Eigen::Vector3d& position_w_m,
                                                   const Eigen::Matrix3d& covariance_w_m2, double floor_m) {
    const Eigen::Matrix3d C = covariance_w_m2 + floor_m * floor_m * Eigen::Matrix3d::Identity();
    const auto root = square_root_information<3>(C);
    if (!root.ok()) return root.status();
    if (!position_w_m.allFinite()) return failure(StatusCode::non_finite, "position is not finite");
    PositionFactor f;
    f.state = state, f.antenna = antenna, f.position_w_m = position_w_m, f.root_information = *root;
    return f;
  }

  [[nodiscard]] int rows() const { return 3; }
  template <class Visit>
  void for_each_key(Visit&& visit) const {
    visit(state);
  }
  template <class Values>
  void evaluate(const Values& values, double* e) const {
    Eigen::Map<Eigen::Vector3d>(e).noalias() = root_information * (antenna.position_w_m(values(state)) - position_w_m);
  }
  template <class Values>
  void linearise(const Values& values, double* e, smoother::JacobianRef<double> J) const {
    LeverArm::Jacobian d_antenna;
    Eigen::Map<Eigen::Vector3d>(e).noalias() = root_information * (antenna.position_w_m(values(state), &d_antenna) - position_w_m);
    const Eigen::Matrix<double, 3, NavigationState::dof> rows = root_information.lazyProduct(d_antenna);
    for (int c = 0; c < NavigationState::dof; ++c)
      for (int i = 0; i < 3; ++i) J(i, c) = rows(i, c);
  }
  double weigh(const double* e, double* w) const {
    const double z2 = e[0] * e[0] + e[1] * e[1] + e[2] * e[2];
    std::fill_n(w, 3, loss.weight(z2));
    return loss.rho(z2);
  }
};

static_assert(smoother::Factor<PositionFactor>);

}  // namespace searvins::imu
