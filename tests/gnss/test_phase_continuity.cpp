// SPDX-License-Identifier: BSD-3-Clause
// The memory of phases: compared before it is replaced, gaps, reports of the receivers, half cycles, intervals.
#include <doctest/doctest.h>

#include <memory>

#include <searvins/gnss/phase_continuity.hpp>

#include "support/property.hpp"

using namespace searvins;
using namespace searvins::gnss;
using namespace searvins::test;

namespace {

using Memory = PhaseContinuity<64>;
using Samples = Memory::Samples;
using Verdicts = StaticVector<ContinuityVerdict, 64>;

/// `n` satellites with two frequencies each; common clock, no motion.
Samples samples(Rng& rng, int n, double clock_m) {
  Samples s;
  for (int i = 0; i < n; ++i)
    for (const char band : {'1', '2'}) {
      PhaseSample p;
      p.satellite = {Constellation::gps, static_cast<std::uint8_t>(i + 1)};
      const SignalCode code{Constellation::gps, band, band == '1' ? 'C' : 'W'};
      p.pair = {code, code};
      p.wavelength_m = wavelength_m(code);
      p.less_range_m = clock_m + 100 * i + normal(rng, 0.002);
      const double azimuth = 2.4 * i, elevation = 0.3 + 1.1 * std::fmod(0.37 * i, 1.0);
      p.direction_e =
          -Eigen::Vector3d{std::sin(azimuth) * std::cos(elevation), std::cos(azimuth) * std::cos(elevation), std::sin(elevation)};
      p.base_arc = {static_cast<std::uint32_t>(2 * i + (band == '2')) + 1, SlipCause::first_epoch};
      s.push_back(p);
    }
  return s;
}

PhaseEpoch epoch(double t) { return {GpsTime::from_week_sow(2300, t), false, 0, 1}; }

struct Bench {
  std::unique_ptr<Memory> memory{std::make_unique<Memory>()};
  CycleSlipOptions options{};
  Verdicts verdicts{};
  void step(const PhaseEpoch& e, const Samples& s) {
    (void)memory->compare(e, s, options, verdicts);
    memory->remember(e, s);
  }
  void expect_all(Continuity continuity, SlipCause cause) {
    for (const ContinuityVerdict& v : verdicts) {
      CHECK(v.continuity == continuity);
      CHECK(v.cause == cause);
    }
  }
};

}  // namespace

TEST_CASE("P11: an epoch is compared with the one before, not with itself; comparing twice changes nothing") {
  for_all_seeds(20, [](Rng& rng) {
    Bench b;
    b.step(epoch(0), samples(rng, 8, 10));
    b.expect_all(Continuity::broken, SlipCause::first_epoch);
    b.step(epoch(1), samples(rng, 8, -1e5));
    b.expect_all(Continuity::verified, SlipCause::none);
    Samples slipped = samples(rng, 8, 40);
    const auto at = static_cast<std::size_t>(integer(rng, 0, 15));
    slipped[at].less_range_m += slipped[at].wavelength_m;
    for (int k = 0; k < 3; ++k) {
      (void)b.memory->compare(epoch(2), slipped, b.options, b.verdicts);
      CHECK(b.verdicts[at].continuity == Continuity::broken);
    }
    CHECK(b.memory->last_tag() == epoch(1).tag);
  });
}

TEST_CASE("what the receivers report: loss of lock, base arc, power failure, base position, base code") {
  Rng rng{5};
  const auto after = [&](auto change_sample, auto change_epoch) {
    Bench b;
    b.step(epoch(0), samples(rng, 8, 0));
    Samples now = samples(rng, 8, 3);
    PhaseEpoch e = epoch(1);
    change_sample(now[4]);
    change_epoch(e);
    b.step(e, now);
    return b.verdicts;
  };
  const auto nothing = [](auto&) {};
  Verdicts v = after([](PhaseSample& s) { s.loss_of_lock = true; }, nothing);
  CHECK(v[4].cause == SlipCause::lli_rover);
  CHECK(v[5].continuity == Continuity::verified);  // the other frequency, by common motion
  v = after([](PhaseSample& s) { s.base_arc = {900, SlipCause::lli_base}; }, nothing);
  CHECK(v[4].cause == SlipCause::lli_base);
  v = after([](PhaseSample& s) { s.pair.base.attribute = 'X'; }, nothing);
  CHECK(v[4].cause == SlipCause::base_changed);
  CHECK(v[6].continuity == Continuity::verified);
  v = after([](PhaseSample& s) { s.less_range_m = kMissing; }, nothing);
  CHECK(v[4].cause == SlipCause::gap);
  v = after(nothing, [](PhaseEpoch& e) { e.power_failure = true; });
  CHECK(v[0].cause == SlipCause::power_failure);
  v = after(nothing, [](PhaseEpoch& e) { e.base_revision = 2; });
  CHECK(v[0].cause == SlipCause::base_changed);
}

TEST_CASE("half cycles: broken while unresolved and at the epoch after, also when the phase was used") {
  Rng rng{6};
  Bench b;
  b.step(epoch(0), samples(rng, 8, 0));
  Samples half = samples(rng, 8, 0);
  half[2].half_cycle = true;
  b.step(epoch(1), half);
  CHECK(b.verdicts[2].cause == SlipCause::half_cycle);
  b.step(epoch(2), samples(rng, 8, 0));
  CHECK(b.verdicts[2].cause == SlipCause::half_cycle);
  b.step(epoch(3), samples(rng, 8, 0));
  CHECK(b.verdicts[2].continuity == Continuity::verified);
}

TEST_CASE("a gap is more than one and a half intervals: learned, given, or the absolute limit") {
  Rng rng{7};
  Bench b;
  b.step(epoch(0), samples(rng, 8, 0));
  b.step(epoch(30), samples(rng, 8, 0));  // 30 s data
  b.expect_all(Continuity::verified, SlipCause::none);
  b.step(epoch(74), samples(rng, 8, 0));
  b.expect_all(Continuity::verified, SlipCause::none);
  b.step(epoch(120), samples(rng, 8, 0));
  b.expect_all(Continuity::broken, SlipCause::gap);
  b.options.interval_s = 1;
  b.step(epoch(150), samples(rng, 8, 0));
  b.expect_all(Continuity::broken, SlipCause::gap);
  Bench slow;
  slow.step(epoch(0), samples(rng, 8, 0));
  slow.step(epoch(61), samples(rng, 8, 0));
  slow.expect_all(Continuity::broken, SlipCause::gap);
}

TEST_CASE("a base that is carried forward: when its age drops by 20 s the tests wait instead of crying wolf") {
  Rng rng{8};
  Bench b;
  PhaseEpoch e = epoch(0);
  e.base_age_s = 20;
  b.step(e, samples(rng, 14, 0));
  Samples fresh = samples(rng, 14, 0);
  fresh[6].less_range_m += 0.08, fresh[7].less_range_m += 0.08;  // what a satellite clock does in 20 s
  b.step(epoch(1), fresh);
  CHECK(b.verdicts[6].continuity == Continuity::verified);  // by both frequencies; 80 mm is no verdict for common motion now
  Bench strict;
  strict.step(epoch(0), samples(rng, 14, 0));
  fresh[6].less_range_m += 0.02, fresh[7].less_range_m += 0.02;
  strict.step(epoch(1), fresh);
  CHECK(strict.verdicts[6].cause == SlipCause::triple_difference);
}

TEST_CASE("Doppler speaks where common motion is silent, with the sign of RINEX") {
  for_all_seeds(20, [](Rng& rng) {
    Bench b;
    b.options.common_motion = false;
    Samples before = samples(rng, 3, 0), now = samples(rng, 3, 0);
    before.erase_if([](const PhaseSample& s) { return s.pair.rover.band == '2'; });
    now.erase_if([](const PhaseSample& s) { return s.pair.rover.band == '2'; });
    for (std::size_t i = 0; i < 3; ++i) {
      const double rate_mps = uniform(rng, -800, 800), acceleration = 0.2;
      before[i].doppler_hz = -rate_mps / before[i].wavelength_m, now[i].doppler_hz = -(rate_mps + acceleration) / now[i].wavelength_m;
      before[i].rover_phase_m = 2.2e7, now[i].rover_phase_m = 2.2e7 + rate_mps + acceleration / 2;
    }
    Samples slipped = now;
    slipped[1].rover_phase_m += slipped[1].wavelength_m;
    b.step(epoch(0), before);
    (void)b.memory->compare(epoch(1), now, b.options, b.verdicts);
    b.expect_all(Continuity::verified, SlipCause::none);
    (void)b.memory->compare(epoch(1), slipped, b.options, b.verdicts);
    CHECK(b.verdicts[1].cause == SlipCause::doppler);
    CHECK(b.verdicts[0].continuity == Continuity::verified);
    b.options.doppler = false;
    (void)b.memory->compare(epoch(1), slipped, b.options, b.verdicts);
    b.expect_all(Continuity::unverified, SlipCause::single_frequency);
  });
}
