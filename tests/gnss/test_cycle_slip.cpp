// SPDX-License-Identifier: BSD-3-Clause
// The geometry-free test and the rule that turns evidence into a verdict.
#include <doctest/doctest.h>

#include <array>
#include <vector>

#include <searvins/gnss/cycle_slip.hpp>
#include <searvins/gnss/observation.hpp>
#include <searvins/gnss/signal.hpp>

#include "support/property.hpp"

using namespace searvins;
using namespace searvins::gnss;
using namespace searvins::test;

namespace {

std::vector<CheckResult> geometry_free(const std::vector<double>& change_m, double threshold_m = 0.05) {
  std::vector<CheckResult> results(change_m.size(), CheckResult::passed);
  geometry_free_check(change_m, threshold_m, results);
  return results;
}

ContinuityEvidence sound() {
  ContinuityEvidence e;
  e.known = e.consecutive = true;
  e.geometry_free = CheckResult::passed;
  return e;
}

}  // namespace

TEST_CASE("geometry-free: common changes cancel, a slip of any carrier pair but the blind ones is seen, both signals are suspect") {
  const SignalCode pairs[][2] = {{{Constellation::gps, '1', 'C'}, {Constellation::gps, '2', 'W'}},
                                 {{Constellation::gps, '1', 'C'}, {Constellation::gps, '5', 'Q'}},
                                 {{Constellation::galileo, '1', 'C'}, {Constellation::galileo, '7', 'Q'}},
                                 {{Constellation::beidou, '2', 'I'}, {Constellation::beidou, '6', 'I'}}};
  for_all_seeds(200, [&](Rng& rng) {
    const auto& pair = pairs[integer(rng, 0, 3)];
    const double common_m = uniform(rng, -500, 500), slip_m[] = {wavelength_m(pair[0]), wavelength_m(pair[1])};
    const auto change = [&](int n1, int n2) {
      return std::vector<double>{common_m + n1 * slip_m[0] + normal(rng, 0.003), common_m + n2 * slip_m[1] + normal(rng, 0.003)};
    };
    CHECK(geometry_free(change(0, 0)) == std::vector<CheckResult>(2, CheckResult::passed));
    const int sign = chance(rng, 0.5) ? 1 : -1;
    CHECK(geometry_free(change(sign, 0)) == std::vector<CheckResult>(2, CheckResult::failed));
    CHECK(geometry_free(change(0, sign)) == std::vector<CheckResult>(2, CheckResult::failed));
    CHECK(geometry_free(change(sign, -sign)) == std::vector<CheckResult>(2, CheckResult::failed));
  });
  // What it cannot see (facts 4.6): 9 cycles on L1 with 7 on L2 move it by 3 mm.
  const double l1 = wavelength_m(pairs[0][0]), l2 = wavelength_m(pairs[0][1]);
  CHECK(geometry_free({9 * l1, 7 * l2})[0] == CheckResult::passed);
  CHECK(geometry_free({l1, l2})[0] == CheckResult::failed);        // (1,1): 54 mm
  CHECK(geometry_free({l1, l2}, 0.10)[0] == CheckResult::passed);  // which 100 mm would miss
}

TEST_CASE("geometry-free: of three frequencies the majority is believed; a tie condemns all; no partner, no verdict") {
  using R = CheckResult;
  CHECK(geometry_free({0.0, 0.19, 0.01}) == std::vector<R>{R::passed, R::failed, R::passed});
  CHECK(geometry_free({0.0, 0.19, 0.45}) == std::vector<R>(3, R::failed));
  CHECK(geometry_free({0.0, 0.01, 0.25, 0.24}) == std::vector<R>(4, R::failed));
  CHECK(geometry_free({0.0, kMissing, 0.25, 0.24}) == std::vector<R>{R::failed, R::unavailable, R::passed, R::passed});
  CHECK(geometry_free({kMissing, 0.3}) == std::vector<R>(2, R::unavailable));
  CHECK(geometry_free({0.3}) == std::vector<R>(1, R::unavailable));
  CHECK(geometry_free({}).empty());
  CHECK(geometry_free({0.0, 0.0499}) == std::vector<R>(2, R::passed));
  CHECK(geometry_free({0.0, 0.0501}) == std::vector<R>(2, R::failed));
}

TEST_CASE("verdict: reports go before tests, any failed test breaks, and the policy decides on single frequencies") {
  const auto verdict = [](const ContinuityEvidence& e, SingleFrequencyPolicy policy = SingleFrequencyPolicy::verify) {
    return decide_continuity(e, policy);
  };
  const auto expect = [&](const ContinuityEvidence& e, Continuity continuity, SlipCause cause) {
    CHECK(verdict(e).continuity == continuity);
    CHECK(verdict(e).cause == cause);
  };
  ContinuityEvidence e = sound();
  expect(e, Continuity::verified, SlipCause::none);
  expect({}, Continuity::broken, SlipCause::first_epoch);
  e.doppler = CheckResult::failed;
  expect(e, Continuity::broken, SlipCause::doppler);
  e.common_motion = CheckResult::failed;
  expect(e, Continuity::broken, SlipCause::triple_difference);
  e.geometry_free = CheckResult::failed;
  expect(e, Continuity::broken, SlipCause::geometry_free);
  e.base = SlipCause::lli_base;
  expect(e, Continuity::broken, SlipCause::lli_base);
  e.base_changed = true;
  expect(e, Continuity::broken, SlipCause::base_changed);
  e.half_cycle = true;
  expect(e, Continuity::broken, SlipCause::half_cycle);
  e.loss_of_lock = true;
  expect(e, Continuity::broken, SlipCause::lli_rover);
  e.consecutive = false;
  expect(e, Continuity::broken, SlipCause::gap);
  e.power_failure = true;
  expect(e, Continuity::broken, SlipCause::power_failure);

  ContinuityEvidence single = sound();
  single.geometry_free = CheckResult::unavailable;
  expect(single, Continuity::unverified, SlipCause::single_frequency);
  for (const bool by_doppler : {false, true}) {
    ContinuityEvidence tested = single;
    (by_doppler ? tested.doppler : tested.common_motion) = CheckResult::passed;
    expect(tested, Continuity::verified, SlipCause::none);
    CHECK(verdict(tested, SingleFrequencyPolicy::always_fresh).continuity == Continuity::unverified);
    (by_doppler ? tested.doppler : tested.common_motion) = CheckResult::failed;
    CHECK(verdict(tested, SingleFrequencyPolicy::always_fresh).continuity == Continuity::broken);
  }
  CHECK(verdict(sound(), SingleFrequencyPolicy::always_fresh).continuity == Continuity::verified);
  for (std::size_t i = 0; i < kSlipCauses; ++i) CHECK(name_of(static_cast<SlipCause>(i))[0] != '\0');
}
