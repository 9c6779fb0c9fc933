// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Rover and base epochs of a simulated drive (gnss/simulated_sky.hpp) with noise, to be spoiled by a test and fed to the estimator.
#pragma once

#include <vector>

#include <searvins/gnss/atmosphere.hpp>
#include <searvins/gnss/satellite.hpp>

#include "estimator/rtk_under_test.hpp"
#include "gnss/simulated_sky.hpp"

namespace searvins::test {

struct Noise {
  double code_m{0.3}, phase_m{0.002}, doppler_mps{0.03};
};

/// Epochs at t0 + k * interval_s. The base stands some hundred metres away and records at the same times.
struct Drive {
  SimulatedPair pair{};
  std::vector<gnss::ObservationEpoch> rover{}, base{};

  [[nodiscard]] Eigen::Vector3d truth_e_m(GpsTime t) const { return pair.rover.p0_e_m + pair.rover.v_e_mps * seconds_between(pair.rover.t0, t); }
  [[nodiscard]] double error_m(const estimator::RtkSolution& s) const { return (s.position_e_m - truth_e_m(s.time)).norm(); }
};

inline void add_noise(Rng& rng, gnss::ObservationEpoch& epoch, const Noise& noise) {
  for (auto& satellite : epoch.satellites)
    for (auto& s : satellite.signals) {
      const double wavelength_m = gnss::wavelength_m(s.signal);
      s.code_m += normal(rng, noise.code_m);
      s.phase_cycles += normal(rng, noise.phase_m) / wavelength_m;
      s.doppler_hz += normal(rng, noise.doppler_mps) / wavelength_m;
    }
}

/// Adds the atmosphere of the library's models to what a receiver at p_e_m observes.
inline void add_atmosphere(const SimulatedSky& sky, const Eigen::Vector3d& p_e_m, gnss::ObservationEpoch& epoch) {
  const geodesy::Geodetic g = geodesy::geodetic_from_ecef(p_e_m);
  for (auto& satellite : epoch.satellites) {
    const auto sent = gnss::transmission_from_code(sky.store, satellite.satellite, epoch.tag, satellite.signals[0].code_m);
    if (!sent) continue;
    const auto line = geodesy::azimuth_elevation(p_e_m, sent->state.position_e_m);
    const double troposphere_m = gnss::troposphere_delay_m(g, line.elevation_rad);
    for (auto& s : satellite.signals) {
      const double ionosphere_m = gnss::klobuchar_delay_m(gnss::kTypicalIonosphere, g, line, sent->time, gnss::frequency_hz(s.signal));
      s.code_m += troposphere_m + ionosphere_m;
      s.phase_cycles += (troposphere_m - ionosphere_m) / gnss::wavelength_m(s.signal);
    }
  }
}

/// A slip of `cycles` on a satellite's signal from epoch `first` on.
struct Slip {
  std::size_t first{0};
  gnss::SatelliteId satellite{};
  gnss::SignalCode signal{};
  double cycles{1};
};

inline Drive simulated_drive(Rng& rng, std::size_t epochs, std::array<int, 3> counts = {6, 5, 4}, double interval_s = 1, const std::vector<Slip>& slips = {},
                             const Noise& noise = {}) {
  Drive d;
  d.pair = random_pair(rng, counts, 8);
  d.pair.rover.p0_e_m = d.pair.base.p0_e_m + random_vector<3>(rng, 300);
  d.pair.sky = random_sky(rng, d.pair.rover.t0, d.pair.rover.p0_e_m, counts, 0.35);
  draw_ambiguities(rng, d.pair.sky, d.pair.rover);
  draw_ambiguities(rng, d.pair.sky, d.pair.base);
  for (std::size_t k = 0; k < epochs; ++k) {
    for (const Slip& slip : slips)
      if (slip.first == k) d.pair.rover.cycles[{slip.satellite, slip.signal}] += slip.cycles;
    d.rover.push_back(simulate(d.pair.sky, d.pair.rover, interval_s * static_cast<double>(k)));
    d.base.push_back(simulate(d.pair.sky, d.pair.base, interval_s * static_cast<double>(k)));
    const double t = interval_s * static_cast<double>(k);
    add_atmosphere(d.pair.sky, d.pair.rover.p0_e_m + t * d.pair.rover.v_e_mps, d.rover.back());
    add_atmosphere(d.pair.sky, d.pair.base.p0_e_m, d.base.back());
    add_noise(rng, d.rover.back(), noise);
    add_noise(rng, d.base.back(), noise);
  }
  return d;
}

/// The library's defaults.
inline estimator::RtkOptions simulation_options() { return {}; }

inline RtkUnderTest estimator_for(const Drive& d, const estimator::RtkOptions& options = simulation_options()) {
  RtkUnderTest rtk{options};
  for (const gnss::Ephemeris& e : d.pair.sky.store.records()) (void)rtk.add_ephemeris(e);
  (void)rtk.set_base_position(d.pair.base.p0_e_m);
  return rtk;
}

/// Epoch k of rover and base.
inline Result<estimator::RtkSolution> feed(RtkUnderTest& rtk, const Drive& d, std::size_t k, bool with_base = true) {
  if (with_base) (void)rtk.add_base(d.base[k]);
  return rtk.update(d.rover[k]);
}

}  // namespace searvins::test
