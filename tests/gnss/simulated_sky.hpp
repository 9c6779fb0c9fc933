// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// A made-up sky: random Keplerian satellites above a place, and what a receiver there would observe, by its own light-time iteration
/// (full rotation of the Earth during the flight, no Sagnac expansion), free of noise and atmosphere.
#pragma once

#include <Eigen/Core>

#include <cmath>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include <searvins/geodesy/local_frame.hpp>
#include <searvins/gnss/ephemeris.hpp>
#include <searvins/gnss/observation.hpp>
#include <searvins/gnss/satellite.hpp>

#include "support/property.hpp"

namespace searvins::test {

using gnss::Constellation;
using gnss::SatelliteId;
using gnss::SignalCode;

/// A receiver that moves uniformly: p(t) = p0 + v (t - t0), clock offset dt(t) = c0 + c1 (t - t0), tag = t + dt.
struct SimulatedReceiver {
  GpsTime t0{};
  Eigen::Vector3d p0_e_m{Eigen::Vector3d::Zero()}, v_e_mps{Eigen::Vector3d::Zero()};
  double clock_s{0}, drift_sps{0};
  std::vector<SignalCode> signals{};
  std::map<std::pair<SatelliteId, SignalCode>, double> cycles{};  ///< ambiguities, and slips added to them
};

struct SimulatedSky {
  gnss::EphemerisStore<80> store{};
  std::vector<SatelliteId> satellites{};
};

/// A place on the ground away from the poles.
inline Eigen::Vector3d random_place(Rng& rng) {
  return geodesy::ecef_from_geodetic({uniform(rng, -1.1, 1.1), uniform(rng, -3.1, 3.1), uniform(rng, 0, 1500)});
}

/// `counts` satellites of GPS, Galileo and BeiDou that stand above `lowest_rad` at `t` over `p_e_m`.
inline SimulatedSky random_sky(Rng& rng, GpsTime t, const Eigen::Vector3d& p_e_m, std::array<int, 3> counts, double lowest_rad = 0.4) {
  SimulatedSky sky;
  const Constellation constellations[] = {Constellation::gps, Constellation::galileo, Constellation::beidou};
  const gnss::NavigationMessage messages[] = {gnss::NavigationMessage::gps_lnav, gnss::NavigationMessage::galileo_inav,
                                              gnss::NavigationMessage::beidou_d1};
  const double roots[] = {5153.6, 5440.6, 5282.6};
  for (std::size_t c = 0; c < 3; ++c)
    for (int number = 1; number <= counts[c];) {
      gnss::Ephemeris e;
      e.satellite = {constellations[c], static_cast<std::uint8_t>(number)};
      e.message = messages[c];
      e.toe = e.toc = e.transmitted = t.plus_seconds(uniform(rng, -1800, 1800));
      e.sqrt_a = roots[c] + uniform(rng, -0.05, 0.05), e.eccentricity = uniform(rng, 0, 0.02);
      e.i0 = uniform(rng, 0.9, 1.0), e.omega0 = uniform(rng, -3.14, 3.14), e.omega = uniform(rng, -3.14, 3.14),
      e.m0 = uniform(rng, -3.14, 3.14);
      e.delta_n = uniform(rng, 3e-9, 6e-9), e.i_dot = uniform(rng, -5e-10, 5e-10), e.omega_dot = -8e-9;
      e.cuc = uniform(rng, -1e-6, 1e-6), e.cus = uniform(rng, -1e-5, 1e-5), e.crc = uniform(rng, -300, 300),
      e.crs = uniform(rng, -100, 100);
      e.af0 = uniform(rng, -9e-4, 9e-4), e.af1 = uniform(rng, -1e-11, 1e-11);
      const auto state = gnss::satellite_state(e, t);
      if (geodesy::azimuth_elevation(p_e_m, state->position_e_m).elevation_rad < lowest_rad) continue;
      sky.store.insert(e);
      sky.satellites.push_back(e.satellite);
      ++number;
    }
  return sky;
}

/// Code (metres) of a satellite at true time t0 + dt.
inline double simulated_code_m(const gnss::Ephemeris& e, const SimulatedReceiver& r, double dt) {
  const Eigen::Vector3d p = r.p0_e_m + r.v_e_mps * dt;
  double flight_s = 0.07;
  gnss::SatelliteState s;
  for (int i = 0; i < 6; ++i) {
    s = *gnss::satellite_state(e, r.t0.plus_seconds(dt - flight_s));
    const double a = geodesy::kEarthRateRadps * flight_s;
    const Eigen::Vector3d rotated{std::cos(a) * s.position_e_m.x() + std::sin(a) * s.position_e_m.y(),
                                  -std::sin(a) * s.position_e_m.x() + std::cos(a) * s.position_e_m.y(), s.position_e_m.z()};
    flight_s = (p - rotated).norm() / gnss::kSpeedOfLightMps;
  }
  return gnss::kSpeedOfLightMps * (flight_s + r.clock_s + r.drift_sps * dt - s.clock_s);
}

/// The epoch that the receiver records at true time t0 + dt.
inline gnss::ObservationEpoch simulate(const SimulatedSky& sky, const SimulatedReceiver& r, double dt) {
  gnss::ObservationEpoch epoch;
  epoch.tag = r.t0.plus_seconds(dt + r.clock_s + r.drift_sps * dt);
  for (const gnss::Ephemeris& e : sky.store.records()) {
    gnss::SatelliteObservation satellite{e.satellite, {}};
    const double code_m = simulated_code_m(e, r, dt), h = 0.05;
    const double rate_mps = (simulated_code_m(e, r, dt + h) - simulated_code_m(e, r, dt - h)) / (2 * h);
    for (const SignalCode& code : r.signals) {
      if (code.constellation != e.satellite.constellation) continue;
      gnss::SignalObservation o;
      o.signal = code;
      const double wavelength = gnss::wavelength_m(code);
      const auto cycles = r.cycles.find({e.satellite, code});
      o.code_m = code_m;
      o.phase_cycles = code_m / wavelength + (cycles == r.cycles.end() ? 0.0 : cycles->second);
      o.doppler_hz = -rate_mps / wavelength;
      o.cn0_dbhz = 45;
      satellite.signals.push_back(o);
    }
    epoch.satellites.push_back(satellite);
  }
  return epoch;
}

/// Gives every satellite and signal of a receiver an integer ambiguity.
inline void draw_ambiguities(Rng& rng, const SimulatedSky& sky, SimulatedReceiver& r) {
  for (const SatelliteId id : sky.satellites)
    for (const SignalCode& code : r.signals)
      if (code.constellation == id.constellation) r.cycles[{id, code}] = integer(rng, -1000000, 1000000);
}

inline SignalCode signal(const char* text) {
  SignalCode code;
  (void)gnss::signal_from_text(text, 3, code);
  return code;
}

/// Rover and base some kilometres apart under one sky, clocks up to 10 ms off, dual frequency but for BeiDou.
struct SimulatedPair {
  SimulatedSky sky{};
  SimulatedReceiver rover{}, base{};
};

inline SimulatedPair random_pair(Rng& rng, std::array<int, 3> counts, double speed_mps = 20) {
  SimulatedPair s;
  s.base.t0 = s.rover.t0 = GpsTime::from_week_sow(2300 + integer(rng, 0, 50), integer(rng, 4000, 600000));
  s.base.p0_e_m = random_place(rng);
  s.rover.p0_e_m = s.base.p0_e_m + random_vector<3>(rng, 5000);
  s.rover.v_e_mps = random_vector<3>(rng, speed_mps);
  s.rover.clock_s = uniform(rng, -0.01, 0.01), s.base.clock_s = uniform(rng, -0.01, 0.01);
  s.rover.drift_sps = uniform(rng, -1e-7, 1e-7), s.base.drift_sps = uniform(rng, -1e-7, 1e-7);
  s.rover.signals = s.base.signals = {signal("G1C"), signal("G2W"), signal("E1C"), signal("E7Q"), signal("C2I")};
  s.sky = random_sky(rng, s.rover.t0, s.rover.p0_e_m, counts);
  draw_ambiguities(rng, s.sky, s.rover);
  draw_ambiguities(rng, s.sky, s.base);
  return s;
}

}  // namespace searvins::test
