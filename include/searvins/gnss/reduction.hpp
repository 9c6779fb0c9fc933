// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Observations of one receiver with what is known taken out: satellite clock, troposphere, ionosphere, and for a base its range.
///
///     reduced code   =  P          + c dt_s - T - I           = range + c (receiver clock) + noise
///     reduced phase  =  lambda phi + c dt_s - T + I           = range + c (receiver clock) + lambda N + noise
///
/// The signal left at t_s = tag - P/c - dt_s, where tag and P hold the same receiver clock: no clock enters the satellite position.
/// Rover and base use the *same* broadcast record, or a change of record between them would show as metres.
#pragma once

#include <Eigen/Core>

#include <cmath>

#include <searvins/core/status.hpp>
#include <searvins/core/time.hpp>
#include <searvins/geodesy/local_frame.hpp>
#include <searvins/geodesy/wgs84.hpp>
#include <searvins/gnss/atmosphere.hpp>
#include <searvins/gnss/ephemeris.hpp>
#include <searvins/gnss/observation.hpp>
#include <searvins/gnss/range.hpp>
#include <searvins/gnss/satellite.hpp>
#include <searvins/gnss/signal.hpp>
#include <searvins/gnss/weighting.hpp>
#include <searvins/math/deferred.hpp>

namespace searvins::gnss {

/// Which delays are taken out.
struct DelayModels {
  bool troposphere{true};
  KlobucharCoefficients ionosphere{};  ///< none present: no correction
};

/// A receiver at one epoch.
struct ReceiverPlace {
  GpsTime tag{};
  Eigen::Vector3d position_e_m{Eigen::Vector3d::Zero()};
  geodesy::Geodetic geodetic{};

  template <class Scalar = double>
  [[nodiscard]] static ReceiverPlace at(GpsTime tag, const math::Vector3<Scalar>& position_e_m) {
    return {tag, position_e_m, geodesy::geodetic_from_ecef(position_e_m)};
  }
};

/// One receiver and one satellite: what is common to all its signals.
struct ReceiverLine {
  SatelliteState state{};
  geodesy::AzimuthElevation angles{};
  double reduction_m{0};      ///< to be added to code and phase alike
  double ionosphere_l1_m{0};  ///< delay on L1, to be taken from the code and added to the phase
};

/// The line of a receiver to a satellite that transmitted from `state`. Scalar, here and below: double, for ECEF metres.
template <class Scalar = double>
[[nodiscard]] inline ReceiverLine line_of(const SatelliteState& state, const ReceiverPlace& place, const DelayModels& models) {
  ReceiverLine line;
  line.state = state;
  line.angles = geodesy::azimuth_elevation(place.position_e_m, state.position_e_m);
  line.reduction_m = kSpeedOfLightMps * state.clock_s;
  if (models.troposphere) line.reduction_m -= troposphere_delay_m(place.geodetic, line.angles.elevation_rad);
  if (models.ionosphere.present())
    line.ionosphere_l1_m =
        klobuchar_delay_m(models.ionosphere, place.geodetic, line.angles, place.tag, frequency_hz(Constellation::gps, '1'));
  return line;
}

/// State of the satellite at the transmission that a code timed, from a given record. Errors: invalid_argument (no pseudorange: not finite
/// or over ten light seconds), those of satellite_state.
template <class Scalar = double>
[[nodiscard]] inline Result<SatelliteState> state_from_code(const Ephemeris& e, GpsTime tag, double code_m) {
  if (!(std::abs(code_m) < 10 * kSpeedOfLightMps))
    return failure(StatusCode::invalid_argument, "pseudorange over ten light seconds", -1, -1, code_m);
  const GpsTime reading = tag.plus_seconds(-code_m / kSpeedOfLightMps);
  const Result<SatelliteState> at_reading = satellite_state(e, reading);
  if (!at_reading) return at_reading;
  return satellite_state(e, reading.plus_seconds(-at_reading->clock_s));
}

/// The line of a base to a satellite, its range taken out as well: of the observation only clock, ambiguity and noise remain.
template <class Scalar = double>
[[nodiscard]] inline Result<ReceiverLine> base_line_of(const Ephemeris& e, const ReceiverPlace& base, double code_m,
                                                       const DelayModels& models) {
  const Result<SatelliteState> state = state_from_code<Scalar>(e, base.tag, code_m);
  if (!state) return state.status();
  ReceiverLine line = line_of<Scalar>(*state, base, models);
  line.reduction_m -= range_m(base.position_e_m, state->position_e_m);
  return line;
}

/// Reduced code and phase of one signal, metres; NaN where the observation is missing or cannot be one.
struct ReducedSignal {
  double code_m{kMissing}, phase_m{kMissing};
};

/// Takes what is known out of an observation.
[[nodiscard]] inline ReducedSignal reduce(const SignalObservation& o, const ReceiverLine& line) {
  const double f_hz = frequency_hz(o.signal), ratio = frequency_hz(Constellation::gps, '1') / f_hz;
  const double ionosphere_m = line.ionosphere_l1_m * ratio * ratio;
  ReducedSignal r;
  if (plausible_code(o)) r.code_m = o.code_m + line.reduction_m - ionosphere_m;
  if (plausible_phase(o)) r.phase_m = o.phase_cycles * (kSpeedOfLightMps / f_hz) + line.reduction_m + ionosphere_m;
  return r;
}

}  // namespace searvins::gnss
