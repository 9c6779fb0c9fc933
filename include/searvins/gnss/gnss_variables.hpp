// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The two scalar variables that differenced GNSS observations bring into the window.
///
/// Ambiguity. One carrier-phase ambiguity in cycles. In which form is the estimator's choice: the double difference N_s - N_o against a pivot, as in
/// the paper, or the single difference N_s between rover and base, whose double differences are formed in the factor; the common part of a group is
/// then held by a weak datum, and a change of pivot changes no state.
///
/// Pivot error. The error of the pivot of one batch at one epoch, metres (or m/s): local, eliminated on the spot [paper eq. (latent-pivot-residual)].
#pragma once

#include <Eigen/Core>

#include <searvins/smoother/variable.hpp>

namespace searvins::gnss {

namespace detail {
/// A real number as a variable.
template <class Self, class S, smoother::Role kRole>
struct RealVariable {
  using Scalar = S;
  using Step = Eigen::Matrix<Scalar, 1, 1>;
  static constexpr int dof = 1;
  static constexpr smoother::Role role = kRole;
  Scalar value{0};
  [[nodiscard]] Self retract(const Step& d) const {
    Self y;
    y.value = value + d[0];
    return y;
  }
  [[nodiscard]] Step local(const Self& y) const { return Step{y.value - value}; }
};
}  // namespace detail

/// Carrier-phase ambiguity, cycles.
template <class S>
struct BasicAmbiguity : detail::RealVariable<BasicAmbiguity<S>, S, smoother::Role::chain> {
  using Step = Eigen::Matrix<S, 1, 1>;
  static constexpr const char* name = "ambiguity";
  static constexpr const char* axis_name(int) { return "cycles"; }
  /// Linear in every factor, so it never forces a relinearisation; a millicycle is what the convergence test resolves at its default.
  [[nodiscard]] static Step linearisation_scale() { return Step{S{10}}; }
};
using Ambiguity = BasicAmbiguity<double>;  ///< in double precision

/// Error of a batch's pivot observation, metres or m/s.
template <class S>
struct BasicPivotError : detail::RealVariable<BasicPivotError<S>, S, smoother::Role::local> {
  using Step = Eigen::Matrix<S, 1, 1>;
  static constexpr const char* name = "pivot error";
  static constexpr const char* axis_name(int) { return "metres"; }
  [[nodiscard]] static Step linearisation_scale() { return Step{S{1}}; }
};
using PivotError = BasicPivotError<double>;  ///< in double precision

static_assert(smoother::Variable<Ambiguity> && smoother::Variable<PivotError>);

}  // namespace searvins::gnss
