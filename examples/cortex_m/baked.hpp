// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Forms of the measurements and problems that stand in the images as constants: baked_drive.hpp and baked_ambiguities.hpp, both written
/// by bake.cpp.
#pragma once

#include <cstdint>

namespace searvins::cortex_m {

/// A signal of a satellite at an epoch, in the units of gnss::SignalObservation. Rows of one satellite stand together.
struct BakedSignal {
  char system;  ///< RINEX letter
  std::uint8_t number;
  char band, attribute;
  bool loss_of_lock, half_cycle;
  float cn0_dbhz;
  double code_m, phase_cycles, doppler_hz;  ///< NaN where there is none
};

/// An epoch of a receiver: `count` rows of the table of signals from `first` on.
struct BakedEpoch {
  std::int64_t tag_ns;
  int first, count;
};

/// An integer least-squares problem: float, lower triangle of the covariance row by row, and the answer.
struct BakedAmbiguities {
  int n, first_value, first_covariance;  ///< offsets into the tables of floats (and integers) and of covariances
};

}  // namespace searvins::cortex_m
