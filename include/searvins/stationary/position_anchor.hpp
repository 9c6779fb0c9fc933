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
#include <searvins/smoother/factor.hpp>
#include <searvins/smoother/variable.hpp>

namespace searvins::stationary {

/// A place in w, metres.
struct PositionAnchor {
  using Scalar = double;
  using Step = Eigen::Vector3d;
  static constexpr int dof = 3;
  static constexpr smoother::Role role = smoother::Role::chain;
  static constexpr const char* name = "position anchor";
  static constexpr const char* axis_name(int i) {
    constexpr const char* names[] = {"east", "north", "up"};
    return i >= 0 && i < 3 ? names[i] : "?";
  }
  Eigen::Vector3d p_w_m{Eigen::Vector3d::Zero()};
  [[nodiscard]] PositionAnchor retract(const Step& d) const { return {p_w_m + d}; }
  [[nodiscard]] Step local(const PositionAnchor& y) const { return y.p_w_m - p_w_m; }
  /// Linear in every factor; a metre gives the convergence test its millimetre.
  [[nodiscard]] static Step linearisation_scale() { return Step::Ones(); }
};

/// r = p_wb - s.
struct PositionAnchorFactor {
  using Scalar = double;
  static constexpr int max_rows = 3, max_keys = 2, max_columns = 18;
  static constexpr const char* name = "position anchor";
  smoother::Key<imu::NavigationState> state{};
  smoother::Key<PositionAnchor> anchor{};
  double sigma_m{0.02};

  [[nodiscard]] int rows() const { return 3; }
  template <class Visit>
  void for_each_key(Visit&& visit) const {
    visit(state), visit(anchor);
  }
  template <class Values>
  void evaluate(const Values& values, double* e) const {
    Eigen::Map<Eigen::Vector3d>{e} = (values(state).p_wb_m - values(anchor).p_w_m) / sigma_m;
  }
  template <class Values>
  void linearise(const Values& values, double* e, smoother::JacobianRef<double> J) const {
    evaluate(values, e);
    for (int i = 0; i < 3; ++i) {
      J(i, imu::NavigationState::position + i) = 1.0 / sigma_m;
      J(i, imu::NavigationState::dof + i) = -1.0 / sigma_m;
    }
  }
  double weigh(const double* e, double* w) const { return smoother::weigh_gaussian(e, 3, w); }
};

/// The latched prior of an anchor.
struct PositionAnchorPriorFactor {
  using Scalar = double;
  static constexpr int max_rows = 3, max_keys = 1, max_columns = 3;
  static constexpr const char* name = "position anchor prior";
  smoother::Key<PositionAnchor> anchor{};
  Eigen::Vector3d mean_w_m{Eigen::Vector3d::Zero()};
  Eigen::Matrix3d whitening{Eigen::Matrix3d::Identity()};  ///< L^-1, lower triangular

  [[nodiscard]] int rows() const { return 3; }
  template <class Visit>
  void for_each_key(Visit&& visit) const {
    visit(anchor);
  }
  template <class Values>
  void evaluate(const Values& values, double* e) const {
    Eigen::Map<Eigen::Vector3d>{e} = whitening * (values(anchor).p_w_m - mean_w_m);
  }
  template <class Values>
  void linearise(const Values& values, double* e, smoother::JacobianRef<double> J) const {
    evaluate(values, e);
    J.block<3, 3>(0, 0) = whitening;
  }
  double weigh(const double* e, double* w) const { return smoother::weigh_gaussian(e, 3, w); }
};

/// The prior of an anchor that is latched at a position with this covariance (w, m^2). The floor, 5 cm by default, adds to every axis.
/// Errors: non_finite, not_positive_definite (index: the pivot).
[[nodiscard]] inline Result<PositionAnchorPriorFactor> latch(smoother::Key<PositionAnchor> anchor, const Eigen::Vector3d& position_w_m,
                                                             const Eigen::Matrix3d& covariance_w_m2, double floor_m = 0.05) {
  if (!position_w_m.allFinite() || !covariance_w_m2.allFinite()) return failure(StatusCode::non_finite, "anchor position or covariance is not finite");
  const Eigen::Matrix3d C = covariance_w_m2 + floor_m * floor_m * Eigen::Matrix3d::Identity();
  Eigen::Matrix3d L = Eigen::Matrix3d::Zero();  // Cholesky by hand: three pivots
  for (int j = 0; j < 3; ++j)
    for (int i = j; i < 3; ++i) {
      double sum = C(i, j);
      for (int k = 0; k < j; ++k) sum -= L(i, k) * L(j, k);
      if (i == j && !(sum > 1e-12 * C(j, j))) return failure(StatusCode::not_positive_definite, "covariance of the anchor's position", j, -1, sum);
      L(i, j) = i == j ? std::sqrt(sum) : sum / L(j, j);
    }
  PositionAnchorPriorFactor prior;
  prior.anchor = anchor;
  prior.mean_w_m = position_w_m;
  Eigen::Matrix3d& W = prior.whitening;
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
