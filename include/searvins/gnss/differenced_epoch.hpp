// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The product of differencing: base-corrected single differences of one epoch, grouped, each group with its pivot.
///
/// For an antenna position p (ECEF) the corrected code and phase of satellite s obey
///
///     code_m  = range_m(p, satellite_e_m) + c (rover clock - base clock)                  + noise
///     phase_m = range_m(p, satellite_e_m) + c (rover clock - base clock) + wavelength N_s + noise
///
/// up to a constant that all satellites of a group share; so the difference to the group's pivot is free of clocks, and the noise of a
/// group is diag(sigma_i^2) + sigma_pivot^2 1 1'. Doppler rates obey rate_mps = unit_e' v + c (rover clock drift), v the velocity in ECEF.
#pragma once

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <cstdint>

#include <searvins/core/static_vector.hpp>
#include <searvins/core/status.hpp>
#include <searvins/core/time.hpp>
#include <searvins/gnss/common_motion.hpp>
#include <searvins/gnss/cycle_slip.hpp>
#include <searvins/gnss/observation.hpp>
#include <searvins/gnss/signal.hpp>
#include <searvins/gnss/signal_pairing.hpp>

namespace searvins::gnss {

inline constexpr std::size_t kMaxCorrectedSignals = 160;  ///< base-corrected signals of one epoch
inline constexpr std::size_t kMaxRejectedSignals = 256;  ///< rejections of one epoch that are remembered one by one

/// Why an observation was not used, or only its code.
enum class Rejection : std::uint8_t {
  no_ephemeris,     ///< no healthy broadcast record of sufficient age
  bad_code,         ///< the pseudorange is no pseudorange, or the orbit at its transmission is none
  low_elevation,    ///< below the mask
  low_cn0,          ///< weaker than the limit
  no_base,          ///< the base lacks the satellite or the group's base code
  no_code,          ///< the rover has no code (no first ambiguity could be formed)
  no_phase,         ///< kept with its code alone: no phase on the rover, the base, or across two interpolated base epochs
  half_cycle,       ///< kept with its code alone: half-cycle ambiguity unresolved
  no_pivot,         ///< no satellite of the group may be the pivot
  group_too_small,  ///< fewer signals in the group than asked for
  duplicate,        ///< the satellite stands twice in the epoch; neither copy is used
  capacity,         ///< more signals than fit: those of the lowest satellites go
};
inline constexpr std::size_t kRejections = 12;  ///< number of Rejection values

/// Name of a rejection, for reports.
[[nodiscard]] constexpr const char* name_of(Rejection r) {
  constexpr const char* names[kRejections] = {"no ephemeris", "bad code",   "low elevation", "low C/N0",        "no base",   "no code",
                                              "no phase",     "half cycle", "no pivot",      "group too small", "duplicate", "capacity"};
  return names[static_cast<std::size_t>(r)];
}

/// One line of the report.
struct RejectedSignal {
  SatelliteId satellite{};
  SignalCode signal{};  ///< of the rover; band 0: the whole satellite
  Rejection reason{};
};

/// One rover signal of one satellite, corrected by the base; see the head of this file.
struct CorrectedSignal {
  SatelliteId satellite{};
  SignalCode rover_signal{}, base_signal{};
  double wavelength_m{0};
  double code_m{0};
  double phase_m{kMissing};    ///< NaN when the phase is not usable
  double code_variance_m2{0};  ///< of the single difference, rover and base, grown with the age of the base data
  double phase_variance_m2{0};
  double elevation_rad{0}, azimuth_rad{0};
  double cn0_dbhz{kMissing};                               ///< of the rover
  Eigen::Vector3d satellite_e_m{Eigen::Vector3d::Zero()};  ///< at transmission, in the axes of that time, as range_m takes it
  Continuity continuity{Continuity::broken};               ///< of the phase since the previous epoch
  SlipCause cause{SlipCause::first_epoch};
};

/// The signals that share a pivot: one rover signal against one base signal.
struct SignalGroup {
  SignalCode rover_signal{}, base_signal{};
  double wavelength_m{0};
  int pivot{-1};                                                     ///< index into DifferencedEpoch::signals
  StaticVector<std::uint16_t, kMaxSatellitesPerEpoch> candidates{};  ///< indices of the others, by satellite
  bool pivot_changed{true};                                          ///< another pivot than at the previous epoch, or no previous one
  bool pivot_fallback{false};                                        ///< none was eligible: the highest satellite serves
};

/// Range rate of one satellite (its strongest signal), satellite motion and clock taken out.
struct DopplerMeasurement {
  SatelliteId satellite{};
  SignalCode signal{};
  double rate_mps{0};
  double variance_m2ps2{0};
  Eigen::Vector3d unit_e{Eigen::Vector3d::Zero()};  ///< d rate / d velocity, satellite to receiver
  double elevation_rad{0};
  double cn0_dbhz{kMissing};
};

/// What differencing says of an epoch besides its lists.
struct DifferencedEpochFacts {
  GpsTime rover_tag{};
  Status base_status{};  ///< ok, or why there are no single differences (no base data, too old); Doppler is there all the same
  double base_age_s{0};  ///< rover tag minus tag of the base epoch
  bool base_interpolated{false};
  int doppler_pivot{-1};                              ///< index of the highest, -1 when empty
  MotionFit motion{};                                 ///< what the common-motion test found
  int satellites{0};                                  ///< distinct satellites in `signals`
  std::array<std::uint16_t, kRejections> rejected{};  ///< how many, by reason
};

/// Everything differencing knows of one epoch. Some 25 kB: where a stack is small, keep one and have it filled.
struct DifferencedEpoch : DifferencedEpochFacts {
  StaticVector<CorrectedSignal, kMaxCorrectedSignals> signals{};  ///< by satellite, then in the order of the pairs
  StaticVector<SignalGroup, kMaxSignalGroups> groups{};
  StaticVector<DopplerMeasurement, kMaxSatellitesPerEpoch> doppler{};
  StaticVector<RejectedSignal, kMaxRejectedSignals> rejections{};  ///< which were rejected, as far as they fit

  /// As it was made, without another one beside it.
  void clear() {
    static_cast<DifferencedEpochFacts&>(*this) = {};
    signals.clear(), groups.clear(), doppler.clear(), rejections.clear();
  }

  /// Counts a rejection and lists it.
  void reject(SatelliteId satellite, const SignalCode& signal, Rejection reason) {
    ++rejected[static_cast<std::size_t>(reason)];
    rejections.push_back({satellite, signal, reason});
  }
};

}  // namespace searvins::gnss
