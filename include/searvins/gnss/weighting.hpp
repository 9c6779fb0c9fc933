// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// How much a GNSS measurement is believed before it is looked at: variances by signal, elevation and age, and the screens.
///
/// A sigma pair [a, b] in metres describes a rover-base single difference (both receivers contribute, hence the 2):
///
///     SigmaForm::elevation    sigma^2 = 2 a^2 + (b / sin el)^2            the form of rig.json and of the urban profile
///     SigmaForm::symmetric    sigma^2 = 2 (a^2 + (b / sin el)^2)          the form that RTKLIB users know
///
/// An undifferenced measurement of one receiver has half of either. A base observation carried over `age` seconds adds (g age)^2: the
/// satellite clock, the orbit and the atmosphere move on meanwhile. Profiles:
///
///     urban      code of 0.9 .. 1.5 / 1.35 .. 2.4 m by signal: inflated by multipath, to go with robust weights
///     geodetic   code 0.3 / 0.3 m, phase 0.003 / 0.003 m: a good antenna under open sky
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>

#include <searvins/core/static_vector.hpp>
#include <searvins/gnss/observation.hpp>
#include <searvins/gnss/signal.hpp>

namespace searvins::gnss {

/// How a sigma pair depends on elevation; see the head of this file.
enum class SigmaForm : std::uint8_t { elevation, symmetric };

/// The two numbers of a sigma model, metres.
struct SigmaPair {
  double a_m{0}, b_m{0};
  friend constexpr bool operator==(const SigmaPair&, const SigmaPair&) = default;
};

/// Elevations below this are taken as this: 1/sin must stay finite. Radians (about 3 degrees).
inline constexpr double kLowestWeightedElevationRad = 0.05;

/// Variance of a rover-base single difference, m^2.
[[nodiscard]] inline double variance_m2(SigmaForm form, const SigmaPair& pair, double elevation_rad) {
  const double slant_m = pair.b_m / std::sin(std::max(elevation_rad, kLowestWeightedElevationRad));
  return 2 * pair.a_m * pair.a_m + (form == SigmaForm::symmetric ? 2.0 : 1.0) * slant_m * slant_m;
}

/// The pairs of one signal.
struct SignalSigma {
  SignalCode signal{};
  SigmaPair code{1.5, 1.95};
  SigmaPair phase{0.003, 0.006};
};

/// Sigmas of all signals: those listed, and `other` for the rest. A look-up takes the exact signal, else the first one on the same carrier.
struct SigmaModel {
  static constexpr std::size_t kMaxSignals = 16;

  SigmaForm form{SigmaForm::elevation};
  StaticVector<SignalSigma, kMaxSignals> signals{};
  SignalSigma other{};
  double doppler_mps{0.5};          ///< Doppler as a range rate, m/s, any elevation
  double code_growth_mps{0.0015};   ///< growth of sigma with the age of the base observation, m per second of age
  double phase_growth_mps{0.0015};  ///< 5e-12 of satellite clock instability times c

  [[nodiscard]] const SignalSigma& of(const SignalCode& signal) const {
    for (const SignalSigma& s : signals)
      if (s.signal == signal) return s;
    for (const SignalSigma& s : signals)
      if (same_carrier(s.signal, signal)) return s;
    return other;
  }

  /// Entry of exactly this signal for writing, made from the look-up when it is missing; nullptr when the table is full.
  [[nodiscard]] SignalSigma* entry(const SignalCode& signal) {
    for (SignalSigma& s : signals)
      if (s.signal == signal) return &s;
    SignalSigma made = of(signal);
    made.signal = signal;
    return signals.push_back(made) ? &signals.back() : nullptr;
  }

  /// Variance of a rover-base code difference, m^2; the base observation is |age| seconds old.
  [[nodiscard]] double code_variance_m2(const SignalCode& signal, double elevation_rad, double age_s = 0) const {
    const double grown_m = code_growth_mps * age_s;
    return variance_m2(form, of(signal).code, elevation_rad) + grown_m * grown_m;
  }
  /// Variance of a rover-base phase difference, m^2; the base observation is |age| seconds old.
  [[nodiscard]] double phase_variance_m2(const SignalCode& signal, double elevation_rad, double age_s = 0) const {
    const double grown_m = phase_growth_mps * age_s;
    return variance_m2(form, of(signal).phase, elevation_rad) + grown_m * grown_m;
  }
  /// Variance of one receiver's code, m^2.
  [[nodiscard]] double undifferenced_code_variance_m2(const SignalCode& signal, double elevation_rad) const {
    return 0.5 * variance_m2(form, of(signal).code, elevation_rad);
  }
  /// Variance of a Doppler range rate, (m/s)^2.
  [[nodiscard]] constexpr double doppler_variance_m2ps2() const { return doppler_mps * doppler_mps; }
};

/// The multipath-inflated table for cities: code by signal, every phase [0.003, 0.006] m, Doppler 0.5 m/s.
[[nodiscard]] inline SigmaModel urban_profile() {
  SigmaModel m;
  m.signals.push_back({{Constellation::gps, '1', 'C'}, {0.90, 1.95}, {0.003, 0.006}});
  m.signals.push_back({{Constellation::gps, '2', 'W'}, {1.50, 1.95}, {0.003, 0.006}});
  m.signals.push_back({{Constellation::galileo, '1', 'C'}, {1.50, 1.95}, {0.003, 0.006}});
  m.signals.push_back({{Constellation::galileo, '7', 'Q'}, {1.50, 2.40}, {0.003, 0.006}});
  m.signals.push_back({{Constellation::beidou, '2', 'I'}, {0.90, 1.35}, {0.003, 0.006}});
  return m;
}

/// A geodetic antenna under open sky: code [0.3, 0.3] m, phase [0.003, 0.003] m, Doppler 0.1 m/s, every signal alike.
[[nodiscard]] inline SigmaModel geodetic_profile() {
  SigmaModel m;
  m.other = {{}, {0.3, 0.3}, {0.003, 0.003}};
  m.doppler_mps = 0.1;
  return m;
}

/// What is worth using at all.
struct Screening {
  double elevation_mask_rad{15 * std::numbers::pi / 180};
  double min_cn0_dbhz{20};
};

/// A code that can be a pseudorange: finite and beyond 100 m (receivers write small numbers for a lost channel).
[[nodiscard]] inline bool plausible_code(const SignalObservation& s) { return s.has_code() && s.code_m > 100; }

/// A phase that can be one: finite, beyond 100 cycles either way.
[[nodiscard]] inline bool plausible_phase(const SignalObservation& s) { return s.has_phase() && std::abs(s.phase_cycles) > 100; }

/// C/N0 at or above the limit. A receiver that reports none is given the benefit of the doubt.
[[nodiscard]] inline bool strong_enough(const SignalObservation& s, const Screening& limits) {
  return !s.has_cn0() || s.cn0_dbhz >= limits.min_cn0_dbhz;
}

/// Elevation at or above the mask; false for NaN.
[[nodiscard]] inline bool high_enough(double elevation_rad, const Screening& limits) { return elevation_rad >= limits.elevation_mask_rad; }

/// Factor on a variance for C/N0: 1 at 45 dB-Hz and above (and where none is reported), one decade for every `decade_db` below. Thermal
/// noise takes 10 dB a decade; in a city weak also means reflected, and a steeper law leaves less to the robust weights.
[[nodiscard]] inline double cn0_variance_factor(double cn0_dbhz, double decade_db = 10) {
  constexpr double reference_dbhz = 45;
  if (!std::isfinite(cn0_dbhz)) return 1;
  return std::pow(10.0, std::max(reference_dbhz - cn0_dbhz, 0.0) / decade_db);
}

}  // namespace searvins::gnss
