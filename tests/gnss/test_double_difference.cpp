// SPDX-License-Identifier: BSD-3-Clause
// Differencing under a simulated sky: what is left of code and phase, slips on every band, order, memory, capacity.
#include <doctest/doctest.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include <searvins/gnss/double_difference.hpp>

#include "gnss/simulated_sky.hpp"
#include "support/property.hpp"

using namespace searvins;
using namespace searvins::gnss;
using namespace searvins::test;

namespace {

struct Bench {
  std::unique_ptr<Differencer> differencer{std::make_unique<Differencer>()};
  std::unique_ptr<BaseBuffer<>> base{std::make_unique<BaseBuffer<>>()};
  std::unique_ptr<DifferencedEpoch> out{std::make_unique<DifferencedEpoch>()};
  DifferencingOptions options{};

  explicit Bench(const SimulatedPair& s) {
    options.troposphere = false;  // the simulated sky has none
    CHECK(base->set_position(s.base.p0_e_m).ok());
  }
  Status step(const SimulatedPair& s, double dt, const Eigen::Vector3d& error_e_m = Eigen::Vector3d{3, -2, 1},
              const std::optional<PredictedDisplacement>& moved = {}) {
    CHECK(base->push(simulate(s.sky, s.base, dt)).ok());
    return difference(simulate(s.sky, s.rover, dt), s, dt, error_e_m, moved);
  }
  Status difference(const ObservationEpoch& rover, const SimulatedPair& s, double dt,
                    const Eigen::Vector3d& error_e_m = Eigen::Vector3d{3, -2, 1}, const std::optional<PredictedDisplacement>& moved = {}) {
    return differencer->difference(rover, *base, s.sky.store, s.rover.p0_e_m + s.rover.v_e_mps * dt + error_e_m, options, *out, moved);
  }
};

double cycles_of(const SimulatedPair& s, const CorrectedSignal& c) {
  return s.rover.cycles.at({c.satellite, c.rover_signal}) - s.base.cycles.at({c.satellite, c.base_signal});
}

/// Largest deviation from the model within the groups, code and phase.
void check_model(const SimulatedPair& s, const DifferencedEpoch& e, double dt, double tolerance_m) {
  const Eigen::Vector3d p = s.rover.p0_e_m + s.rover.v_e_mps * dt;
  REQUIRE(e.groups.size() == 5);
  for (const SignalGroup& g : e.groups) {
    const CorrectedSignal& pivot = e.signals[static_cast<std::size_t>(g.pivot)];
    const auto rest = [&](const CorrectedSignal& c, double value_m) { return value_m - range_m(p, c.satellite_e_m); };
    for (const std::uint16_t i : g.candidates) {
      const CorrectedSignal& c = e.signals[i];
      CHECK(std::abs(rest(c, c.code_m) - rest(pivot, pivot.code_m)) < tolerance_m);
      const double phase_m = rest(c, c.phase_m) - rest(pivot, pivot.phase_m) - c.wavelength_m * (cycles_of(s, c) - cycles_of(s, pivot));
      CHECK(std::abs(phase_m) < tolerance_m);
    }
  }
}

const CorrectedSignal* find(const DifferencedEpoch& e, SatelliteId id, const SignalCode& code) {
  for (const CorrectedSignal& c : e.signals)
    if (c.satellite == id && c.rover_signal == code) return &c;
  return nullptr;
}

}  // namespace

TEST_CASE("corrected code and phase less range are common to a group to 1 mm, whatever the two clocks") {
  for_all_seeds(20, [](Rng& rng) {
    const SimulatedPair s = random_pair(rng, {6, 5, 5});
    Bench bench{s};
    CHECK(bench.step(s, 0).ok());
    check_model(s, *bench.out, 0, 1e-3);
    CHECK(bench.out->satellites == 16);
  });
}

TEST_CASE("base epochs interpolated across 30 s give the same, though the base clock drifts by metres a second") {
  for_all_seeds(10, [](Rng& rng) {
    const SimulatedPair s = random_pair(rng, {5, 5, 4});
    Bench bench{s};
    bench.options.base.mode = BaseMode::interpolate;
    CHECK(bench.base->push(simulate(s.sky, s.base, 0)).ok());
    CHECK(bench.base->push(simulate(s.sky, s.base, 30)).ok());
    const double dt = uniform(rng, 1, 29);
    CHECK(bench.difference(simulate(s.sky, s.rover, dt), s, dt).ok());
    CHECK(bench.out->base_interpolated);
    check_model(s, *bench.out, dt, 1e-3);
  });
}

TEST_CASE("carried forward, the base adds nothing but its age: the model holds, the variance grows") {
  for_all_seeds(5, [](Rng& rng) {
    const SimulatedPair s = random_pair(rng, {5, 5, 4});
    Bench bench{s};
    CHECK(bench.step(s, 0).ok());
    const double fresh = bench.out->signals[0].phase_variance_m2;
    CHECK(bench.difference(simulate(s.sky, s.rover, 20), s, 20).ok());
    check_model(s, *bench.out, 20, 1e-3);
    CHECK(bench.out->base_age_s == doctest::Approx(20).epsilon(1e-2));
    CHECK(bench.out->signals[0].phase_variance_m2 > fresh + 0.5e-3);
    CHECK(bench.difference(simulate(s.sky, s.rover, 31), s, 31).ok());
    CHECK(bench.out->base_status.code == StatusCode::stale);
    CHECK(bench.out->groups.empty());
    CHECK(bench.out->doppler.size() == 14);
  });
}

TEST_CASE("Doppler: rate = unit' v + c drift to 1 mm/s, pivot highest") {
  for_all_seeds(10, [](Rng& rng) {
    SimulatedPair s = random_pair(rng, {5, 5, 4}, 60);
    Bench bench{s};
    CHECK(bench.step(s, 0, Eigen::Vector3d::Zero()).ok());
    REQUIRE(bench.out->doppler.size() == 14);
    REQUIRE(bench.out->doppler_pivot >= 0);
    const DopplerMeasurement& pivot = bench.out->doppler[static_cast<std::size_t>(bench.out->doppler_pivot)];
    for (const DopplerMeasurement& m : bench.out->doppler) {
      CHECK(m.elevation_rad <= pivot.elevation_rad);
      // The receiver's seconds are longer than GPS seconds by the drift: c drift (1 + O(drift)), and rates scale likewise.
      CHECK(std::abs(m.rate_mps - m.unit_e.dot(s.rover.v_e_mps) - kSpeedOfLightMps * s.rover.drift_sps) < 1e-3);
      CHECK(std::abs((m.rate_mps - pivot.rate_mps) - (m.unit_e - pivot.unit_e).dot(s.rover.v_e_mps)) < 1e-3);
    }
  });
}

TEST_CASE("P11: a one-cycle slip on any band of any satellite, rover or base, is seen, and only there") {
  for_all_seeds(3, [](Rng& rng) {
    const SimulatedPair clean = random_pair(rng, {5, 5, 4});
    for (const SatelliteId id : clean.sky.satellites)
      for (const SignalCode& code : clean.rover.signals) {
        if (code.constellation != id.constellation) continue;
        SimulatedPair s = clean;
        Bench bench{s};
        CHECK(bench.step(s, 0).ok());
        CHECK(bench.step(s, 1).ok());
        for (const CorrectedSignal& c : bench.out->signals) CHECK(c.continuity == Continuity::verified);
        auto& slipped = chance(rng, 0.5) ? s.rover : s.base;
        slipped.cycles[{id, code}] += chance(rng, 0.5) ? 1 : -1;
        CHECK(bench.step(s, 2).ok());
        const CorrectedSignal* c = find(*bench.out, id, code);
        REQUIRE(c);
        CHECK(c->continuity == Continuity::broken);
        CHECK((c->cause == SlipCause::geometry_free || c->cause == SlipCause::triple_difference));
        for (const CorrectedSignal& other : bench.out->signals)
          if (other.satellite != id) CHECK(other.continuity == Continuity::verified);
        CHECK(bench.step(s, 3).ok());  // compared with the epoch of the slip: sound again
        CHECK(find(*bench.out, id, code)->continuity == Continuity::verified);
      }
  });
}

TEST_CASE("P11: slips that leave the geometry-free combination in place are seen by common motion") {
  for_all_seeds(5, [](Rng& rng) {
    const std::pair<double, double> gps[] = {{9, 7}, {5, 4}, {4, 3}}, galileo[] = {{4, 3}, {9, 7}, {5, 4}};
    for (int k = 0; k < 3; ++k) {
      SimulatedPair s = random_pair(rng, {6, 5, 3});
      Bench bench{s};
      CHECK(bench.step(s, 0).ok());
      const SatelliteId g{Constellation::gps, 2}, e{Constellation::galileo, 3};
      s.rover.cycles[{g, signal("G1C")}] += gps[k].first, s.rover.cycles[{g, signal("G2W")}] += gps[k].second;
      s.base.cycles[{e, signal("E1C")}] += galileo[k].first, s.base.cycles[{e, signal("E7Q")}] += galileo[k].second;
      CHECK(bench.step(s, 1).ok());
      for (const CorrectedSignal& c : bench.out->signals)
        CHECK((c.continuity == Continuity::broken) == (c.satellite == g || c.satellite == e));
    }
  });
}

TEST_CASE("P11: a slip during reacquisition is no continuation: after a gap the phase is broken, then it is verified") {
  for_all_seeds(5, [](Rng& rng) {
    SimulatedPair s = random_pair(rng, {5, 5, 4});
    Bench bench{s};
    CHECK(bench.step(s, 0).ok());
    CHECK(bench.step(s, 1).ok());
    const SatelliteId id = s.sky.satellites[static_cast<std::size_t>(integer(rng, 0, 13))];
    const auto without = [&](ObservationEpoch epoch) {
      epoch.satellites.erase_if([&](const SatelliteObservation& o) { return o.satellite == id; });
      return epoch;
    };
    const bool rover_loses = chance(rng, 0.5);
    const ObservationEpoch rover = simulate(s.sky, s.rover, 2), base = simulate(s.sky, s.base, 2);
    CHECK(bench.base->push(rover_loses ? base : without(base)).ok());
    CHECK(bench.difference(rover_loses ? without(rover) : rover, s, 2).ok());
    for (const CorrectedSignal& c : bench.out->signals) CHECK(c.satellite != id);
    for (auto& [key, cycles] : rover_loses ? s.rover.cycles : s.base.cycles)
      if (key.first == id) cycles += 1;
    CHECK(bench.step(s, 3).ok());
    for (const CorrectedSignal& c : bench.out->signals)
      if (c.satellite == id) {
        CHECK(c.continuity == Continuity::broken);
        CHECK(c.cause == SlipCause::gap);
      }
    CHECK(bench.step(s, 4).ok());
    for (const CorrectedSignal& c : bench.out->signals) CHECK(c.continuity == Continuity::verified);
  });
}

TEST_CASE(
    "single frequency, three satellites: a predicted displacement verifies them whatever the predicted positions; a wrong one does not, "
    "nor the policy off") {
  for_all_seeds(20, [](Rng& rng) {
    SimulatedPair s = random_pair(rng, {3, 0, 0});
    const Eigen::Vector3d way_m = s.rover.v_e_mps + random_vector<3>(rng, 0.005);
    const auto second_epoch = [&](const Eigen::Vector3d& moved_m, bool is_on, bool slips) {
      Rng errors = rng;
      SimulatedPair drive = s;
      Bench bench{drive};
      bench.options.slips.doppler = false, bench.options.slips.predicted_motion = is_on;
      (void)bench.options.selection.wanted.push_back(signal("G1C"));
      CHECK(bench.step(drive, 0, random_vector<3>(errors, 5)).ok());
      if (slips) drive.rover.cycles[{drive.sky.satellites[1], signal("G1C")}] += 1;
      CHECK(bench.step(drive, 1, random_vector<3>(errors, 5), PredictedDisplacement{moved_m, 1e-4 * Eigen::Matrix3d::Identity()}).ok());
      std::vector<Continuity> seen;
      for (const CorrectedSignal& c : bench.out->signals) seen.push_back(c.continuity);
      return seen;
    };
    using C = Continuity;
    CHECK(second_epoch(way_m, true, false) == std::vector<C>{C::verified, C::verified, C::verified});
    CHECK(second_epoch(way_m, true, true) == std::vector<C>{C::verified, C::broken, C::verified});
    CHECK(second_epoch(way_m, false, false) == std::vector<C>{C::unverified, C::unverified, C::unverified});
    const std::vector<Continuity> astray = second_epoch(way_m + Eigen::Vector3d{40, -30, 20}, true, false);
    CHECK(std::count(astray.begin(), astray.end(), Continuity::verified) < 3);
  });
}

TEST_CASE("single frequency: always fresh by policy, verified by common motion otherwise") {
  for_all_seeds(3, [](Rng& rng) {
    const SimulatedPair s = random_pair(rng, {5, 5, 4});
    for (const bool fresh : {false, true}) {
      Bench bench{s};
      bench.options.slips.single_frequency = fresh ? SingleFrequencyPolicy::always_fresh : SingleFrequencyPolicy::verify;
      CHECK(bench.step(s, 0).ok());
      CHECK(bench.step(s, 1).ok());
      for (const CorrectedSignal& c : bench.out->signals) {
        const bool single = c.satellite.constellation == Constellation::beidou;
        CHECK(c.continuity == (single && fresh ? Continuity::unverified : Continuity::verified));
      }
    }
  });
}

TEST_CASE("with five satellites and fewer, Doppler verifies single-frequency phases and a slip is never verified") {
  for_all_seeds(10, [](Rng& rng) {
    SimulatedPair s = random_pair(rng, {0, 0, 4});
    s.rover.v_e_mps.setZero();
    Bench bench{s};
    CHECK(bench.step(s, 0).ok());
    CHECK(bench.step(s, 1).ok());
    REQUIRE(bench.out->signals.size() == 4);
    CHECK(!bench.out->motion.valid);
    for (const CorrectedSignal& c : bench.out->signals) CHECK(c.continuity == Continuity::verified);
    s.rover.cycles[{{Constellation::beidou, 2}, signal("C2I")}] += 1;
    CHECK(bench.step(s, 2).ok());
    for (const CorrectedSignal& c : bench.out->signals)
      if (c.satellite.number == 2) CHECK(c.continuity == Continuity::broken);
  });
}

TEST_CASE("P13: the order of satellites and signals changes nothing") {
  for_all_seeds(5, [](Rng& rng) {
    SimulatedPair s = random_pair(rng, {6, 6, 5});
    Bench straight{s}, shuffled{s};
    for (int k = 0; k < 3; ++k) {
      ObservationEpoch rover = simulate(s.sky, s.rover, k), base = simulate(s.sky, s.base, k);
      CHECK(straight.base->push(base).ok());
      CHECK(straight.difference(rover, s, k).ok());
      for (ObservationEpoch* e : {&rover, &base}) {
        std::shuffle(e->satellites.begin(), e->satellites.end(), rng);
        for (SatelliteObservation& o : e->satellites) std::shuffle(o.signals.begin(), o.signals.end(), rng);
      }
      CHECK(shuffled.base->push(base).ok());
      CHECK(shuffled.difference(rover, s, k).ok());
      const DifferencedEpoch &a = *straight.out, &b = *shuffled.out;
      REQUIRE(a.signals.size() == b.signals.size());
      for (std::size_t i = 0; i < a.signals.size(); ++i) {
        CHECK(a.signals[i].satellite == b.signals[i].satellite);
        CHECK(a.signals[i].rover_signal == b.signals[i].rover_signal);
        CHECK(a.signals[i].code_m == b.signals[i].code_m);
        CHECK(a.signals[i].phase_m == b.signals[i].phase_m);
        CHECK(a.signals[i].continuity == b.signals[i].continuity);
      }
      REQUIRE(a.groups.size() == b.groups.size());
      for (std::size_t g = 0; g < a.groups.size(); ++g) CHECK(a.groups[g].pivot == b.groups[g].pivot);
      CHECK(a.doppler_pivot == b.doppler_pivot);
      CHECK(a.motion.displacement_e_m == b.motion.displacement_e_m);
    }
  });
}

TEST_CASE("a refused epoch, or one without base, leaves the memory as it was") {
  for_all_seeds(3, [](Rng& rng) {
    const SimulatedPair s = random_pair(rng, {5, 5, 4});
    Bench bench{s};
    CHECK(bench.step(s, 0).ok());
    CHECK(bench.step(s, 1).ok());
    const ObservationEpoch next = simulate(s.sky, s.rover, 2);
    CHECK(bench.differencer->difference(next, *bench.base, s.sky.store, Eigen::Vector3d::Constant(kMissing), bench.options, *bench.out)
              .code == StatusCode::non_finite);
    CHECK(bench.out->signals.empty());
    CHECK(bench.differencer->difference(next, *bench.base, s.sky.store, Eigen::Vector3d::Zero(), bench.options, *bench.out).code ==
          StatusCode::invalid_argument);
    CHECK(bench.difference(simulate(s.sky, s.rover, 1), s, 1).code == StatusCode::duplicate);
    CHECK(bench.difference(simulate(s.sky, s.rover, 0.5), s, 0.5).code == StatusCode::out_of_order);
    bench.options.base.mode = BaseMode::exact;
    CHECK(bench.difference(next, s, 2).ok());
    CHECK(bench.out->base_status.code == StatusCode::stale);
    CHECK(bench.out->signals.empty());
    CHECK(bench.step(s, 2).ok());
    CHECK(!bench.out->groups.empty());
    for (const CorrectedSignal& c : bench.out->signals) CHECK(c.continuity == Continuity::verified);
    for (const SignalGroup& g : bench.out->groups) CHECK(!g.pivot_changed);
  });
}

TEST_CASE("a satellite that stands twice is not used; masks, C/N0 and missing observations are counted") {
  Rng rng{7};
  SimulatedPair s = random_pair(rng, {6, 5, 3});
  Bench bench{s};
  ObservationEpoch rover = simulate(s.sky, s.rover, 0), base = simulate(s.sky, s.base, 0);
  rover.satellites.push_back(rover.satellites[0]);         // G01 twice
  rover.satellites[1].signals[0].cn0_dbhz = 10;            // G02, G1C
  rover.satellites[2].signals[1].code_m = kMissing;        // G03, G2W
  rover.satellites[3].signals[0].phase_cycles = kMissing;  // G04, G1C
  rover.satellites[4].signals[0].half_cycle = true;        // G05, G1C
  base.satellites.erase(5);                                // G06
  CHECK(bench.base->push(base).ok());
  CHECK(bench.difference(rover, s, 0).ok());
  const auto count = [&](Rejection r) { return bench.out->rejected[static_cast<std::size_t>(r)]; };
  CHECK(count(Rejection::duplicate) == 2);  // both copies
  CHECK(count(Rejection::low_cn0) == 1);
  CHECK(count(Rejection::no_code) == 1);
  CHECK(count(Rejection::no_phase) == 1);
  CHECK(count(Rejection::half_cycle) == 1);
  CHECK(count(Rejection::no_base) == 2);
  CHECK(bench.out->rejections.size() == 8);
  CHECK(!find(*bench.out, {Constellation::gps, 1}, signal("G1C")));
  CHECK(!find(*bench.out, {Constellation::gps, 2}, signal("G1C")));
  CHECK(find(*bench.out, {Constellation::gps, 2}, signal("G2W")));
  REQUIRE(find(*bench.out, {Constellation::gps, 5}, signal("G1C")));
  CHECK(!std::isfinite(find(*bench.out, {Constellation::gps, 5}, signal("G1C"))->phase_m));
  CHECK(std::isfinite(find(*bench.out, {Constellation::gps, 5}, signal("G1C"))->code_m));

  Bench masked{s};
  masked.options.screening.elevation_mask_rad = 1.5;
  CHECK(masked.step(s, 0).ok());
  CHECK(masked.out->signals.empty());
  CHECK(masked.out->doppler_pivot == -1);
  CHECK(masked.out->rejected[static_cast<std::size_t>(Rejection::low_elevation)] > 0);

  Bench small{s};
  small.options.min_group_size = 4;
  CHECK(small.step(s, 0).ok());
  CHECK(small.out->rejected[static_cast<std::size_t>(Rejection::group_too_small)] == 3);  // BeiDou
  CHECK(small.out->groups.size() == 4);

  Bench strict{s};
  strict.options.pivot.min_elevation_rad = 1.57;
  strict.options.pivot.allow_fallback = false;
  CHECK(strict.step(s, 0).ok());
  CHECK(strict.out->groups.empty());
  CHECK(strict.out->rejected[static_cast<std::size_t>(Rejection::no_pivot)] == 25);

  Bench stranger{s};
  const EphemerisStore<2> empty;
  CHECK(stranger.base->push(simulate(s.sky, s.base, 0)).ok());
  CHECK(
      stranger.differencer->difference(simulate(s.sky, s.rover, 0), *stranger.base, empty, s.rover.p0_e_m, stranger.options, *stranger.out)
          .ok());
  CHECK(stranger.out->rejected[static_cast<std::size_t>(Rejection::no_ephemeris)] == 25);
}

TEST_CASE("more signals than fit: those of the lowest satellites go, counted, and the model holds for the rest") {
  for_all_seeds(2, [](Rng& rng) {
    SimulatedPair s = random_pair(rng, {0, 0, 0});
    s.rover.signals = s.base.signals = {signal("G1C"), signal("G2W"), signal("G5Q"), signal("E1C"),
                                        signal("E5Q"), signal("E7Q"), signal("E8Q"), signal("E6C")};
    s.sky = random_sky(rng, s.rover.t0, s.rover.p0_e_m, {32, 30, 0});
    draw_ambiguities(rng, s.sky, s.rover);
    draw_ambiguities(rng, s.sky, s.base);
    Bench bench{s};
    CHECK(bench.step(s, 0).ok());
    const int gone = bench.out->rejected[static_cast<std::size_t>(Rejection::capacity)];
    CHECK(gone == 32 * 3 + 30 * 5 - 160);
    CHECK(bench.out->signals.size() == 160);
    double lowest = 2;
    for (const CorrectedSignal& c : bench.out->signals) lowest = std::min(lowest, c.elevation_rad);
    for (const RejectedSignal& r : bench.out->rejections) {
      const Ephemeris* e = s.sky.store.select(r.satellite, s.rover.t0);
      CHECK(geodesy::azimuth_elevation(s.rover.p0_e_m, satellite_state(*e, s.rover.t0)->position_e_m).elevation_rad <= lowest + 1e-3);
    }
    std::size_t grouped = 0;
    for (const SignalGroup& g : bench.out->groups) {
      grouped += g.candidates.size() + 1;
      for (const std::uint16_t i : g.candidates) CHECK(bench.out->signals[i].rover_signal == g.rover_signal);
      CHECK(bench.out->signals[static_cast<std::size_t>(g.pivot)].rover_signal == g.rover_signal);
    }
    CHECK(grouped == 160);
  });
}

TEST_CASE("P19: two differencers interleaved do not disturb each other; a rerun is bit-identical") {
  Rng rng{11};
  const SimulatedPair one = random_pair(rng, {5, 4, 4}), two = random_pair(rng, {4, 5, 4});
  Bench a{one}, b{two}, alone{one};
  for (int k = 0; k < 4; ++k) {
    CHECK(a.step(one, k).ok());
    CHECK(b.step(two, k).ok());
    CHECK(alone.step(one, k).ok());
    REQUIRE(a.out->signals.size() == alone.out->signals.size());
    for (std::size_t i = 0; i < a.out->signals.size(); ++i) {
      CHECK(std::memcmp(&a.out->signals[i].phase_m, &alone.out->signals[i].phase_m, sizeof(double)) == 0);
      CHECK(a.out->signals[i].cause == alone.out->signals[i].cause);
    }
  }
}

TEST_CASE("an ephemeris that changes between base and rover time does not show: both use one record") {
  for_all_seeds(5, [](Rng& rng) {
    SimulatedPair s = random_pair(rng, {5, 5, 4});
    Bench bench{s};
    // A second record, metres off, becomes the nearer one between the base epoch (0 s) and the rover epoch (20 s).
    EphemerisStore<80> store = s.sky.store;
    for (const Ephemeris& e : s.sky.store.records()) {
      Ephemeris later = e;
      later.toe.ns = 2 * s.rover.t0.plus_seconds(10).ns - e.toe.ns;
      const double ahead_s = seconds_between(e.toe, later.toe);
      if (ahead_s <= 0) continue;
      later.m0 = e.m0 + (std::sqrt(3.986005e14 / std::pow(e.sqrt_a, 6)) + e.delta_n) * ahead_s;
      later.issue = e.issue + 1, later.af0 += 2e-8;
      store.insert(later);
    }
    CHECK(bench.base->push(simulate(s.sky, s.base, 0)).ok());
    const ObservationEpoch rover = simulate(s.sky, s.rover, 20);
    CHECK(bench.differencer->difference(rover, *bench.base, store, s.rover.p0_e_m + 20 * s.rover.v_e_mps, bench.options, *bench.out).ok());
    const Eigen::Vector3d p = s.rover.p0_e_m + 20 * s.rover.v_e_mps;
    for (const SignalGroup& g : bench.out->groups)
      for (const std::uint16_t i : g.candidates) {
        const CorrectedSignal &c = bench.out->signals[i], &pivot = bench.out->signals[static_cast<std::size_t>(g.pivot)];
        CHECK(std::abs(c.code_m - range_m(p, c.satellite_e_m) - pivot.code_m + range_m(p, pivot.satellite_e_m)) <
              3.0);  // 6 m of clock stay out
      }
  });
}

TEST_CASE("garbage in the observations costs the observation, never more: what is handed on is finite and the groups are sound") {
  for_all_seeds(40, [](Rng& rng) {
    const SimulatedPair s = random_pair(rng, {5, 5, 4});
    Bench bench{s};
    const double poison[] = {
        kMissing, std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity(), 0, -1, 1e300, -1e300, 1e18, 3e9};
    const auto spoil = [&](ObservationEpoch& e) {
      for (SatelliteObservation& o : e.satellites) {
        if (chance(rng, 0.05)) o.satellite.number = static_cast<std::uint8_t>(integer(rng, 0, 255));
        for (SignalObservation& x : o.signals) {
          const auto any = [&](double& v) {
            if (chance(rng, 0.05)) v = poison[integer(rng, 0, 8)];
          };
          any(x.code_m), any(x.phase_cycles), any(x.doppler_hz), any(x.cn0_dbhz);
          if (chance(rng, 0.03)) x.signal.band = static_cast<char>(integer(rng, 1, 127));
        }
      }
    };
    for (int k = 0; k < 3; ++k) {
      ObservationEpoch rover = simulate(s.sky, s.rover, k), base = simulate(s.sky, s.base, k);
      spoil(rover), spoil(base);
      CHECK(bench.base->push(base).ok());
      CHECK(bench.difference(rover, s, k).ok());
      for (const CorrectedSignal& c : bench.out->signals) {
        CHECK(std::isfinite(c.code_m));
        CHECK(!std::isinf(c.phase_m));
        CHECK((c.wavelength_m > 0.15 && c.code_variance_m2 > 0 && c.phase_variance_m2 > 0));
        CHECK(c.satellite_e_m.allFinite());
      }
      for (const SignalGroup& g : bench.out->groups) {
        CHECK((g.pivot >= 0 && static_cast<std::size_t>(g.pivot) < bench.out->signals.size()));
        for (const std::uint16_t i : g.candidates) CHECK((i < bench.out->signals.size() && i != g.pivot));
      }
      for (const DopplerMeasurement& m : bench.out->doppler) CHECK((std::isfinite(m.rate_mps) && m.unit_e.allFinite()));
    }
  });
}
