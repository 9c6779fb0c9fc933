// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Capacities for small memories, and what an RTK estimator with them takes: its `sizeof`, since it never allocates. All of it is known to
/// the compiler, so a firmware that outgrows its memory does not build (kRamBudgetBytes).
#pragma once

#include <cstddef>

#include <searvins/estimator/rtk_estimator.hpp>
#include <searvins/estimator/rtk_problem.hpp>

namespace searvins::cortex_m {

/// `Epochs` in the window (1 Hz: six seconds are eight), `Phases` ambiguities an epoch, arcs and integers for as many epochs.
template <int Epochs, int Phases, int Groups>
struct WindowCapacity {
  static constexpr int states = Epochs;
  static constexpr int phases_per_epoch = Phases;
  static constexpr int candidates = 12;
  static constexpr int doppler_candidates = 24;
  static constexpr int batches = Epochs * Groups;
  static constexpr int ambiguities = (Epochs + 1) * Phases;
  static constexpr int fixes = Epochs * Phases;
  static constexpr int max_front_dimension = 40 + 2 * Phases;
  static constexpr int member_capacity = 4 * Epochs * Phases;
  static constexpr std::size_t arena_scalars = std::size_t{Epochs} * (40 + 2 * Phases) * (40 + 2 * Phases) / 2;
  static constexpr std::size_t ephemerides = 32;
  static constexpr std::size_t base_epochs = 2;
};

/// One carrier of two constellations.
using TinyCapacity = WindowCapacity<6, 16, 2>;
/// Two carriers of GPS and Galileo, one of BeiDou: that of the image.
using SmallCapacity = WindowCapacity<8, 32, 6>;
/// The same with as many phases as a receiver of three constellations and two carriers has.
using MediumCapacity = WindowCapacity<10, 48, 8>;

template <class Capacity>
using Estimator = estimator::RtkEstimator<estimator::RtkConfig<robust::ScalarRows, Capacity>>;

/// Bytes of an estimator and of its larger parts.
struct RamBudget {
  std::size_t whole, smoother, tables, pools, elimination, priors, differencing, ambiguities;
};

template <class Capacity>
[[nodiscard]] constexpr RamBudget ram_budget() {
  using E = Estimator<Capacity>;
  using Smoother = typename E::Smoother;
  using Tables = typename Smoother::WindowType::TablesType;
  return {sizeof(E),
          sizeof(Smoother),
          sizeof(Tables),
          sizeof(typename Smoother::WindowType) - sizeof(Tables),
          sizeof(typename Smoother::EliminationType),
          2 * sizeof(typename Smoother::EliminationType::Prior),
          sizeof(gnss::Differencer) + sizeof(gnss::DifferencedEpoch) + sizeof(gnss::BaseBuffer<Capacity::base_epochs>),
          sizeof(ambiguity::Resolver<Capacity::phases_per_epoch>) + sizeof(ambiguity::FloatAmbiguities<Capacity::phases_per_epoch>)};
}

/// What the image may spend on its estimator.
inline constexpr std::size_t kRamBudgetBytes = 2'500'000;
static_assert(ram_budget<SmallCapacity>().whole <= kRamBudgetBytes,
              "the estimator has outgrown its memory: smaller capacities, or a larger part");

}  // namespace searvins::cortex_m
