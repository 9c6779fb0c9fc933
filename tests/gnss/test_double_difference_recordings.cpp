// SPDX-License-Identifier: BSD-3-Clause
// Differencing of the shared recordings, scored against their truth: what double differences are left with, false alarms, missed slips.
#include <doctest/doctest.h>

#include <cstdio>

#include "gnss/recordings.hpp"
#include "support/shared_data.hpp"

using namespace searvins;
using namespace searvins::gnss;
using namespace searvins::test;

namespace {

std::string describe(const Score& s) {
  char text[400];
  std::snprintf(
      text, sizeof text,
      "%d epochs, %ld DD phases, rms %.4f m, max %.3f m; code rms %.2f m, median %.2f m; %ld comparable, verified %ld, unverified %ld, "
      "false alarms %ld, slips %ld, missed %ld",
      s.epochs, s.phases, s.phase_rms_m, s.phase_max_m, s.code_rms_m, s.code_median_m, s.comparable, s.verified, s.unverified,
      s.false_alarms, s.true_slips, s.missed);
  return text;
}

/// Asserted figures of a clean recording.
void check(const Score& s, int epochs, double phase_rms_m, double code_rms_m, double most_false_alarms) {
  MESSAGE(describe(s));
  CHECK(s.epochs == epochs);
  CHECK(s.phase_rms_m < phase_rms_m);
  CHECK(s.code_rms_m < code_rms_m);
  CHECK(static_cast<double>(s.false_alarms) <= most_false_alarms * static_cast<double>(s.comparable));
  CHECK(s.missed == 0);
}

}  // namespace

#define SHARED_OR_SKIP(name)                   \
  const auto name = shared_data();             \
  if (!name) {                                 \
    MESSAGE("SKIPPED: shared data not found"); \
    return;                                    \
  }

TEST_CASE("nagoya_static: 1 m baseline, all bands") {
  SHARED_OR_SKIP(shared)
  const Score s = run(nagoya_static(*shared), {});
  check(s, 301, 0.008, 0.8, 0);
  MESSAGE("Doppler between satellites, rms " << s.doppler_rms_mps << " m/s");
  CHECK(s.doppler_rms_mps < 0.1);  // the rover stands: satellite motion and clock are all there was
  CHECK(s.doppler_rms_mps > 0);
}

TEST_CASE("sf_static: a few metres, L1 and L2C, noisy Doppler") {
  SHARED_OR_SKIP(shared)
  check(run(sf_static(*shared), {}), 400, 0.008, 2.0, 0.001);
}

TEST_CASE("geonet_static: 3.3 km, 30 s, neither Doppler nor C/N0; the height difference of the troposphere is needed") {
  SHARED_OR_SKIP(shared)
  const Recording r = geonet_static(*shared);
  const Score s = run(r, {});
  check(s, 120, 0.008, 0.6, 0.0);
  DifferencingOptions dry;
  dry.troposphere = false;
  CHECK(run(r, dry).phase_rms_m > 1.2 * s.phase_rms_m);
}

TEST_CASE("kamakura_drive: a car, 5.4 km, no Doppler, L2 codes that differ") {
  SHARED_OR_SKIP(shared)
  const Recording r = kamakura_drive(*shared);
  const Score s = run(r, {});
  check(s, 178, 0.02, 1.5, 0.01);
  CHECK(s.true_slips > 10);
  DifferencingOptions old;
  old.slips.common_motion = false;
  CHECK(run(r, old).missed > 0);  // what geometry-free alone lets through
}

TEST_CASE("spirent_rose: noise free") {
  SHARED_OR_SKIP(shared)
  check(run(spirent_rose(*shared), {}), 601, 0.002, 0.02, 0.0);
}

TEST_CASE("twin a-clean: 9.5 km and 63 m of height") {
  SHARED_OR_SKIP(shared)
  const Recording r = twin(*shared, "a-clean");
  const Score s = run(r, {});
  check(s, 1139, 0.010, 0.6, 0.0);
  for (const bool troposphere : {false, true}) {
    DifferencingOptions o;
    (troposphere ? o.troposphere : o.ionosphere) = false;
    CHECK(run(r, o).phase_rms_m > 1.5 * s.phase_rms_m);
  }
}

TEST_CASE("nagoya_static with a base of 10 s: interpolated it is as good as new, carried forward it ages") {
  SHARED_OR_SKIP(shared)
  Recording r = nagoya_static(*shared);
  const double fresh_m = run(r, {}).phase_rms_m;
  std::erase_if(r.base, [](const ObservationEpoch& e) { return e.tag.ns % (10 * kNanosecondsPerSecond) != 0; });
  DifferencingOptions o;
  const Score carried = run(r, o);
  o.base.mode = BaseMode::interpolate;
  const Score between = run(r, o);
  MESSAGE("every second " << fresh_m << ", interpolated " << between.phase_rms_m << ", carried " << carried.phase_rms_m);
  CHECK(between.phase_rms_m < 1.2 * fresh_m);
  CHECK(carried.phase_rms_m > between.phase_rms_m);
  CHECK(carried.phase_rms_m < 0.012);
  for (const Score& s : {carried, between}) CHECK(s.false_alarms == 0);
}

TEST_CASE("twin a-urban: slips by policy") {
  SHARED_OR_SKIP(shared)
  const Recording r = twin(*shared, "a-urban");
  DifferencingOptions verify, fresh, paper;
  fresh.slips.single_frequency = SingleFrequencyPolicy::always_fresh;
  paper.slips.single_frequency = SingleFrequencyPolicy::always_fresh;
  paper.slips.common_motion = paper.slips.doppler = false;
  const auto events = phase_events(*shared / "data/twin/a-urban/gnss_labels.json", "uslip");
  CHECK(events.size() == 149);
  const auto score = [&](const DifferencingOptions& o) { return run(r, o, {3, -4, 2}, events); };
  const Score v = score(verify), f = score(fresh), p = score(paper);
  // Most labelled events are a switch between direct and reflected path whose integer keeps the phase in place: no slip to an estimator.
  MESSAGE("labelled undetected slips compared: " << v.labelled << ", with a jump over 0.4 cycles: " << v.labelled_slips
                                                 << "; missed: verify " << v.labelled_missed << ", always fresh " << f.labelled_missed
                                                 << ", geometry-free alone " << p.labelled_missed);
  MESSAGE("verify: " << describe(v));
  MESSAGE("always fresh: " << describe(f));
  MESSAGE("geometry-free alone, always fresh: " << describe(p));
  CHECK(v.epochs == 1139);
  CHECK(v.true_slips > 500);
  CHECK(v.missed * 20 < v.true_slips);
  CHECK(f.missed <= v.missed);
  CHECK(p.missed > 4 * f.missed);
  CHECK(v.false_alarms * 200 < v.comparable);
  CHECK(v.verified > p.verified + 5000);  // the single-frequency signals that the policy wins
}
