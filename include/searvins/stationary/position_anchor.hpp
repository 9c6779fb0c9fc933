// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The position anchor: the place where a vehicle stands, as a variable of its own [paper eq. (vision-stationary-factors)].
///
/// Every state of a rest sees the anchor s through  r = p_wb - s  with a few centimetres, so positions of a rest hold together while GNSS is weak, and one
/// good fix in the rest helps them all. s has a prior from the position of the state at which the rest was detected (latched):
///
///     e = L^-1 (s - mean)        L L' = covariance + floor^2 I
///
/// The floor keeps an optimistic covariance from pinning the place: the latched position and the prior of its state are the same information twice.
#pragma once

#include <Eigen/Core>

#include <cmath>

#include <searvins/core/status.hpp>
#include <searvins/imu/navigation_state.hpp>
#include <searvins/math/deferred.hpp>
#include <searvins/smoother/factor.hpp>
#include <searvins/smoother/variable.hpp>

namespace searvins::stationary {

/// A place in w, metres.
template <class S>
struct BasicPositionAnchor {
  using Scalar = S;
  using Step = Eigen::Matrix<S, 3, 1>;
  static constexpr int dof = 3;
  static constexpr smoother::Role role = smoother::Role::chain;
  static constexpr const char* name = "position anchor";
  static constexpr const char* axis_name(int i) {
    constexpr const char* names[] = {"east", "north", "up"};
    return i >= 0 && i < 3 ? names[i] : "?";
  }
  Step p_w_m{Step::Zero()};
  [[nodiscard]] BasicPositionAnchor retract(const Step& d) const { return {p_w_m + d}; }
  [[nodiscard]] Step local(const BasicPositionAnchor& y) const { return y.p_w_m - p_w_m; }
  /// Linear in every factor; a metre gives the convergence test its millimetre.
  [[nodiscard]] static Step linearisation_scale() { return Step::Ones(); }
};
using PositionAnchor = BasicPositionAnchor<double>;  ///< in double precision

/// r = p_wb - s.
template <class S>
struct BasicPositionAnchorFactor {
  using Scalar = S;
  using Vector3 = Eigen::Matrix<S, 3, 1>;
  static constexpr int max_rows = 3, max_keys = 2, max_columns = 18;
  static constexpr const char* name = "position anchor";
  smoother::Key<imu::NavigationState> state{};
  smoother::Key<BasicPositionAnchor<S>> anchor{};
  Scalar sigma_m{0.02};

  [[nodiscard]] int rows() const { return 3; }
  template <class Visit>
  void for_each_key(Visit&& visit) const {
    visit(state), visit(anchor);
  }
  template <class Values>
  void evaluate(const Values& values, Scalar* e) const {
    Eigen::Map<Vector3>{e} = (values(state).p_wb_m - values(anchor).p_w_m) / sigma_m;
  }
  template <class Values>
  void linearise(const Values& values, Scalar* e, smoother::JacobianRef<Scalar> J) const {
    evaluate(values, e);
    for (int i = 0; i < 3; ++i) {
      J(i, imu::NavigationState::position + i) = 1.0 / sigma_m;
      J(i, imu::NavigationState::dof + i) = -1.0 / sigma_m;
    }
  }
  Scalar weigh(const Scalar* e, Scalar* w) const { return smoother::weigh_gaussian(e, 3, w); }
};
using PositionAnchorFactor = BasicPositionAnchorFactor<double>;  ///< in double precision

/// The latched prior of an anchor.
template <class S>
struct BasicPositionAnchorPriorFactor {
  using Scalar = S;
  using Vector3 = Eigen::Matrix<S, 3, 1>;
  using Matrix3 = Eigen::Matrix<S, 3, 3>;
  static constexpr int max_rows = 3, max_keys = 1, max_columns = 3;
  static constexpr const char* name = "position anchor prior";
  smoother::Key<BasicPositionAnchor<S>> anchor{};
  Vector3 mean_w_m{Vector3::Zero()};
  Matrix3 whitening{Matrix3::Identity()};  ///< L^-1, lower triangular

  [[nodiscard]] int rows() const { return 3; }
  template <class Visit>
  void for_each_key(Visit&& visit) const {
    visit(anchor);
  }
  template <class Values>
  void evaluate(const Values& values, Scalar* e) const {
    Eigen::Map<Vector3>{e} = whitening * (values(anchor).p_w_m - mean_w_m);
  }
  template <class Values>
  void linearise(const Values& values, Scalar* e, smoother::JacobianRef<Scalar> J) const {
    evaluate(values, e);
    J.template block<3, 3>(0, 0) = whitening;
  }
  Scalar weigh(const Scalar* e, Scalar* w) const { return smoother::weigh_gaussian(e, 3, w); }
};
using PositionAnchorPriorFactor = BasicPositionAnchorPriorFactor<double>;  ///< in double precision

/// The prior of an anchor that is latched at a position with this covariance (w, m^2). The floor, 5 cm by default, adds to every axis.
/// Errors: non_finite, not_positive_definite (index: the pivot).
template <class Scalar = double>
[[nodiscard]] inline Result<BasicPositionAnchorPriorFactor<Scalar>> latch(smoother::Key<BasicPositionAnchor<Scalar>> anchor,
                                                                          const math::Vector3<Scalar>& position_w_m,
                                                                          const math::Matrix3<Scalar>& covariance_w_m2, double floor_m = 0.05) {
  using Matrix3 = Eigen::Matrix<Scalar, 3, 3>;
  if (!position_w_m.allFinite() || !covariance_w_m2.allFinite()) return failure(StatusCode::non_finite, "anchor position or covariance is not finite");
  const Matrix3 C = covariance_w_m2 + floor_m * floor_m * Matrix3::Identity();
  Matrix3 L = Matrix3::Zero();  // Cholesky by hand: three pivots
  for (int j = 0; j < 3; ++j)
    for (int i = j; i < 3; ++i) {
      double sum = C(i, j);
      for (int k = 0; k < j; ++k) sum -= L(i, k) * L(j, k);
      if (i == j && !(sum > 1e-12 * C(j, j))) return failure(StatusCode::not_positive_definite, "covariance of the anchor's position", j, -1, sum);
      L(i, j) = i == j ? std::sqrt(sum) : sum / L(j, j);
    }
  BasicPositionAnchorPriorFactor<Scalar> prior;
  prior.anchor = anchor;
  prior.mean_w_m = position_w_m;
  Matrix3& W = prior.whitening;
  W.setZero();
  for (int j = 0; j < 3; ++j) {
    W(j, j) = 1 / L(j, j);
    for (int i = j + 1; i < 3; ++i) {
      double sum = 0;
      for (int k = j; k < i; ++k) sum -= L(i, k) * W(k, j);
      W(i, j) = sum / L(i, i);
    }
  }
  return prior;
}

static_assert(smoother::Variable<PositionAnchor> && smoother::Factor<PositionAnchorFactor> && smoother::Factor<PositionAnchorPriorFactor>);

}  // namespace searvins::stationary
