// SPDX-License-Identifier: BSD-3-Clause
// Sigma models: the tables they must reproduce, growth with age, look-up rules, and both sides of every screen.
#include <doctest/doctest.h>

#include <cmath>
#include <limits>

#include <searvins/gnss/weighting.hpp>

#include "examples/support/angle_units.hpp"
#include "support/property.hpp"

using namespace searvins;
using namespace searvins::gnss;
using test::for_all_seeds;
using test::Rng;
using test::uniform;

namespace {
using searvins::examples::kRadPerDeg;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

double sigma_m(const SigmaModel& m, const SignalCode& s, double elevation_deg) {
  return std::sqrt(m.code_variance_m2(s, elevation_deg * kRadPerDeg));
}
}  // namespace

TEST_CASE("urban profile: sigmas of the published table at 15, 30, 45, 60 and 90 degrees") {
  const SigmaModel m = urban_profile();
  struct Row {
    SignalCode signal;
    double sigma_m[5];
  };
  const Row table[] = {{{Constellation::gps, '1', 'C'}, {7.64, 4.10, 3.04, 2.59, 2.33}},
                       {{Constellation::gps, '2', 'W'}, {7.83, 4.44, 3.48, 3.09, 2.88}},
                       {{Constellation::galileo, '1', 'C'}, {7.83, 4.44, 3.48, 3.09, 2.88}},
                       {{Constellation::galileo, '7', 'Q'}, {9.51, 5.25, 4.00, 3.49, 3.20}},
                       {{Constellation::beidou, '2', 'I'}, {5.37, 2.99, 2.29, 2.01, 1.86}}};
  const double elevations_deg[] = {15, 30, 45, 60, 90};
  for (const Row& row : table)
    for (int i = 0; i < 5; ++i) CHECK(sigma_m(m, row.signal, elevations_deg[i]) == doctest::Approx(row.sigma_m[i]).epsilon(0.003));
  const double phase_m[] = {0.0236, 0.0127, 0.0095, 0.0081, 0.0073};
  for (int i = 0; i < 5; ++i)
    CHECK(std::sqrt(m.phase_variance_m2(table[0].signal, elevations_deg[i] * kRadPerDeg)) == doctest::Approx(phase_m[i]).epsilon(0.01));
  CHECK(m.doppler_variance_m2ps2() == 0.25);
}

TEST_CASE("symmetric form: RTKLIB's sigmas for a = b = 3 mm and a code ratio of 300") {
  SigmaModel m;
  m.form = SigmaForm::symmetric;
  m.other.code = {0.9, 0.9};
  m.other.phase = {0.003, 0.003};
  const double elevations_deg[] = {15, 30, 45, 60, 90}, code_m[] = {5.08, 2.85, 2.21, 1.94, 1.80};
  for (int i = 0; i < 5; ++i)
    CHECK(sigma_m(m, {Constellation::gps, '1', 'C'}, elevations_deg[i]) == doctest::Approx(code_m[i]).epsilon(0.004));
  CHECK(std::sqrt(m.phase_variance_m2({}, 15 * kRadPerDeg)) == doctest::Approx(0.0169).epsilon(0.004));
}

TEST_CASE("every form: falls with elevation, finite at and below the horizon, undifferenced half, grows with age either way") {
  for_all_seeds(100, [](Rng& rng) {
    SigmaModel m = test::chance(rng, 0.5) ? urban_profile() : geodetic_profile();
    m.form = test::chance(rng, 0.5) ? SigmaForm::elevation : SigmaForm::symmetric;
    const SignalCode s{Constellation::gps, '1', 'C'};
    const double low = uniform(rng, 0.06, 1.0), high = low + uniform(rng, 0.05, 0.5), age_s = uniform(rng, 1, 30);
    CHECK(m.code_variance_m2(s, low) > m.code_variance_m2(s, high));
    CHECK(m.code_variance_m2(s, 0) == m.code_variance_m2(s, kLowestWeightedElevationRad));
    CHECK(m.code_variance_m2(s, -1) == m.code_variance_m2(s, 0));
    CHECK(std::isfinite(m.phase_variance_m2(s, 0)));
    CHECK(m.undifferenced_code_variance_m2(s, low) == doctest::Approx(0.5 * m.code_variance_m2(s, low)));
    const double grown = m.phase_variance_m2(s, low, age_s) - m.phase_variance_m2(s, low);
    CHECK(grown == doctest::Approx(std::pow(m.phase_growth_mps * age_s, 2)).epsilon(1e-6));
    CHECK(m.phase_variance_m2(s, low, -age_s) == m.phase_variance_m2(s, low, age_s));
    CHECK(m.code_variance_m2(s, low, age_s) > m.code_variance_m2(s, low));
  });
}

TEST_CASE("look-up: exact signal, then same carrier, then the rest; entry() makes, finds and refuses when full") {
  SigmaModel m = urban_profile();
  CHECK(m.of({Constellation::gps, '2', 'W'}).code == SigmaPair{1.50, 1.95});
  CHECK(m.of({Constellation::gps, '2', 'X'}).code == SigmaPair{1.50, 1.95});  // another tracking mode of the carrier
  CHECK(m.of({Constellation::qzss, '1', 'C'}).code == m.other.code);
  SignalSigma* made = m.entry({Constellation::gps, '1', 'X'});
  REQUIRE(made);
  CHECK(made->code == SigmaPair{0.90, 1.95});  // starts from the carrier's
  made->code = {0.1, 0.2};
  CHECK(m.of({Constellation::gps, '1', 'X'}).code == SigmaPair{0.1, 0.2});
  CHECK(m.of({Constellation::gps, '1', 'C'}).code == SigmaPair{0.90, 1.95});
  CHECK(m.entry({Constellation::gps, '1', 'X'}) == &m.signals.back());
  while (m.signals.size() < SigmaModel::kMaxSignals)
    REQUIRE(m.entry({Constellation::beidou, '5', static_cast<char>('A' + static_cast<int>(m.signals.size()))}));
  CHECK(m.entry({Constellation::qzss, '5', 'Q'}) == nullptr);
  CHECK(m.entry({Constellation::gps, '1', 'C'}) != nullptr);
}

TEST_CASE("geodetic profile: 0.3 / 0.3 m and 3 / 3 mm whatever the signal") {
  const SigmaModel m = geodetic_profile();
  CHECK(m.of({Constellation::galileo, '5', 'Q'}).code == SigmaPair{0.3, 0.3});
  CHECK(m.of({Constellation::gps, '1', 'C'}).phase == SigmaPair{0.003, 0.003});
  CHECK(sigma_m(m, {}, 90) == doctest::Approx(std::sqrt(3.0) * 0.3));
}

TEST_CASE("screens: both sides of each limit, and what is missing") {
  const Screening limits{15 * kRadPerDeg, 20};
  SignalObservation s;
  CHECK(strong_enough(s, limits));  // no C/N0: benefit of the doubt
  s.cn0_dbhz = 20;
  CHECK(strong_enough(s, limits));
  s.cn0_dbhz = 19.99;
  CHECK_FALSE(strong_enough(s, limits));

  CHECK(high_enough(15 * kRadPerDeg, limits));
  CHECK_FALSE(high_enough(14.99 * kRadPerDeg, limits));
  CHECK_FALSE(high_enough(kNaN, limits));

  CHECK_FALSE(plausible_code(s));
  for (const double bad : {0.0, 100.0, -2e7, std::numeric_limits<double>::infinity(), kNaN}) {
    s.code_m = bad;
    CHECK_FALSE(plausible_code(s));
  }
  s.code_m = 100.1;
  CHECK(plausible_code(s));

  CHECK_FALSE(plausible_phase(s));
  s.phase_cycles = -101;
  CHECK(plausible_phase(s));
  s.phase_cycles = 99;
  CHECK_FALSE(plausible_phase(s));
}

TEST_CASE("C/N0: no reward above 45 dB-Hz, a decade of variance below for every step, none without a value") {
  CHECK(cn0_variance_factor(55) == 1);
  CHECK(cn0_variance_factor(45) == 1);
  CHECK(cn0_variance_factor(35) == doctest::Approx(10));
  CHECK(cn0_variance_factor(35, 5) == doctest::Approx(100));
  CHECK(cn0_variance_factor(kNaN) == 1);
}
