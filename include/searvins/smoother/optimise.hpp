// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Settings and outcomes of the fixed-lag smoother's operations.
#pragma once

#include <cstdint>

#include <searvins/core/static_vector.hpp>
#include <searvins/core/status.hpp>
#include <searvins/core/time.hpp>
#include <searvins/smoother/variable.hpp>

namespace searvins::smoother {

/// What happens to the linearisation point of variables that the prior touches.
enum class PriorLinearisation : std::uint8_t {
  relinearise,    ///< follows the estimate; the prior's gradient is moved along
  first_estimate  ///< stays where the prior was made; new factors are linearised there too, so no direction gains spurious information
};

/// Settings of optimise().
template <class Scalar>
struct OptimiseOptions {
  int max_iterations{10};
  Scalar step_tolerance{Scalar(1e-4)};  ///< converged when every axis moves less than this times its linearisation_scale()
  Scalar relinearise_threshold{0};      ///< in units of linearisation_scale(); 0: relinearise whatever moved
  Scalar weight_threshold{0};           ///< a factor is reweighted when a row's weight changed by more than this
  Scalar initial_damping{Scalar(1e-4)};  ///< first Levenberg-Marquardt damping after a step that did not decrease the cost
  int max_damping_steps{8};             ///< damping grows tenfold each
  int max_step_halvings{0};             ///< an undamped step that did not decrease the cost is halved up to so often before it is damped: each
                                        ///< halving costs one evaluation, each damping a factorisation of every front
  PriorLinearisation prior{PriorLinearisation::relinearise};
};

/// Names an axis about which the window knows nothing.
struct UnderDetermined {
  AnyKey variable{};
  const char* variable_name{""};
  const char* axis_name{""};
  int axis{-1};
  GpsTime stamp{};
  double pivot{0};
  int factor_count{0};                           ///< factors that touch the variable
  StaticVector<const char*, 8> factor_names{};   ///< their types, each once
};

/// Outcome of optimise(). `status`: ok (converged); not_converged (iteration limit: the improved values are kept; or no step decreased the cost:
/// values as before); under_determined (`where` names the axis; values as before); non_finite; capacity_exceeded; no_data.
template <class Scalar>
struct OptimiseReport {
  Status status{};
  int iterations{0};
  Scalar initial_cost{0}, final_cost{0};
  Scalar last_step{0};  ///< largest axis movement of the last step, in units of linearisation_scale()
  int damped_steps{0};
  int halved_steps{0};     ///< OptimiseOptions::max_step_halvings
  int fronts_factored{0};  ///< over all iterations
  UnderDetermined where{};
};

/// Outcome of marginalise_oldest().
struct MarginaliseReport {
  Status status{};
  int variables{0}, factors{0};  ///< that left
  int unconnected{0};            ///< of them, variables that nothing touched: a no-op, counted
  int skipped_axes{0};           ///< axes without information
};

}  // namespace searvins::smoother
