// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// A landmark: a point of the world that several frames see, and its weak prior.
///
/// The smoother eliminates it first, on its own 3x3 block (Role::local), and lets it go whole when the oldest frame that sees it leaves.
///
///     prior   e = (l - l_0) / sigma          l_0: where it was triangulated
///
/// With sigma of tens of metres the prior says nothing where the eyes say anything: a point at 60 m is known to 4 m from one look. It is
/// for the point that all observations contradict, whose robust weights go to zero: its block stays invertible.
#pragma once

#include <Eigen/Core>

#include <cmath>

#include <searvins/core/status.hpp>
#include <searvins/smoother/factor.hpp>
#include <searvins/smoother/variable.hpp>

namespace searvins::vision {

/// A point in w, metres.
template <class S>
struct BasicLandmark {
  using Scalar = S;
  using Step = Eigen::Matrix<S, 3, 1>;
  static constexpr int dof = 3;
  static constexpr smoother::Role role = smoother::Role::local;
  static constexpr const char* name = "landmark";
  static constexpr const char* axis_name(int i) {
    constexpr const char* names[] = {"east", "north", "up"};
    return i >= 0 && i < 3 ? names[i] : "?";
  }
  Step p_w_m{Step::Zero()};
  [[nodiscard]] BasicLandmark retract(const Step& d) const { return {p_w_m + d}; }
  [[nodiscard]] Step local(const BasicLandmark& y) const { return y.p_w_m - p_w_m; }
  /// At 20 m a metre of depth bends the projection by 1/20 of the step.
  [[nodiscard]] static Step linearisation_scale() { return Step::Ones(); }
};

using Landmark = BasicLandmark<double>;  ///< in double precision

/// The weak prior of the file comment.
template <class S>
struct BasicLandmarkPriorFactor {
  using Scalar = S;
  using Vector3 = Eigen::Matrix<S, 3, 1>;
  static constexpr int max_rows = 3, max_keys = 1, max_columns = 3;
  static constexpr const char* name = "landmark prior";
  static constexpr double kDefaultSigma_m = 30;

  smoother::Key<BasicLandmark<S>> landmark{};
  Vector3 mean_w_m{Vector3::Zero()};
  S weight_1pm{1 / kDefaultSigma_m};  ///< 1 / sigma

  /// Errors: invalid_argument (sigma), non_finite (mean).
  [[nodiscard]] static Result<BasicLandmarkPriorFactor> make(const smoother::Key<BasicLandmark<S>>& landmark, const Vector3& mean_w_m,
                                                             S sigma_m = kDefaultSigma_m) {
    if (!(sigma_m > 0) || !std::isfinite(1 / sigma_m) || !(1 / sigma_m > 0))
      return failure(StatusCode::invalid_argument, "sigma of a landmark's prior must be positive and finite", -1, -1, sigma_m);
    if (!mean_w_m.allFinite()) return failure(StatusCode::non_finite, "mean of a landmark's prior is not finite");
    return BasicLandmarkPriorFactor{landmark, mean_w_m, 1 / sigma_m};
  }

  [[nodiscard]] int rows() const { return 3; }
  template <class Visit>
  void for_each_key(Visit&& visit) const {
    visit(landmark);
  }
  template <class Values>
  void evaluate(const Values& values, S* e) const {
    Eigen::Map<Vector3>{e} = weight_1pm * (values(landmark).p_w_m - mean_w_m);
  }
  template <class Values>
  void linearise(const Values& values, S* e, smoother::JacobianRef<S> J) const {
    evaluate(values, e);
    for (int i = 0; i < 3; ++i) J(i, i) = weight_1pm;
  }
  S weigh(const S* e, S* w) const { return smoother::weigh_gaussian(e, 3, w); }
};

using LandmarkPriorFactor = BasicLandmarkPriorFactor<double>;  ///< in double precision

static_assert(smoother::Variable<Landmark> && smoother::Factor<LandmarkPriorFactor>);

}  // namespace searvins::vision
