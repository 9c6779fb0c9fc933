// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The smoother problem of RTK: which variables and factors there are under a robust formulation and a motion policy, and how many.
#pragma once

#include <searvins/estimator/free_motion.hpp>
#include <searvins/estimator/rtk_options.hpp>
#include <searvins/gnss/gnss_factors.hpp>
#include <searvins/robust/formulation.hpp>
#include <searvins/robust/loss.hpp>
#include <searvins/smoother/fixed_lag_smoother.hpp>

namespace searvins::estimator {

/// A configuration: `Form` is one of robust::Batch, ScalarRows, LatentPivot, LatentPivotSymmetric. Code and phase go through DCS, Doppler through Huber
/// [paper sec. Correlation-Preserving Robust Estimation].
template <template <class> class Form, class CapacityType = HostedCapacity, class MotionType = FreeMotion>
struct RtkConfig {
  using Capacity = CapacityType;
  using Motion = MotionType;
  using CodePhaseForm = Form<robust::Dcs<double>>;
  using DopplerForm = Form<robust::Huber<double>>;
};

/// The Problem of FixedLagSmoother for a configuration.
template <class Config>
struct RtkProblem {
  using Cap = typename Config::Capacity;
  using Scalar = double;
  using Motion = typename Config::Motion;
  using State = typename Motion::State;
  using Antenna = typename Motion::Antenna;
  using CodeFactor = gnss::DifferenceFactor<State, typename Config::CodePhaseForm, gnss::Observable::code, Cap::candidates, Antenna>;
  using PhaseFactor = gnss::DifferenceFactor<State, typename Config::CodePhaseForm, gnss::Observable::phase, Cap::candidates, Antenna>;
  using DopplerFactor = gnss::DifferenceFactor<State, typename Config::DopplerForm, gnss::Observable::doppler, Cap::doppler_candidates, Antenna>;

  using Variables = smoother::Joined<smoother::Types<smoother::Capacity<State, Cap::states>, smoother::Capacity<gnss::Ambiguity, Cap::ambiguities>,
                                                     smoother::Capacity<gnss::PivotError, 2 * Cap::batches + Cap::states>>,
                                     typename Motion::template Variables<Cap>>;
  using Factors = smoother::Joined<
      typename Motion::template Factors<Cap>,
      smoother::Types<smoother::Capacity<CodeFactor, Cap::batches>, smoother::Capacity<PhaseFactor, Cap::batches>, smoother::Capacity<DopplerFactor, Cap::states>,
                      smoother::Capacity<gnss::AmbiguityDatum, Cap::ambiguities>, smoother::Capacity<gnss::AmbiguityWalk, Cap::ambiguities>,
                      smoother::Capacity<gnss::IntegerFix, Cap::fixes>>>;
  static constexpr int max_front_dimension = Cap::max_front_dimension;
  static constexpr int member_capacity = Cap::member_capacity;
  static constexpr std::size_t arena_scalars = Cap::arena_scalars;
};

}  // namespace searvins::estimator
