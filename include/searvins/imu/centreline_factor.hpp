// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The antenna drives along the centre line of a lane: its offset to the right of the line is zero within sigma.
///
///     e = n' (p_wb + R_wb l - a) / sigma        a: a point of the line, n: horizontal, across the line, both in w        rho(|e|) under DCS
///
/// One row: nothing is said of the place along the lane, nor of the height. A line's own direction does not matter: n and -n have the same cost. The loss
/// takes the weight of a lane that the vehicle has left between two matches (imu/centreline.hpp).
#pragma once

#include <Eigen/Core>

#include <searvins/imu/lever_arm.hpp>
#include <searvins/imu/navigation_state.hpp>
#include <searvins/math/deferred.hpp>
#include <searvins/robust/loss.hpp>
#include <searvins/smoother/factor.hpp>

namespace searvins::imu {

/// See the file comment.
struct CentrelineFactor {
  using Scalar = double;
  static constexpr int max_rows = 1, max_keys = 1, max_columns = NavigationState::dof;
  static constexpr const char* name = "centre line";

  smoother::Key<NavigationState> state{};
  LeverArm antenna{};
  Eigen::Vector3d point_w_m{Eigen::Vector3d::Zero()};
  Eigen::Vector3d right_w{1, 0, 0};
  double sigma_m{0.5};
  robust::Dcs<double> loss{};

  [[nodiscard]] int rows() const { return 1; }
  template <class Visit>
  void for_each_key(Visit&& visit) const {
    visit(state);
  }
  template <class Values>
  void evaluate(const Values& values, double* e) const {
    e[0] = right_w.dot(antenna.position_w_m(values(state)) - point_w_m) / sigma_m;
  }
  template <class Values>
  void linearise(const Values& values, double* e, smoother::JacobianRef<double> J) const {
    math::Deferred<LeverArm::Jacobian, Values> d_antenna;
    e[0] = right_w.dot(antenna.position_w_m(values(state), &d_antenna) - point_w_m) / sigma_m;
    for (int c = 0; c < NavigationState::dof; ++c) J(0, c) = right_w.dot(d_antenna.col(c)) / sigma_m;
  }
  double weigh(const double* e, double* w) const {
    w[0] = loss.weight(e[0] * e[0]);
    return loss.rho(e[0] * e[0]);
  }
};

static_assert(smoother::Factor<CentrelineFactor>);

}  // namespace searvins::imu
