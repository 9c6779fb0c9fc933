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
template <class S>
struct BasicPositionFactor {
  using Scalar = S;
  using State = BasicNavigationState<S>;
  using Antenna = BasicLeverArm<S>;
  using Vector3 = Eigen::Matrix<S, 3, 1>;
  using Matrix3 = Eigen::Matrix<S, 3, 3>;
  static constexpr int max_rows = 3, max_keys = 1, max_columns = State::dof;
  static constexpr const char* name = "position";

  smoother::Key<State> state{};
  Antenna antenna{};
  Vector3 position_w_m{Vector3::Zero()};          ///< antenna, w
  Matrix3 root_information{Matrix3::Identity()};  ///< R
  robust::Huber<S> loss{2.5};

  /// `floor_m`: sigma that is added to every axis. Errors: not_positive_definite, also for NaN.
  [[nodiscard]] static Result<BasicPositionFactor> make(const smoother::Key<State>& state, const Antenna& antenna,
                                                        const Vector3& position_w_m, const Matrix3& covariance_w_m2, Scalar floor_m) {
    const Matrix3 C = covariance_w_m2 + floor_m * floor_m * Matrix3::Identity();
    const auto root = square_root_information<3, S>(C);
    if (!root.ok()) return root.status();
    if (!position_w_m.allFinite()) return failure(StatusCode::non_finite, "position is not finite");
    BasicPositionFactor f;
    f.state = state, f.antenna = antenna, f.position_w_m = position_w_m, f.root_information = *root;
    return f;
  }

  [[nodiscard]] int rows() const { return 3; }
  template <class Visit>
  void for_each_key(Visit&& visit) const {
    visit(state);
  }
  template <class Values>
  void evaluate(const Values& values, Scalar* e) const {
    Eigen::Map<Vector3>(e).noalias() = root_information * (antenna.position_w_m(values(state)) - position_w_m);
  }
  template <class Values>
  void linearise(const Values& values, Scalar* e, smoother::JacobianRef<Scalar> J) const {
    typename Antenna::Jacobian d_antenna;
    Eigen::Map<Vector3>(e).noalias() = root_information * (antenna.position_w_m(values(state), &d_antenna) - position_w_m);
    const Eigen::Matrix<S, 3, State::dof> rows = root_information.lazyProduct(d_antenna);
    for (int c = 0; c < State::dof; ++c)
      for (int i = 0; i < 3; ++i) J(i, c) = rows(i, c);
  }
  Scalar weigh(const Scalar* e, Scalar* w) const {
    const Scalar z2 = e[0] * e[0] + e[1] * e[1] + e[2] * e[2];
    std::fill_n(w, 3, loss.weight(z2));
    return loss.rho(z2);
  }
};
using PositionFactor = BasicPositionFactor<double>;  ///< in double precision

static_assert(smoother::Factor<PositionFactor>);

}  // namespace searvins::imu
