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
template <class Self, smoother::Role kRole>
struct RealVariable {
  using Scalar = double;
  using Step = Eigen::Matrix<double, 1, 1>;
  static constexpr int dof = 1;
  static constexpr smoother::Role role = kRole;
  double value{0};
  [[nodiscard]] Self retract(const Step& d) const {
    Self y;
    y.value = value + d[0];
    return y;
  }
  [[nodiscard]] Step local(const Self& y) const { return Step{y.value - value}; }
};
}  // namespace detail

/// Carrier-phase ambiguity, cycles.
struct Ambiguity : detail::RealVariable<Ambiguity, smoother::Role::chain> {
  static constexpr const char* name = "ambiguity";
  static constexpr const char* axis_name(int) { return "cycles"; }
  /// Linear in every factor, so it never forces a relinearisation; a millicycle is what the convergence test resolves at its default.
  [[nodiscard]] static Step linearisation_scale() { return Step{10.0}; }
};

/// Error of a batch's pivot observation, metres or m/s.
struct PivotError : detail::RealVariable<PivotError, smoother::Role::local> {
  static constexpr const char* name = "pivot error";
  static constexpr const char* axis_name(int) { return "metres"; }
  [[nodiscard]] static Step linearisation_scale() { return Step{1.0}; }
};

static_assert(smoother::Variable<Ambiguity> && smoother::Variable<PivotError>);

}  // namespace searvins::gnss
