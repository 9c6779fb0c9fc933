// SPDX-License-Identifier: BSD-3-Clause
// The RTK estimator on simulated drives: accuracy, wrong integers let go, slips, lost base, few satellites, gaps, bad epochs, capacity, repeatability.
#include "estimator/simulated_drive.hpp"
#include "estimator/solution_numbers.hpp"

using namespace searvins;
using namespace searvins::test;
using estimator::RtkOptions;
using estimator::RtkSolution;
using estimator::SolutionStatus;

namespace {

std::vector<double> run(const Drive& d, const RtkOptions& options = simulation_options()) {
  RtkUnderTest rtk = estimator_for(d, options);
  std::vector<double> all;
  for (std::size_t k = 0; k < d.rover.size(); ++k) {
    const auto s = feed(rtk, d, k);
    if (!s.ok()) {
      all.push_back(-1);
      continue;
    }
    const auto v = numbers_of(*s);
    all.insert(all.end(), v.begin(), v.end());
  }
  return all;
}

/// Keeps the first n satellites.
void keep(gnss::ObservationEpoch& epoch, std::size_t n) {
  while (epoch.satellites.size() > n) epoch.satellites.pop_back();
}

const gnss::SignalCode kG1 = signal("G1C"), kG2 = signal("G2W"), kE1 = signal("E1C"), kC2 = signal("C2I");
gnss::SatelliteId gps(int n) { return {gnss::Constellation::gps, static_cast<std::uint8_t>(n)}; }

}  // namespace

TEST_CASE("a clean drive: every epoch answered, fixed within three epochs, centimetres, honest covariance") {
  int epochs = 0, fixed = 0, outside = 0;
  for_all_seeds(4, [&](Rng& rng) {
    const Drive d = simulated_drive(rng, 30);
    RtkUnderTest rtk = estimator_for(d);
    for (std::size_t k = 0; k < d.rover.size(); ++k) {
      CAPTURE(k);
      const auto s = feed(rtk, d, k);
      REQUIRE(s.ok());
      CHECK(s->smoother_status.code != StatusCode::capacity_exceeded);
      CHECK(std::abs(s->clock_offset_s - d.pair.rover.clock_s - d.pair.rover.drift_sps * static_cast<double>(k)) < 1e-7);
      CHECK(s->restarted == (k == 0));
      if (k < 3) continue;
      ++epochs, fixed += s->status == SolutionStatus::fix ? 1 : 0;
      if (s->status == SolutionStatus::fix) CHECK(d.error_m(*s) < 0.05);
      const double sigma = std::sqrt(s->covariance_enu_m2.trace());
      outside += d.error_m(*s) > 5 * sigma ? 1 : 0;
      CHECK((s->velocity_e_mps - d.pair.rover.v_e_mps).norm() < 0.3);
      REQUIRE(rtk.oldest_e_m().ok());
    }
  });
  CHECK(fixed >= epochs * 95 / 100);
  CHECK(outside == 0);
}

TEST_CASE("P10 one-cycle slips that nothing detects, ambiguities held constant: the wrong integers are let go within six epochs") {
  for_all_seeds(4, [](Rng& rng) {
    const std::size_t slip_at = 15;
    const std::vector<Slip> slips{{slip_at, gps(1), kG1, 1}, {slip_at, gps(2), kG1, -1}, {slip_at, {gnss::Constellation::galileo, 1}, kE1, 1}};
    const Drive d = simulated_drive(rng, 30, {6, 5, 4}, 1, slips);
    RtkOptions options = simulation_options();
    options.continuity = ambiguity::ContinuityMode::constant;
    options.differencing.slips.geometry_free_m = options.differencing.slips.common_motion_m = 1e3;  // blind
    RtkUnderTest rtk = estimator_for(d, options);
    int held_before = 0;
    for (std::size_t k = 0; k < d.rover.size(); ++k) {
      CAPTURE(k);
      const auto s = feed(rtk, d, k);
      REQUIRE(s.ok());
      if (k + 1 == slip_at) held_before = s->held_integers;
      if (k >= slip_at + 6) {
        CHECK(d.error_m(*s) < 0.10);
        CHECK(s->status == SolutionStatus::fix);
      }
    }
    CHECK(held_before > 0);
  });
}

TEST_CASE("P11 a one-cycle slip on any band never makes a fixed epoch wrong") {
  for (const gnss::SignalCode& code : {kG1, kG2, kE1, signal("E7Q"), kC2})
    for_all_seeds(2, [&](Rng& rng) {
      CAPTURE(code.band);
      const Drive d = simulated_drive(rng, 20, {6, 5, 4}, 1, {{10, {code.constellation, 2}, code, chance(rng, 0.5) ? 1.0 : -1.0}});
      RtkUnderTest rtk = estimator_for(d);
      bool broken = false;
      for (std::size_t k = 0; k < d.rover.size(); ++k) {
        CAPTURE(k);
        const auto s = feed(rtk, d, k);
        REQUIRE(s.ok());
        if (k == 10)
          for (const gnss::CorrectedSignal& c : rtk.differenced().signals)
            if (c.satellite == gnss::SatelliteId{code.constellation, 2} && c.rover_signal == code) broken = c.continuity != gnss::Continuity::verified;
        if (k >= 3) CHECK(d.error_m(*s) < 0.10);
      }
      CHECK(broken);
    });
}

TEST_CASE("P19 two estimators interleaved do not disturb each other; P24 the same input gives the same bits") {
  Rng rng{11};
  const Drive a = simulated_drive(rng, 15), b = simulated_drive(rng, 15);
  const std::vector<double> alone_a = run(a), alone_b = run(b);
  CHECK(alone_a == run(a));
  CHECK(alone_a != alone_b);
  RtkUnderTest rtk_a = estimator_for(a), rtk_b = estimator_for(b);
  std::vector<double> mixed_a, mixed_b;
  for (std::size_t k = 0; k < 15; ++k) {
    const auto va = numbers_of(*feed(rtk_a, a, k)), vb = numbers_of(*feed(rtk_b, b, k));
    mixed_a.insert(mixed_a.end(), va.begin(), va.end());
    mixed_b.insert(mixed_b.end(), vb.begin(), vb.end());
  }
  CHECK(mixed_a == alone_a);
  CHECK(mixed_b == alone_b);
}

TEST_CASE("P13 the order of satellites in an epoch changes nothing") {
  Rng rng{12};
  const Drive d = simulated_drive(rng, 15);
  Drive shuffled = d;
  for (auto* epochs : {&shuffled.rover, &shuffled.base})
    for (auto& e : *epochs) std::shuffle(e.satellites.begin(), e.satellites.end(), rng);
  RtkUnderTest rtk = estimator_for(d), other = estimator_for(d);
  for (std::size_t k = 0; k < d.rover.size(); ++k) {
    const auto s = feed(rtk, d, k), t = feed(other, shuffled, k);
    REQUIRE((s.ok() && t.ok()));
    CHECK(s->status == t->status);
    CHECK((s->position_e_m - t->position_e_m).norm() < 1e-4 * std::sqrt(s->covariance_enu_m2.trace()));
  }
}

TEST_CASE("P13 another pivot every epoch, or always the same one: the same trajectory") {
  Rng rng{13};
  Drive d = simulated_drive(rng, 20);
  for (std::size_t k = 0; k < d.rover.size(); ++k)
    for (auto& satellite : d.rover[k].satellites)
      for (auto& s : satellite.signals) s.cn0_dbhz = uniform(rng, 35, 50);
  RtkOptions restless = simulation_options(), steady = simulation_options();
  restless.differencing.pivot.hysteresis = false, restless.differencing.pivot.min_elevation_rad = 0.1;
  steady.differencing.pivot.hysteresis_db = 1000;
  RtkUnderTest a = estimator_for(d, restless), b = estimator_for(d, steady);
  int changes = 0;
  for (std::size_t k = 0; k < d.rover.size(); ++k) {
    const auto s = feed(a, d, k), t = feed(b, d, k);
    REQUIRE((s.ok() && t.ok()));
    for (const gnss::SignalGroup& g : a.differenced().groups) changes += g.pivot_changed && k > 0 ? 1 : 0;
    if (k >= 2) CHECK((s->position_e_m - t->position_e_m).norm() < 0.3 * std::sqrt(s->covariance_enu_m2.trace()));
  }
  CHECK(changes > 10);
}

TEST_CASE("P22 refused epochs (duplicate, backward, nothing usable before the start) leave the estimator bit-identical") {
  Rng rng{14};
  const Drive d = simulated_drive(rng, 15);
  RtkUnderTest rtk = estimator_for(d);
  gnss::ObservationEpoch empty;
  empty.tag = d.rover[0].tag.plus_seconds(-5);
  CHECK_FALSE(rtk.update(empty).ok());
  std::vector<double> all;
  for (std::size_t k = 0; k < d.rover.size(); ++k) {
    const auto v = numbers_of(*feed(rtk, d, k));
    all.insert(all.end(), v.begin(), v.end());
    const auto duplicate = rtk.update(d.rover[k]);
    CHECK(duplicate.status().code == StatusCode::duplicate);
    CHECK(rtk.update(d.rover[k / 2]).ok() == false);
    CHECK_FALSE(rtk.add_base(d.base[k / 2]).ok());
    if (k > 0) CHECK(rtk.update(d.rover[0]).status().code == StatusCode::out_of_order);
  }
  CHECK(all == run(d));
  CHECK_FALSE(rtk.set_base_position(Eigen::Vector3d{std::numeric_limits<double>::quiet_NaN(), 0, 0}).ok());
}

TEST_CASE("P22 NaN, infinity, zero and absurd observations: every epoch answered, finite, and still fixed from what is left") {
  for_all_seeds(3, [](Rng& rng) {
    Drive d = simulated_drive(rng, 25);
    const double bad[] = {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity(), 0, 1e300, -1, 1e-320};
    for (std::size_t k = 5; k < d.rover.size(); ++k)
      for (auto* epoch : {&d.rover[k], &d.base[k]})
        for (auto& satellite : epoch->satellites)
          for (auto& s : satellite.signals) {
            const double value = bad[static_cast<std::size_t>(integer(rng, 0, 6))];
            if (!chance(rng, 0.04)) continue;
            double* fields[] = {&s.code_m, &s.phase_cycles, &s.doppler_hz, &s.cn0_dbhz};
            *fields[integer(rng, 0, 3)] = value;
          }
    RtkUnderTest rtk = estimator_for(d);
    int fixed = 0;
    for (std::size_t k = 0; k < d.rover.size(); ++k) {
      CAPTURE(k);
      const auto s = feed(rtk, d, k);
      REQUIRE(s.ok());
      for (double x : numbers_of(*s)) CHECK(std::isfinite(x));
      if (s->status != SolutionStatus::fix) continue;
      ++fixed;
      CHECK(d.error_m(*s) < 0.1);
    }
    CHECK(fixed > 15);
  });
}

TEST_CASE("the base is lost for a minute: carried forward with age, then single point, then fixed again") {
  Rng rng{15};
  const Drive d = simulated_drive(rng, 90);
  RtkUnderTest rtk = estimator_for(d);
  for (std::size_t k = 0; k < d.rover.size(); ++k) {
    CAPTURE(k);
    const bool with_base = k < 10 || k >= 60;
    const auto s = feed(rtk, d, k, with_base);
    REQUIRE(s.ok());
    if (with_base) CHECK(s->base_age_s == doctest::Approx(0).epsilon(0.03));
    if (k >= 10 && k <= 38) {
      CHECK(s->base_age_s == doctest::Approx(static_cast<double>(k) - 9).epsilon(0.03));
      CHECK(s->status <= SolutionStatus::dgnss);
    }
    if (k >= 41 && k < 60) {
      CHECK(s->status == SolutionStatus::spp);
      CHECK(std::isnan(s->base_age_s));
      CHECK(s->verdict != ambiguity::ResolutionVerdict::accepted);
    }
    if (k >= 66) {
      CHECK(s->status == SolutionStatus::fix);
      CHECK(d.error_m(*s) < 0.05);
    }
  }
}

TEST_CASE("fewer than five satellites: the epoch is not differenced but answered; five are enough; afterwards it is fixed again") {
  Rng rng{16};
  Drive d = simulated_drive(rng, 30, {9, 0, 0});
  for (std::size_t k = 10; k < 15; ++k) keep(d.rover[k], 4);
  for (std::size_t k = 15; k < 18; ++k) keep(d.rover[k], 0);
  RtkUnderTest rtk = estimator_for(d);
  for (std::size_t k = 0; k < d.rover.size(); ++k) {
    CAPTURE(k);
    const auto s = feed(rtk, d, k);
    REQUIRE(s.ok());
    if (k >= 10 && k < 18) {
      CHECK((s->status == SolutionStatus::spp || s->status == SolutionStatus::dr));
      CHECK(d.error_m(*s) < 100);
      CHECK(s->phases == 0);
      CHECK(s->fixed_phases == 0);
    } else {
      CHECK(s->status <= SolutionStatus::dgnss);
    }
    if (k >= 24) {
      CHECK(s->status == SolutionStatus::fix);
      CHECK(d.error_m(*s) < 0.05);
    }
  }
}

TEST_CASE("a gap longer than max_gap_s starts the window anew, a shorter one does not") {
  Rng rng{17};
  const Drive d = simulated_drive(rng, 100);
  RtkUnderTest rtk = estimator_for(d);
  for (std::size_t k = 0; k < d.rover.size(); ++k) {
    if ((k >= 5 && k < 20) || (k >= 25 && k < 90)) continue;
    CAPTURE(k);
    const auto s = feed(rtk, d, k);
    REQUIRE(s.ok());
    CHECK(s->restarted == (k == 0 || k == 90));
    if (k >= 95) CHECK(s->status == SolutionStatus::fix);
  }
}

TEST_CASE("more states and phases than the capacity: older states leave early, low satellites' phases stay out, nothing stops") {
  Rng rng{18};
  const Drive fast = simulated_drive(rng, 50, {6, 5, 4}, 0.1), wide = simulated_drive(rng, 6, {14, 14, 14});
  RtkUnderTest rtk = estimator_for(fast), crowded = estimator_for(wide);
  int fixed = 0;
  for (std::size_t k = 0; k < fast.rover.size(); ++k) {
    CAPTURE(k);
    const auto s = feed(rtk, fast, k);
    REQUIRE(s.ok());
    fixed += s->status == SolutionStatus::fix ? 1 : 0;
    CHECK(s->smoother_status.code != StatusCode::capacity_exceeded);
    if (k > 10) CHECK(fast.error_m(*s) < 0.1);
  }
  CHECK(fixed > 40);
  for (std::size_t k = 0; k < wide.rover.size(); ++k) {
    const auto s = feed(crowded, wide, k);
    REQUIRE(s.ok());
    CHECK(s->phases <= TestCapacity::phases_per_epoch);
    CHECK(s->phases > 50);
    if (k > 2) CHECK(wide.error_m(*s) < 0.1);
  }
  RtkUnderTest full;
  gnss::Ephemeris e;
  Status last = ok_status();
  for (int i = 0; i < 1100; ++i) {
    e = wide.pair.sky.store.records()[static_cast<std::size_t>(i % 14)];
    e.toe = e.toe.plus_seconds(7200.0 * i);
    last = full.add_ephemeris(e);
  }
  CHECK(last.code == StatusCode::capacity_exceeded);
}
