// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// What a receiver reports at one epoch, in RINEX's own units and signs.
///
///     code     metres, contains receiver clock
///     phase    cycles, same sign as the range (grows when the satellite recedes)
///     Doppler  hertz, positive when the satellite approaches: range rate = -wavelength * Doppler
///     C/N0     dB-Hz
///
/// A missing measurement is a quiet NaN; ask has_code() and friends, never compare.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

#include <searvins/core/static_vector.hpp>
#include <searvins/core/time.hpp>
#include <searvins/gnss/signal.hpp>

namespace searvins::gnss {

inline constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();  ///< a measurement that is not there
inline constexpr std::size_t kMaxSignalsPerSatellite = 8;  ///< of one satellite at one epoch
inline constexpr std::size_t kMaxSatellitesPerEpoch = 64;  ///< of one receiver at one epoch

/// One tracked signal of one satellite.
struct SignalObservation {
  SignalCode signal{};
  double code_m{kMissing};        ///< pseudorange, metres
  double phase_cycles{kMissing};  ///< carrier phase, cycles
  double doppler_hz{kMissing};    ///< Doppler, Hz, positive when approaching
  double cn0_dbhz{kMissing};      ///< carrier to noise density, dB-Hz
  bool loss_of_lock{false};       ///< LLI bit 0 of the phase: lock was lost since the previous epoch, a slip is possible
  bool half_cycle{false};         ///< LLI bit 1: half-cycle ambiguity unresolved, the phase may jump by 0.5

  [[nodiscard]] bool has_code() const { return std::isfinite(code_m); }
  [[nodiscard]] bool has_phase() const { return std::isfinite(phase_cycles); }
  [[nodiscard]] bool has_doppler() const { return std::isfinite(doppler_hz); }
  [[nodiscard]] bool has_cn0() const { return std::isfinite(cn0_dbhz); }
};

/// All tracked signals of one satellite.
struct SatelliteObservation {
  SatelliteId satellite{};
  StaticVector<SignalObservation, kMaxSignalsPerSatellite> signals{};

  /// The observation of exactly this signal, nullptr when there is none.
  [[nodiscard]] const SignalObservation* find(const SignalCode& code) const {
    for (const SignalObservation& s : signals)
      if (s.signal == code) return &s;
    return nullptr;
  }
};

/// One epoch of one receiver. `tag` is the receiver's own clock reading; GPS time of reception is tag minus the receiver clock offset.
struct ObservationEpoch {
  GpsTime tag{};
  bool power_failure{false};  ///< RINEX epoch flag 1: power failure since the previous epoch, no phase continuity
  StaticVector<SatelliteObservation, kMaxSatellitesPerEpoch> satellites{};  ///< sorted by SatelliteId, each once

  /// The observations of a satellite, nullptr when there are none.
  [[nodiscard]] const SatelliteObservation* find(SatelliteId id) const {
    for (const SatelliteObservation& s : satellites)
      if (s.satellite == id) return &s;
    return nullptr;
  }
};

}  // namespace searvins::gnss
