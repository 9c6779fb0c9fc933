// SPDX-License-Identifier: BSD-3-Clause
// Ionosphere and troposphere: published example values, a noise-free simulator that uses the same ionosphere, and the seams of the models.
#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include <searvins/gnss/atmosphere.hpp>
#include <searvins/gnss/satellite.hpp>

#include "examples/support/angle_units.hpp"
#include "rover_recordings.hpp"
#include "support/property.hpp"

using namespace searvins;
using namespace searvins::gnss;
using geodesy::AzimuthElevation;
using geodesy::Geodetic;
using test::for_all_seeds;
using test::Rng;
using test::uniform;

namespace {
using searvins::examples::kRadPerDeg;
constexpr double kL1Hz = 1575.42e6;
const KlobucharCoefficients kExample{{3.82e-8, 1.49e-8, -1.79e-7, 0}, {1.43e5, 0, -3.28e5, 1.13e5}};

AzimuthElevation random_line(Rng& rng) { return {uniform(rng, -3.14, 3.14), uniform(rng, 0.1, 1.57)}; }
Geodetic random_place(Rng& rng) { return {uniform(rng, -1.3, 1.3), uniform(rng, -3.14, 3.14), uniform(rng, 0, 3000)}; }
}  // namespace

TEST_CASE("Klobuchar: the textbook example, 40 N 100 W, azimuth 210, elevation 20, 20:45 GPS time") {
  const double delay_m = klobuchar_delay_m(kExample, {40 * kRadPerDeg, -100 * kRadPerDeg, 0}, {210 * kRadPerDeg, 20 * kRadPerDeg},
                                           GpsTime::from_week_sow(1000, 593'100), kL1Hz);
  CHECK(delay_m == doctest::Approx(23.784).epsilon(2e-4));
}

TEST_CASE(
    "Klobuchar: scales with the inverse square of the carrier, repeats every day, does not depend on the turn that azimuth is given in") {
  for_all_seeds(100, [](Rng& rng) {
    const Geodetic g = random_place(rng);
    const AzimuthElevation line = random_line(rng);
    const GpsTime t = GpsTime::from_week_sow(2300, uniform(rng, 0, 500'000));
    const double l1 = klobuchar_delay_m(kExample, g, line, t, kL1Hz);
    CHECK(klobuchar_delay_m(kExample, g, line, t, 1227.60e6) == doctest::Approx(l1 * std::pow(1575.42 / 1227.60, 2)).epsilon(1e-12));
    CHECK(klobuchar_delay_m(kExample, g, line, t.plus_seconds(86'400), kL1Hz) == doctest::Approx(l1).epsilon(1e-9));
    const AzimuthElevation turned{line.azimuth_rad + 2 * std::numbers::pi, line.elevation_rad};
    CHECK(klobuchar_delay_m(kExample, g, turned, t, kL1Hz) == doctest::Approx(l1).epsilon(1e-9));
    CHECK(l1 >= 5e-9 * kSpeedOfLightMps);  // never below the night value at the zenith
    CHECK(l1 < 150);
  });
}

TEST_CASE("Klobuchar: continuous over the day but for the foot of the half cosine, 5 ns at night, no coefficients: night everywhere") {
  const Geodetic g{0.6, 2.4, 50};
  double largest_step_m = 0, lowest_m = 1e9, before_m = -1;
  for (int minute = 0; minute <= 1440; ++minute) {
    const double m = klobuchar_delay_m(kExample, g, {0.3, 1.5}, GpsTime::from_week_sow(2300, 60.0 * minute), kL1Hz);
    if (before_m >= 0) largest_step_m = std::max(largest_step_m, std::abs(m - before_m));
    lowest_m = std::min(lowest_m, m);
    before_m = m;
  }
  CHECK(largest_step_m < 0.25);  // the truncated cosine series ends at 2 % of its amplitude
  CHECK(lowest_m == doctest::Approx(5e-9 * kSpeedOfLightMps).epsilon(0.01));
  const double none_m = klobuchar_delay_m({}, g, {0.3, std::numbers::pi / 2}, GpsTime::from_week_sow(2300, 0), kL1Hz);
  CHECK(none_m == doctest::Approx(5e-9 * kSpeedOfLightMps).epsilon(0.001));
  CHECK(kTypicalIonosphere.present());
}

TEST_CASE("Saastamoinen: textbook zenith delays, falling with height") {
  const ZenithDelay sea = saastamoinen_zenith({45 * kRadPerDeg, 0, 0}, 0.7);
  CHECK(sea.hydrostatic_m == doctest::Approx(2.307).epsilon(1e-3));  // 0.0022768 * 1013.25 hPa
  CHECK(sea.wet_m > 0.08);
  CHECK(sea.wet_m < 0.16);
  const ZenithDelay high = saastamoinen_zenith({45 * kRadPerDeg, 0, 5500}, 0.7);
  CHECK(high.hydrostatic_m == doctest::Approx(0.5 * sea.hydrostatic_m).epsilon(0.03));  // half of the air is above 5.5 km
  CHECK(saastamoinen_zenith({0, 0, 0}, 0).wet_m == 0);
  double before_m = 10;
  for (double h = -1500; h < 60'000; h += 250) {
    const double now_m = saastamoinen_zenith({0.5, 0, h}).total_m();
    CHECK(now_m <= before_m);
    CHECK(now_m >= 0);
    before_m = now_m;
  }
}

TEST_CASE("troposphere: the mapping is 1 at the zenith, cosecant down to 30 degrees, 5.6 at 10, finite below the horizon") {
  CHECK(troposphere_mapping(std::numbers::pi / 2) == doctest::Approx(1).epsilon(1e-5));
  CHECK(troposphere_mapping(30 * kRadPerDeg) == doctest::Approx(2).epsilon(0.005));
  CHECK(troposphere_mapping(10 * kRadPerDeg) == doctest::Approx(5.60).epsilon(0.005));
  CHECK(troposphere_mapping(-0.5) == troposphere_mapping(0.05));
  double before = 1e9;
  for (double e = 0.05; e < 1.57; e += 0.01) {
    CHECK(troposphere_mapping(e) < before);
    before = troposphere_mapping(e);
  }
}

TEST_CASE("troposphere: the rover-base difference is antisymmetric, zero at one height, 0.3 mm per metre at the zenith") {
  for_all_seeds(100, [](Rng& rng) {
    const Geodetic rover = random_place(rng), base = random_place(rng);
    const double er = uniform(rng, 0.2, 1.5), eb = er + uniform(rng, -1e-3, 1e-3);
    const double forth = troposphere_difference_m(rover, er, base, eb), back = troposphere_difference_m(base, eb, rover, er);
    CHECK(forth == doctest::Approx(-back).epsilon(1e-12));
    CHECK(troposphere_difference_m(rover, er, rover, er) == 0);
    Geodetic above = rover;
    above.height_m += 100;
    CHECK(troposphere_difference_m(above, er, rover, er) < 0);
  });
  const Geodetic base{35 * kRadPerDeg, 137 * kRadPerDeg, 100}, rover{35 * kRadPerDeg, 137 * kRadPerDeg, 37};
  CHECK(troposphere_difference_m(rover, std::numbers::pi / 2, base, std::numbers::pi / 2) == doctest::Approx(63 * 0.3e-3).epsilon(0.15));
}

TEST_CASE("Klobuchar against a signal simulator: L1 and L2 codes differ by the modelled ionosphere and TGD, to 1 cm") {
  const auto shared = test::shared_data();
  if (!shared) {
    MESSAGE("SKIPPED: shared data not found");
    return;
  }
  const test::RoverRecording r = test::spirent_rover(*shared);
  REQUIRE(r.epochs.size() > 500);
  double worst_m = 0;
  int count = 0;
  for (std::size_t k = 0; k < r.epochs.size(); k += 100) {
    const Eigen::Vector3d p = *r.truth(r.epochs[k].tag);
    for (const SatelliteObservation& s : r.epochs[k].satellites) {
      const SignalObservation* l1 = s.find({Constellation::gps, '1', 'C'});
      const SignalObservation* l2 = s.find({Constellation::gps, '2', 'X'});
      if (!l1 || !l2) continue;
      const Result<Transmission> t = transmission_from_code(*r.store, s.satellite, r.epochs[k].tag, l1->code_m);
      REQUIRE(t);
      const AzimuthElevation line = geodesy::azimuth_elevation(p, t->state.position_e_m);
      const auto delay_m = [&](const SignalObservation& o) {
        return klobuchar_delay_m(r.store->ionosphere, geodesy::geodetic_from_ecef(p), line, t->time, frequency_hz(o.signal)) +
               kSpeedOfLightMps * group_delay_s(*t->ephemeris, o.signal);
      };
      worst_m = std::max(worst_m, std::abs((l2->code_m - l1->code_m) - (delay_m(*l2) - delay_m(*l1))));
      ++count;
    }
  }
  MESSAGE(count << " code pairs, largest disagreement " << worst_m << " m");
  CHECK(count > 50);
  CHECK(worst_m < 0.01);
}
