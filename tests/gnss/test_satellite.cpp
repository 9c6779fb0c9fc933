// SPDX-License-Identifier: BSD-3-Clause
// Broadcast orbits: velocity and clock rate against differences, Kepler's equation, two-body limits, group delays, transmission times, and
// the consistency of real records of all constellations.
#include <doctest/doctest.h>

#include <Eigen/Core>

#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include <searvins/geodesy/wgs84.hpp>
#include <searvins/gnss/range.hpp>
#include <searvins/gnss/satellite.hpp>

#include "rover_recordings.hpp"
#include "support/property.hpp"

using namespace searvins;
using namespace searvins::gnss;
using Eigen::Vector3d;
using test::for_all_seeds;
using test::Rng;
using test::uniform;

namespace {

constexpr NavigationMessage kMessages[] = {NavigationMessage::gps_lnav,     NavigationMessage::qzss_lnav, NavigationMessage::galileo_inav,
                                           NavigationMessage::galileo_fnav, NavigationMessage::beidou_d1, NavigationMessage::beidou_d2};

Constellation constellation_of(NavigationMessage m) {
  switch (m) {
    case NavigationMessage::gps_lnav: return Constellation::gps;
    case NavigationMessage::qzss_lnav: return Constellation::qzss;
    case NavigationMessage::galileo_inav:
    case NavigationMessage::galileo_fnav: return Constellation::galileo;
    default: return Constellation::beidou;
  }
}

Ephemeris random_ephemeris(Rng& rng, NavigationMessage message) {
  Ephemeris e;
  e.message = message;
  e.satellite = {constellation_of(message), static_cast<std::uint8_t>(test::integer(rng, 1, 30))};
  e.toe = GpsTime::from_week_sow(test::integer(rng, 1400, 2400), 16 * test::integer(rng, 0, 37799));
  e.toc = e.toe;
  const bool high = message == NavigationMessage::beidou_d2 || message == NavigationMessage::qzss_lnav;
  e.sqrt_a = high ? 6493.4 : uniform(rng, 5150, 5450);
  e.eccentricity = message == NavigationMessage::qzss_lnav ? uniform(rng, 0, 0.08) : uniform(rng, 0, 0.02);
  e.i0 = uniform(rng, 0.05, 1.2), e.omega0 = uniform(rng, -3.14, 3.14), e.omega = uniform(rng, -3.14, 3.14),
  e.m0 = uniform(rng, -3.14, 3.14);
  e.delta_n = uniform(rng, -5e-9, 5e-9), e.i_dot = uniform(rng, -1e-9, 1e-9), e.omega_dot = uniform(rng, -1e-8, 1e-8);
  e.cuc = uniform(rng, -2e-5, 2e-5), e.cus = uniform(rng, -2e-5, 2e-5), e.cic = uniform(rng, -4e-7, 4e-7),
  e.cis = uniform(rng, -4e-7, 4e-7);
  e.crc = uniform(rng, -400, 400), e.crs = uniform(rng, -400, 400);
  e.af0 = uniform(rng, -9e-4, 9e-4), e.af1 = uniform(rng, -1e-11, 1e-11), e.af2 = uniform(rng, -1e-18, 1e-18);
  e.group_delay_s[0] = uniform(rng, -2e-8, 2e-8), e.group_delay_s[1] = uniform(rng, -2e-8, 2e-8);
  return e;
}

Ephemeris random_ephemeris(Rng& rng) { return random_ephemeris(rng, kMessages[test::integer(rng, 0, 5)]); }

}  // namespace

TEST_CASE("satellite: velocity and clock rate are the derivatives of position and clock, every message") {
  for (const NavigationMessage message : kMessages)
    for_all_seeds(60, [message](Rng& rng) {
      const Ephemeris e = random_ephemeris(rng, message);
      const GpsTime t = e.toe.plus_seconds(uniform(rng, -7200, 7200));
      const double h = 0.5;
      const auto now = satellite_state(e, t), before = satellite_state(e, t.plus_seconds(-h)),
                 after = satellite_state(e, t.plus_seconds(h));
      REQUIRE(now);
      const Vector3d numeric = (after->position_e_m - before->position_e_m) / (2 * h);
      CHECK((now->velocity_e_mps - numeric).norm() < 2e-5);
      CHECK(std::abs(now->clock_rate_sps - (after->clock_s - before->clock_s) / (2 * h)) < 1e-15);
    });
}

TEST_CASE("satellite: the eccentric anomaly solves Kepler's equation at every eccentricity") {
  for_all_seeds(500, [](Rng& rng) {
    const double m = uniform(rng, -40, 40), e = uniform(rng, 0, 0.5), E = gnss::detail::eccentric_anomaly(m, e);
    CHECK(std::abs(std::remainder(E - e * std::sin(E) - m, 2 * std::numbers::pi)) < 1e-13);
  });
}

TEST_CASE("satellite: without perturbations the orbit is Kepler's: apsides, area law and energy in inertial axes") {
  for_all_seeds(100, [](Rng& rng) {
    Ephemeris e = random_ephemeris(rng, NavigationMessage::galileo_inav);
    e.delta_n = e.i_dot = e.omega_dot = e.cuc = e.cus = e.cic = e.cis = e.crc = e.crs = 0;
    const double a = e.sqrt_a * e.sqrt_a, mu = 3.986004418e14;
    const auto s = satellite_state(e, e.toe.plus_seconds(uniform(rng, -7200, 7200)));
    const Vector3d p = s->position_e_m, v = s->velocity_e_mps + geodesy::kEarthRateRadps * Vector3d{-p.y(), p.x(), 0};
    CHECK(p.norm() >= a * (1 - e.eccentricity) * (1 - 1e-12));
    CHECK(p.norm() <= a * (1 + e.eccentricity) * (1 + 1e-12));
    CHECK(0.5 * v.squaredNorm() - mu / p.norm() == doctest::Approx(-mu / (2 * a)).epsilon(1e-10));
    CHECK(p.cross(v).norm() == doctest::Approx(std::sqrt(mu * a * (1 - e.eccentricity * e.eccentricity))).epsilon(1e-10));
    CHECK(p.cross(v).normalized().z() == doctest::Approx(std::cos(e.i0)).epsilon(1e-9));
  });
}

TEST_CASE("satellite: a BeiDou geostationary record that stands still over the equator stays there for hours") {
  // In the tilted frame (turned by -5 degrees about x) the equatorial orbit has inclination 5 degrees and ascends through -x.
  Ephemeris e;
  e.message = NavigationMessage::beidou_d2;
  e.satellite = {Constellation::beidou, 1};
  e.toe = e.toc = to_gps(BeidouTime::from_week_sow(900, 0));
  const double rate = 7.2921150e-5, a = std::cbrt(3.986004418e14 / (rate * rate));
  e.sqrt_a = std::sqrt(a);
  e.i0 = 5 * std::numbers::pi / 180;
  e.omega0 = std::numbers::pi;
  e.m0 = 2.0;
  const Vector3d at_toe = satellite_state(e, e.toe)->position_e_m;
  CHECK(std::abs(at_toe.z()) < 1e-3);
  for (double t = -7200; t <= 7200; t += 600) {
    const auto s = satellite_state(e, e.toe.plus_seconds(t));
    CHECK((s->position_e_m - at_toe).norm() < 0.01);
    CHECK(s->velocity_e_mps.norm() < 1e-5);
  }
}

TEST_CASE("satellite: the longitude of the node is counted from the constellation's own week") {
  // The same numbers, toe zero seconds into the week: BeiDou's week begins 14 s after GPS's.
  Ephemeris gps;
  gps.sqrt_a = 5282.6, gps.i0 = 0.9, gps.toe = gps.toc = GpsTime::from_week_sow(2300, 0);
  Ephemeris beidou = gps;
  beidou.message = NavigationMessage::beidou_d1;
  beidou.satellite.constellation = Constellation::beidou;
  beidou.toe = beidou.toc = to_gps(BeidouTime::from_week_sow(2300 - kBeidouWeekOffset, 0));
  const Vector3d p = satellite_state(gps, gps.toe)->position_e_m, q = satellite_state(beidou, beidou.toe)->position_e_m;
  CHECK((p - q).norm() < 1e-6);
  CHECK(seconds_between(gps.toe, beidou.toe) == 14);
}

TEST_CASE("satellite: the clock is the polynomial plus relativity of the sign that slows a satellite near the Earth") {
  for_all_seeds(100, [](Rng& rng) {
    Ephemeris e = random_ephemeris(rng);
    const GpsTime t = e.toc.plus_seconds(uniform(rng, -7000, 7000));
    const double dt = seconds_between(e.toc, t);
    const auto s = satellite_state(e, t);
    const double relativity_s = s->clock_s - (e.af0 + e.af1 * dt + e.af2 * dt * dt);
    const Vector3d v = s->velocity_e_mps + geodesy::kEarthRateRadps * Vector3d{-s->position_e_m.y(), s->position_e_m.x(), 0};
    // -2 r.v / c^2 in inertial axes [IS-GPS-200, 20.3.3.3.3.1]; the records' harmonics and drifts leave 1e-10 s of difference.
    CHECK(relativity_s == doctest::Approx(-2 * s->position_e_m.dot(v) / (kSpeedOfLightMps * kSpeedOfLightMps)).epsilon(1e-3).scale(1e-7));
  });
}

TEST_CASE("satellite: records that are not orbits are refused with their reason") {
  Rng rng{7};
  const Ephemeris good = random_ephemeris(rng, NavigationMessage::gps_lnav);
  REQUIRE(satellite_state(good, good.toe));
  const auto code = [&](auto change) {
    Ephemeris e = good;
    change(e);
    return satellite_state(e, good.toe).status().code;
  };
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK(code([](Ephemeris& e) { e.sqrt_a = 0; }) == StatusCode::invalid_argument);
  CHECK(code([](Ephemeris& e) { e.sqrt_a = 8001; }) == StatusCode::invalid_argument);
  CHECK(code([](Ephemeris& e) { e.sqrt_a = nan; }) == StatusCode::invalid_argument);
  CHECK(code([](Ephemeris& e) { e.eccentricity = 0.5; }) == StatusCode::invalid_argument);
  CHECK(code([](Ephemeris& e) { e.eccentricity = -1e-9; }) == StatusCode::invalid_argument);
  CHECK(code([](Ephemeris& e) { e.af0 = 2; }) == StatusCode::invalid_argument);
  CHECK(code([](Ephemeris& e) { e.m0 = nan; }) == StatusCode::non_finite);
  CHECK(code([](Ephemeris& e) { e.crs = std::numeric_limits<double>::infinity(); }) == StatusCode::non_finite);
  CHECK(code([](Ephemeris& e) { e.af2 = nan; }) == StatusCode::non_finite);
  Ephemeris stated = good;
  stated.accuracy_m = 2;
  CHECK(satellite_state(stated, good.toe)->variance_m2 == 4);
  CHECK(satellite_state(good, good.toe)->variance_m2 > 4);  // unknown accuracy is not zero
}

TEST_CASE("group delays: the clock reference of each system is free of them") {
  for_all_seeds(50, [](Rng& rng) {
    const auto delay = [](const Ephemeris& e, char band) { return group_delay_s(e, {e.satellite.constellation, band, 'X'}); };
    const auto gamma = [](Constellation c, char band) { return std::pow(frequency_hz(c, '1') / frequency_hz(c, band), 2); };
    /// The ionosphere-free combination of two bands cancels what is proportional to 1/f^2; a reference combination leaves 0.
    const auto free_of = [&](const Ephemeris& e, char band) {
      const double g = gamma(e.satellite.constellation, band);
      return (g * delay(e, '1') - delay(e, band)) / (g - 1);
    };
    const Ephemeris gps = random_ephemeris(rng, NavigationMessage::gps_lnav);
    CHECK(delay(gps, '1') == gps.group_delay_s[0]);
    CHECK(std::abs(free_of(gps, '2')) < 1e-22);
    Ephemeris inav = random_ephemeris(rng, NavigationMessage::galileo_inav);
    CHECK(std::abs(free_of(inav, '7')) < 1e-22);
    CHECK(delay(inav, '1') == inav.group_delay_s[1]);
    Ephemeris fnav = inav;
    fnav.message = NavigationMessage::galileo_fnav;
    CHECK(std::abs(free_of(fnav, '5')) < 1e-22);
    // Whichever message: the delay of one band against another is a property of the satellite.
    for (const char band : {'5', '7', '8'})
      CHECK(delay(inav, band) - delay(inav, '1') == doctest::Approx(delay(fnav, band) - delay(fnav, '1')));
    const Ephemeris beidou = random_ephemeris(rng, NavigationMessage::beidou_d1);
    CHECK(delay(beidou, '6') == 0);
    CHECK(delay(beidou, '2') == beidou.group_delay_s[0]);
    CHECK(delay(beidou, '7') == beidou.group_delay_s[1]);
    CHECK(delay(beidou, '3') == 0);  // no such band
  });
}

TEST_CASE("transmission: independent of the receiver's clock, and the satellite was there when it sent") {
  for_all_seeds(200, [](Rng& rng) {
    EphemerisStore<4> store;
    const Ephemeris e = random_ephemeris(rng);
    REQUIRE(store.insert(e));
    const GpsTime sent = e.toe.plus_seconds(uniform(rng, -3600, 3600));
    const auto truth = satellite_state(e, sent);
    const double flight_s = uniform(rng, 0.065, 0.13), clock_s = uniform(rng, -0.5, 0.5);
    const GpsTime tag = sent.plus_seconds(flight_s).plus_seconds(clock_s);
    const auto t = transmission_from_code(store, e.satellite, tag, kSpeedOfLightMps * (flight_s + clock_s - truth->clock_s));
    REQUIRE(t);
    CHECK(std::abs(seconds_between(sent, t->time)) < 4e-9);
    CHECK((t->state.position_e_m - truth->position_e_m).norm() < 2e-5);
    CHECK(t->ephemeris == &store.records()[0]);
  });
}

TEST_CASE("transmission: bad codes, missing, unhealthy and old records") {
  Rng rng{3};
  EphemerisStore<4> store;
  Ephemeris e = random_ephemeris(rng, NavigationMessage::gps_lnav);
  REQUIRE(store.insert(e));
  const auto code_of = [&](SatelliteId id, GpsTime tag, double code_m) {
    return transmission_from_code(store, id, tag, code_m).status().code;
  };
  CHECK(code_of(e.satellite, e.toe, 2.2e7) == StatusCode::ok);
  CHECK(code_of(e.satellite, e.toe, kMissing) == StatusCode::non_finite);
  CHECK(code_of(e.satellite, e.toe, std::numeric_limits<double>::infinity()) == StatusCode::non_finite);
  CHECK(code_of(e.satellite, e.toe, 1e12) == StatusCode::invalid_argument);
  CHECK(code_of({Constellation::galileo, 5}, e.toe, 2.2e7) == StatusCode::no_data);
  CHECK(code_of(e.satellite, e.toe.plus_seconds(7199), 2.2e7) == StatusCode::ok);
  CHECK(code_of(e.satellite, e.toe.plus_seconds(7201), 2.2e7) == StatusCode::no_data);
  e.health = 1;
  REQUIRE(store.insert(e));
  CHECK(code_of(e.satellite, e.toe, 2.2e7) == StatusCode::no_data);
}

TEST_CASE("real records: radius and speed, geostationary longitudes, and neighbouring records that meet") {
  const auto shared = test::shared_data();
  if (!shared) {
    MESSAGE("SKIPPED: shared data not found");
    return;
  }
  int overlaps = 0, geostationary = 0;
  double worst_m[kConstellations] = {}, worst_clock_m[kConstellations] = {};
  for (const test::RoverRecording& r :
       {test::nagoya_rover(*shared), test::tokyo_rover(*shared), test::kamakura_rover(*shared), test::geonet_rover(*shared)}) {
    const auto& records = r.store->records();
    for (std::size_t i = 0; i < records.size(); ++i) {
      const Ephemeris& e = records[i];
      if (e.health != 0) continue;
      const auto s = satellite_state(e, e.toe);
      REQUIRE(s);
      const Vector3d inertial = s->velocity_e_mps + geodesy::kEarthRateRadps * Vector3d{-s->position_e_m.y(), s->position_e_m.x(), 0};
      const double circular_mps = std::sqrt(3.986005e14 / s->position_e_m.norm());
      CHECK(inertial.norm() == doctest::Approx(circular_mps).epsilon(0.05));
      CHECK(s->position_e_m.norm() > 2.5e7);
      CHECK(s->position_e_m.norm() < 4.6e7);
      if (e.message == NavigationMessage::beidou_d2) {
        ++geostationary;
        CHECK(s->position_e_m.norm() == doctest::Approx(4.2164e7).epsilon(0.003));
        CHECK(s->velocity_e_mps.norm() < 250);  // inclined by up to 2 degrees
        const auto later = satellite_state(e, e.toe.plus_seconds(3600));
        CHECK(std::abs(std::remainder(
                  geodesy::geodetic_from_ecef(later->position_e_m).lon_rad - geodesy::geodetic_from_ecef(s->position_e_m).lon_rad,
                  2 * std::numbers::pi)) < 0.003);
      }
      if (i + 1 == records.size() || records[i + 1].satellite != e.satellite || records[i + 1].message != e.message ||
          records[i + 1].health != 0)
        continue;
      const Ephemeris& next = records[i + 1];
      const double gap_s = seconds_between(e.toe, next.toe);
      if (gap_s < 60 || gap_s > 7200) continue;
      const GpsTime middle = e.toe.plus_seconds(gap_s / 2);
      const auto a = satellite_state(e, middle), b = satellite_state(next, middle);
      const std::size_t c = static_cast<std::size_t>(e.satellite.constellation);
      worst_m[c] = std::max(worst_m[c], (a->position_e_m - b->position_e_m).norm());
      worst_clock_m[c] = std::max(worst_clock_m[c], kSpeedOfLightMps * std::abs(a->clock_s - b->clock_s));
      CHECK((a->velocity_e_mps - b->velocity_e_mps).norm() < 0.01);
      ++overlaps;
    }
  }
  for (std::size_t c = 0; c < kConstellations; ++c)
    MESSAGE(std::string(name_of(static_cast<Constellation>(c)))
            << ": orbits meet within " << worst_m[c] << " m, clocks within " << worst_clock_m[c] << " m");
  CHECK(overlaps > 50);
  CHECK(geostationary > 10);
  for (const double m : worst_m) CHECK(m < 12);
  for (const double m : worst_clock_m) CHECK(m < 6);
}
