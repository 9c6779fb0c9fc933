// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Settings and capacities of the RTK estimator. Every field changes some output; defaults are for a road vehicle in a city.
#pragma once

#include <cstddef>
#include <cstdint>

#include <searvins/ambiguity/continuation.hpp>
#include <searvins/ambiguity/resolution.hpp>
#include <searvins/estimator/noise_scale.hpp>
#include <searvins/gnss/double_difference.hpp>
#include <searvins/gnss/single_point_tracker.hpp>
#include <searvins/smoother/optimise.hpp>

namespace searvins::estimator {

/// How ambiguities survive a change of pivot.
enum class PivotHandover : std::uint8_t {
  exact,   ///< single-difference ambiguities with a weak datum: a pivot change alters no state
  restart  ///< double-difference ambiguities as in the paper: every arc of the signal starts afresh
};

/// How long an accepted integer constrains the window.
enum class FixMemory : std::uint8_t {
  window,  ///< until its ambiguity leaves the window (it is taken out then, never marginalised)
  epoch    ///< only the epoch that accepted it
};

/// Sigmas of a rover-base single difference that the estimator starts from: a good receiver in the open, white from epoch to epoch. What a pair of
/// receivers does beyond that is learned (NoiseAdaptation), what lasts over several epochs is counted once (code_correlation_*).
[[nodiscard]] inline gnss::SigmaModel default_sigmas() {
  gnss::SigmaModel m;
  m.other = {{}, {0.3, 0.3}, {0.003, 0.003}};
  m.doppler_mps = 0.2;
  return m;
}

/// Settings of RtkEstimator that do not depend on the formulation.
struct RtkOptions {
  gnss::DifferencingOptions differencing{.sigmas = default_sigmas()};
  gnss::TrackerOptions tracker{};
  ambiguity::ContinuityMode continuity{ambiguity::ContinuityMode::hybrid};
  int arc_epochs{3};                    ///< H of the hybrid mode, >= 1
  double walk_sigma_cycles{0.1};        ///< random walk between arcs
  double datum_sigma_cycles{1000};      ///< weak prior of a fresh ambiguity
  PivotHandover handover{PivotHandover::exact};
  ambiguity::ResolutionOptions resolution{};
  double fix_sigma_cycles{0.01};        ///< of an accepted integer
  FixMemory fix_memory{FixMemory::window};
  double release_sigmas{4};             ///< a held integer further than this from the float without it is released
  double max_suspect_share{0.2};        ///< a fix after which more than this share of its phases is down-weighted below 1/2 is taken back
  double code_correlation_s{8};         ///< codes of one receiver err alike over this time, so that epochs within it are worth one;
  double code_correlation_m{10};        ///< or over this way of the antenna, whichever ends sooner: reflections change with the place
  /// Learned factors on the sigmas of codes and, from fixed epochs, phases. Below 1 they count only where ambiguities are instantaneous: residuals of one
  /// epoch do not show the errors that last over a window.
  NoiseAdaptation code_noise{.min_scale = 0.3, .max_scale = 1.7};
  NoiseAdaptation phase_noise{.min_scale = 0.3, .max_scale = 2};
  /// Codes (with their phases) further than this many sigmas of prediction and code from the predicted double difference are left out; 0: no gate.
  /// Off by default: what it earns on one drive it costs on another (docs/benchmarks.md).
  double code_gate_sigmas{0};
  /// Where an inertial unit carries the window, codes of the rover alone serve while there is no base (gnss/undifferenced_epoch.hpp). What broadcast models
  /// leave lasts, so that codes within this time are worth one.
  bool use_undifferenced{true};
  double undifferenced_correlation_s{100};
  bool use_phase{true};
  bool use_doppler{true};
  double lag_s{6};                      ///< window length; at least arc_epochs + 1 epochs are kept whatever their interval
  double jerk_psd_m2ps5{1};             ///< white jerk of the motion model, per axis
  int min_satellites{5};                ///< with fewer double-differenced satellites the epoch is not differenced
  int min_suspect_epochs{4};            ///< consecutive epochs whose codes mostly contradict the window, after which it is started anew
  double start_sigma_m{100}, start_velocity_sigma_mps{30}, start_acceleration_sigma_mps2{5};
  double max_gap_s{60};                 ///< a longer gap starts a new window
  double shared_state_s{0.01};          ///< a frame this near to the newest state goes to it
  int frame_iterations{2};              ///< of Gauss-Newton at a frame
  smoother::OptimiseOptions<double> solver{.max_iterations = 8, .step_tolerance = 1e-3, .relinearise_threshold = 0.1, .weight_threshold = 0.02};
};

/// Compile-time sizes of a desktop build: 10 Hz over 6 s, 96 phases an epoch.
struct HostedCapacity {
  static constexpr int states = 64;
  static constexpr int phases_per_epoch = 96;  ///< ambiguities of one epoch; the lowest satellites' are left out beyond it
  static constexpr int candidates = 32;        ///< satellites of one group without the pivot
  static constexpr int doppler_candidates = 48;
  static constexpr int batches = 640;          ///< code (and phase) batches in the window
  static constexpr int ambiguities = 2048;
  static constexpr int fixes = 2048;
  static constexpr int max_front_dimension = 300;
  static constexpr int member_capacity = 16384;
  static constexpr std::size_t arena_scalars = 2'400'000;
  static constexpr std::size_t ephemerides = 8192;
  static constexpr std::size_t base_epochs = 32;
};

}  // namespace searvins::estimator
