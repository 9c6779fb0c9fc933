// SPDX-License-Identifier: BSD-3-Clause
// Reduction of one receiver's observations: signs, scaling, missing values.
#include <doctest/doctest.h>

#include <searvins/gnss/reduction.hpp>

#include "gnss/simulated_sky.hpp"
#include "support/property.hpp"

using namespace searvins;
using namespace searvins::gnss;
using namespace searvins::test;

TEST_CASE("reduced code less range is the receiver clock, whatever it is; the line of a base leaves the clock alone") {
  for_all_seeds(20, [](Rng& rng) {
    const SimulatedPair s = random_pair(rng, {4, 4, 3}, 0);
    const ObservationEpoch epoch = simulate(s.sky, s.rover, 0);
    const ReceiverPlace place = ReceiverPlace::at(epoch.tag, s.rover.p0_e_m);
    const DelayModels vacuum{false, {}};
    for (const SatelliteObservation& o : epoch.satellites) {
      const auto e = s.sky.store.select(o.satellite, epoch.tag);
      const double code_m = o.signals[0].code_m, clock_m = kSpeedOfLightMps * s.rover.clock_s;
      const auto state = state_from_code(*e, epoch.tag, code_m);
      REQUIRE(state.ok());
      const ReducedSignal r = reduce(o.signals[0], line_of(*state, place, vacuum));
      CHECK(std::abs(r.code_m - range_m(s.rover.p0_e_m, state->position_e_m) - clock_m) < 1e-3);
      const auto base = base_line_of(*e, place, code_m, vacuum);
      REQUIRE(base.ok());
      CHECK(std::abs(reduce(o.signals[0], *base).code_m - clock_m) < 1e-3);
      const double cycles = s.rover.cycles.at({o.satellite, o.signals[0].signal});
      CHECK(std::abs(reduce(o.signals[0], *base).phase_m - clock_m - cycles * wavelength_m(o.signals[0].signal)) < 1e-3);
    }
  });
}

TEST_CASE("troposphere delays both, the ionosphere delays the code and advances the phase, by the square of the wavelength") {
  for_all_seeds(20, [](Rng& rng) {
    const SimulatedPair s = random_pair(rng, {3, 0, 0}, 0);
    const ObservationEpoch epoch = simulate(s.sky, s.rover, 0);
    const ReceiverPlace place = ReceiverPlace::at(epoch.tag, s.rover.p0_e_m);
    const SatelliteObservation& o = epoch.satellites[0];
    const auto state = state_from_code(*s.sky.store.select(o.satellite, epoch.tag), epoch.tag, o.signals[0].code_m);
    const ReceiverLine vacuum = line_of(*state, place, {false, {}}), wet = line_of(*state, place, {true, {}}),
                       both = line_of(*state, place, {true, kTypicalIonosphere});
    for (const SignalObservation& x : o.signals) {
      const ReducedSignal a = reduce(x, vacuum), b = reduce(x, wet), c = reduce(x, both);
      CHECK(a.code_m - b.code_m > 0.8);  // up to 6 km high
      CHECK(a.code_m - b.code_m == doctest::Approx(a.phase_m - b.phase_m).epsilon(1e-5));
      const double ratio = frequency_hz(Constellation::gps, '1') / frequency_hz(x.signal);
      CHECK(b.code_m - c.code_m == doctest::Approx(both.ionosphere_l1_m * ratio * ratio).epsilon(1e-5));
      CHECK(c.phase_m - b.phase_m == doctest::Approx(both.ionosphere_l1_m * ratio * ratio).epsilon(1e-5));
      CHECK(both.ionosphere_l1_m > 1.0);
    }
  });
}

TEST_CASE("what is no observation stays missing") {
  SignalObservation o;
  o.signal = {Constellation::gps, '1', 'C'};
  CHECK(!std::isfinite(reduce(o, {}).code_m));
  CHECK(!std::isfinite(reduce(o, {}).phase_m));
  o.code_m = 50, o.phase_cycles = 1e8;  // 50 m is a lost channel
  CHECK(!std::isfinite(reduce(o, {}).code_m));
  CHECK(std::isfinite(reduce(o, {}).phase_m));
  for (const double code_m : {1e12, -1e300, kMissing, 1 / 0.0})
    CHECK(state_from_code({}, {}, code_m).status().code == StatusCode::invalid_argument);
}
