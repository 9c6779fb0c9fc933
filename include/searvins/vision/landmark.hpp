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
struct Landmark {
  using Scalar = double;
  using Step = Eigen::Vector3d;
  static constexpr int dof = 3;
  static constexpr smoother::Role role = smoother::Role::local;
  static constexpr const char* name = "landmark";
  static constexpr const char* axis_name(int i) {
    constexpr const char* names[] = {"east", "north", "up"};
    return i >= 0 && i < 3 ? names[i] : "?";
  }
  Eigen::Vector3d p_w_m{Eigen::Vector3d::Zero()};
  [[nodiscard]] Landmark retract(const Step& d) const { return {p_w_m + d}; }
  [[nodiscard]] Step local(const Landmark& y) const { return y.p_w_m - p_w_m; }
  /// At 20 m a metre of depth bends the projection by 1/20 of the step.
  [[nodiscard]] static Step linearisation_scale() { return Step::Ones(); }
};

/// The weak prior of the file comment.
struct LandmarkPriorFactor {
  using Scalar = double;
  static constexpr int max_rows = 3, max_keys = 1, max_columns = 3;
  static constexpr const char* name = "landmark prior";
  static constexpr double kDefaultSigma_m = 30;

  smoother::Key<Landmark> landmark{};
  Eigen::Vector3d mean_w_m{Eigen::Vector3d::Zero()};
  double weight_1pm{1 / kDefaultSigma_m};  ///< 1 / sigma

  /// Errors: invalid_argument (sigma), non_finite (mean).
  [[nodiscard]] static Result<LandmarkPriorFactor> make(const smoother::Key<Landmark>& landmark, const Eigen::Vector3d& mean_w_m,
                                                        double sigma_m = kDefaultSigma_m) {
    if (!(sigma_m > 0) || !std::isfinite(1 / sigma_m) || !(1 / sigma_m > 0))
      return failure(StatusCode::invalid_argument, "sigma of a landmark's prior must be positive and finite", -1, -1, sigma_m);
    if (!mean_w_m.allFinite()) return failure(StatusCode::non_finite, "mean of a landmark's prior is not finite");
    return LandmarkPriorFactor{landmark, mean_w_m, 1 / sigma_m};
  }

  [[nodiscard]] int rows() const { return 3; }
  template <class Visit>
  void for_each_key(Visit&& visit) const {
    visit(landmark);
  }
  template <class Values>
  void evaluate(const Values& values, double* e) const {
    Eigen::Map<Eigen::Vector3d>{e} = weight_1pm * (values(landmark).p_w_m - mean_w_m);
  }
  template <class Values>
  void linearise(const Values& values, double* e, smoother::JacobianRef<double> J) const {
    evaluate(values, e);
    for (int i = 0; i < 3; ++i) J(i, i) = weight_1pm;
  }
  double weigh(const double* e, double* w) const { return smoother::weigh_gaussian(e, 3, w); }
};

static_assert(smoother::Variable<Landmark> && smoother::Factor<LandmarkPriorFactor>);

}  // namespace searvins::vision
