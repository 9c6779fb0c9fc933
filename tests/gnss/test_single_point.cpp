// SPDX-License-Identifier: BSD-3-Clause
// Single-point positions under made-up skies: known truth, gross outliers, priors, and bad input.
#include <doctest/doctest.h>

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <optional>
#include <set>
#include <vector>

#include <searvins/gnss/single_point.hpp>
#include <searvins/gnss/single_point_problem.hpp>
#include <searvins/gnss/single_point_solution.hpp>

#include "simulated_sky.hpp"
#include "support/property.hpp"

using namespace searvins;
using namespace searvins::gnss;
using Eigen::Vector3d;
using test::for_all_seeds;
using test::integer;
using test::Rng;
using test::uniform;

namespace {

/// A receiver under a made-up sky with the atmosphere that the solver models.
struct Scene {
  test::SimulatedSky sky;
  test::SimulatedReceiver receiver;
  ObservationEpoch epoch;
};

void add_atmosphere(Scene& s) {
  const geodesy::Geodetic g = geodesy::geodetic_from_ecef(s.receiver.p0_e_m);
  for (SatelliteObservation& o : s.epoch.satellites)
    for (SignalObservation& signal : o.signals) {
      const Result<Transmission> t = transmission_from_code(s.sky.store, o.satellite, s.epoch.tag, signal.code_m);
      const geodesy::AzimuthElevation line = geodesy::azimuth_elevation(s.receiver.p0_e_m, t->state.position_e_m);
      signal.code_m +=
          troposphere_delay_m(g, line.elevation_rad) + klobuchar_delay_m(kTypicalIonosphere, g, line, t->time, frequency_hz(signal.signal));
    }
}

Scene random_scene(Rng& rng, std::array<int, 3> counts, double clock_s = 0.01) {
  Scene s;
  s.receiver.t0 = GpsTime::from_week_sow(2300, integer(rng, 4000, 600'000));
  s.receiver.p0_e_m = test::random_place(rng);
  s.receiver.clock_s = uniform(rng, -clock_s, clock_s);
  s.receiver.signals = {test::signal("G1C"), test::signal("E1C"), test::signal("C2I")};
  s.sky = test::random_sky(rng, s.receiver.t0, s.receiver.p0_e_m, counts);
  s.epoch = test::simulate(s.sky, s.receiver, 0);
  add_atmosphere(s);
  return s;
}

/// Makes the codes of `count` distinct satellites late by 40 .. 400 m; returns which.
std::set<SatelliteId> make_late(Rng& rng, ObservationEpoch& epoch, int count) {
  std::vector<std::size_t> order(epoch.satellites.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::shuffle(order.begin(), order.end(), rng);
  std::set<SatelliteId> late;
  for (int i = 0; i < count; ++i) {
    SatelliteObservation& s = epoch.satellites[order[static_cast<std::size_t>(i)]];
    const double delay_m = uniform(rng, 40, 400);
    for (SignalObservation& o : s.signals) o.code_m += delay_m;
    late.insert(s.satellite);
  }
  return late;
}

void add_noise(Rng& rng, ObservationEpoch& epoch, double sigma_m) {
  for (SatelliteObservation& s : epoch.satellites)
    for (SignalObservation& o : s.signals) o.code_m += test::normal(rng, sigma_m);
}

template <std::size_t N>
StatusCode code_of(const ObservationEpoch& epoch, const EphemerisStore<N>& store, const SinglePointOptions& options = {}) {
  return solve_single_point(epoch, store, options).status().code;
}

/// The same to the last bit; nothing here is NaN.
bool identical(const SinglePointSolution& a, const SinglePointSolution& b) {
  const auto same_row = [](const CodeRow& p, const CodeRow& q) {
    return p.satellite == q.satellite && p.signal == q.signal && p.fate == q.fate && p.residual_m == q.residual_m &&
           p.sigma_m == q.sigma_m && p.corrected_m == q.corrected_m && p.elevation_rad == q.elevation_rad;
  };
  return a.time == b.time && a.position_e_m == b.position_e_m && a.state == b.state && a.covariance == b.covariance &&
         a.clock_s == b.clock_s && a.constellation_used == b.constellation_used && a.used == b.used && a.excluded == b.excluded &&
         a.gdop == b.gdop && a.chi_square == b.chi_square && a.redundancy == b.redundancy && a.consistent == b.consistent &&
         std::equal(a.rows.begin(), a.rows.end(), b.rows.begin(), b.rows.end(), same_row);
}

}  // namespace

TEST_CASE("single point: exact codes give the exact position, clock and time, from the centre of the Earth") {
  for_all_seeds(60, [](Rng& rng) {
    const Scene s = random_scene(rng, {6, 5, 4});
    const auto solution = solve_single_point(s.epoch, s.sky.store);
    REQUIRE(solution);
    CHECK((solution->position_e_m - s.receiver.p0_e_m).norm() < 2e-2);  // the solver expands the Sagnac effect to first order
    CHECK(std::abs(seconds_between(s.receiver.t0, solution->time)) < 2e-9);
    for (std::size_t c = 0; c < 3; ++c) CHECK(std::abs(solution->clock_s[c] - s.receiver.clock_s) < 1e-10);
    CHECK(solution->used == 15);
    CHECK(solution->excluded == 0);
    CHECK(solution->consistent);
    CHECK(solution->redundancy == 11);
    CHECK(solution->gdop > 0.5);
    CHECK(solution->gdop < 50);
  });
}

TEST_CASE("single point: the start does not matter, nor the order of the satellites") {
  for_all_seeds(30, [](Rng& rng) {
    Scene s = random_scene(rng, {5, 4, 4});
    add_noise(rng, s.epoch, 0.5);
    const auto first = solve_single_point(s.epoch, s.sky.store);
    REQUIRE(first);
    SinglePointOptions options;
    options.start_e_m = test::random_vector<3>(rng, 1.2e7);
    const auto elsewhere = solve_single_point(s.epoch, s.sky.store, options);
    REQUIRE(elsewhere);
    CHECK((elsewhere->position_e_m - first->position_e_m).norm() < 1e-4);
    std::shuffle(s.epoch.satellites.begin(), s.epoch.satellites.end(), rng);
    const auto shuffled = solve_single_point(s.epoch, s.sky.store);
    REQUIRE(shuffled);
    CHECK((shuffled->position_e_m - first->position_e_m).norm() < 1e-4);
  });
}

TEST_CASE("single point: one that is filled again holds nothing of the last, and is cleared when there is none") {
  const auto reused = std::make_unique<SinglePointSolution>();
  for_all_seeds(20, [&](Rng& rng) {
    Scene s = random_scene(rng, {integer(rng, 2, 6), integer(rng, 2, 5), integer(rng, 1, 4)});
    add_noise(rng, s.epoch, 0.5);
    static_cast<void>(make_late(rng, s.epoch, integer(rng, 0, 2)));
    const Status status = solve_single_point(s.epoch, s.sky.store, {}, std::nullopt, *reused);
    const auto fresh = solve_single_point(s.epoch, s.sky.store);
    REQUIRE(status.code == fresh.status().code);
    CHECK(identical(*reused, *fresh));
    s.epoch.satellites.resize(3);
    CHECK(solve_single_point(s.epoch, s.sky.store, {}, std::nullopt, *reused).code == StatusCode::too_few);
    CHECK(identical(*reused, SinglePointSolution{}));
  });
}

TEST_CASE("single point: the covariance describes the errors (NEES of 300 noisy epochs)") {
  double nees = 0;
  int count = 0;
  for_all_seeds(300, [&](Rng& rng) {
    Scene s = random_scene(rng, {6, 5, 5});
    SinglePointOptions options;
    options.ionosphere_relative_sigma = options.troposphere_relative_sigma = 0, options.satellite_variance_factor = 0;
    for (SatelliteObservation& o : s.epoch.satellites)
      for (SignalObservation& signal : o.signals) {
        const auto t = transmission_from_code(s.sky.store, o.satellite, s.epoch.tag, signal.code_m);
        const double elevation_rad = geodesy::azimuth_elevation(s.receiver.p0_e_m, t->state.position_e_m).elevation_rad;
        signal.code_m += test::normal(rng, std::sqrt(options.sigma.undifferenced_code_variance_m2(signal.signal, elevation_rad)));
      }
    options.late_factor = 1;
    const auto solution = solve_single_point(s.epoch, s.sky.store, options);
    REQUIRE(solution);
    const Vector3d d = solution->position_e_m - s.receiver.p0_e_m;
    nees += d.dot(Eigen::LDLT<Eigen::Matrix3d>(solution->position_covariance_m2()).solve(d)) / 3;
    ++count;
  });
  nees /= count;
  MESSAGE("normalised error squared per axis " << nees);
  CHECK(nees > 0.8);
  CHECK(nees < 1.35);
}

TEST_CASE("single point: up to a third of the codes late by 40 to 400 m are found, all of them, nearly always nothing else") {
  int wrong = 0, runs = 0, innocent = 0, codes = 0;
  for_all_seeds(150, [&](Rng& rng) {
    Scene s = random_scene(rng, {7, 6, 5});
    add_noise(rng, s.epoch, 0.5);
    const std::set<SatelliteId> late = make_late(rng, s.epoch, integer(rng, 1, 6));
    const auto solution = solve_single_point(s.epoch, s.sky.store);
    REQUIRE(solution);
    ++runs;
    bool missed = false;
    for (const CodeRow& r : solution->rows) {
      if (late.count(r.satellite) > 0)
        missed = missed || r.fate != CodeFate::outlier;
      else
        innocent += r.fate == CodeFate::outlier, ++codes;
    }
    wrong += missed || (solution->position_e_m - s.receiver.p0_e_m).norm() > 5;
  });
  MESSAGE(wrong << " of " << runs << " epochs with a missed outlier or more than 5 m of error; " << innocent << " of " << codes
                << " good codes lost");
  CHECK(wrong == 0);
  CHECK(innocent < codes / 50);
}

TEST_CASE("single point: with half of the codes late, still within 10 m in nine of ten epochs") {
  int far = 0, runs = 0;
  for_all_seeds(100, [&](Rng& rng) {
    Scene s = random_scene(rng, {7, 6, 5});
    add_noise(rng, s.epoch, 0.5);
    make_late(rng, s.epoch, 9);
    const auto solution = solve_single_point(s.epoch, s.sky.store);
    ++runs;
    far += !solution || (solution->position_e_m - s.receiver.p0_e_m).norm() > 10;
  });
  MESSAGE(far << " of " << runs << " epochs without a position within 10 m");
  CHECK(far <= runs / 10);
}

TEST_CASE("single point: a prior adds redundancy; it holds where codes are few and yields where it is vague") {
  for_all_seeds(50, [](Rng& rng) {
    Scene s = random_scene(rng, {6, 5, 4});
    const Vector3d offset = test::random_vector<3>(rng, 3);
    const auto vague = solve_single_point(s.epoch, s.sky.store, {}, SinglePointPrior::at(s.receiver.p0_e_m + offset, 1000));
    REQUIRE(vague);
    CHECK((vague->position_e_m - s.receiver.p0_e_m).norm() < 0.02);
    s.epoch.satellites.resize(2);  // two codes: only the prior determines the position
    const auto held = solve_single_point(s.epoch, s.sky.store, {}, SinglePointPrior::at(s.receiver.p0_e_m + offset, 0.1));
    REQUIRE(held);
    CHECK((held->position_e_m - s.receiver.p0_e_m - offset).norm() < 0.2);
    CHECK(std::abs(seconds_between(s.receiver.t0, held->time)) < 1e-7);
    CHECK(code_of(s.epoch, s.sky.store) == StatusCode::too_few);
  });
}

TEST_CASE("single point: wanted signals in order, second carriers, masks and fates") {
  Rng rng{11};
  Scene s = random_scene(rng, {6, 5, 4});
  s.receiver.signals = {test::signal("G1C"), test::signal("G2W"), test::signal("E1C"), test::signal("E7Q"), test::signal("C2I")};
  s.epoch = test::simulate(s.sky, s.receiver, 0);
  add_atmosphere(s);
  SinglePointOptions options;
  CHECK(solve_single_point(s.epoch, s.sky.store, options)->rows.size() == 15);
  options.codes_per_satellite = 2;
  CHECK(solve_single_point(s.epoch, s.sky.store, options)->rows.size() == 26);
  options.codes_per_satellite = 1;
  options.signals.push_back(test::signal("G2W"));
  options.signals.push_back(test::signal("E1C"));
  const auto wanted = solve_single_point(s.epoch, s.sky.store, options);
  REQUIRE(wanted);
  int second = 0, missing = 0;
  for (const CodeRow& r : wanted->rows) second += r.signal == test::signal("G2W"), missing += r.fate == CodeFate::no_code;
  CHECK(second == 6);
  CHECK(missing == 4);  // BeiDou: no wanted signal
  CHECK_FALSE(wanted->constellation_used[static_cast<std::size_t>(Constellation::beidou)]);

  options = {};
  s.epoch.satellites[0].signals[0].cn0_dbhz = 10, s.epoch.satellites[0].signals[1].cn0_dbhz = 10;
  s.epoch.satellites[1].signals[0].code_m = s.epoch.satellites[1].signals[1].code_m = std::numeric_limits<double>::quiet_NaN();
  s.epoch.satellites[2].satellite.number = 40;
  const auto fates = solve_single_point(s.epoch, s.sky.store, options);
  REQUIRE(fates);
  CHECK(fates->rows[0].fate == CodeFate::weak);
  CHECK(fates->rows[1].fate == CodeFate::no_code);
  CHECK(fates->rows[2].fate == CodeFate::no_ephemeris);
  CHECK(fates->used == 12);
  options.screening.elevation_mask_rad = 1.0;
  const auto masked = solve_single_point(s.epoch, s.sky.store, options);
  for (const CodeRow& r : masked ? masked->rows : fates->rows)
    if (r.fate == CodeFate::low) CHECK(r.elevation_rad < 1.0);
}

TEST_CASE("single point: a delay of all second carriers goes into its own unknown, not into the position") {
  for_all_seeds(20, [](Rng& rng) {
    Scene s = random_scene(rng, {6, 5, 4});
    s.receiver.signals = {test::signal("G1C"), test::signal("G2W"), test::signal("E1C"), test::signal("E7Q"), test::signal("C2I")};
    s.epoch = test::simulate(s.sky, s.receiver, 0);
    add_atmosphere(s);
    for (SatelliteObservation& o : s.epoch.satellites)
      if (o.signals.size() > 1) o.signals[1].code_m -= 9;
    SinglePointOptions options;
    options.codes_per_satellite = 2;
    const auto solution = solve_single_point(s.epoch, s.sky.store, options);
    REQUIRE(solution);
    CHECK((solution->position_e_m - s.receiver.p0_e_m).norm() < 0.3);
    CHECK(solution->state[3 + kSinglePointClocks] == doctest::Approx(-9).epsilon(0.03));
    CHECK(solution->excluded == 0);
  });
}

TEST_CASE("single point: bad input is answered with its reason") {
  Rng rng{5};
  const Scene s = random_scene(rng, {5, 4, 0});
  CHECK(code_of(s.epoch, s.sky.store) == StatusCode::ok);
  CHECK(code_of(ObservationEpoch{}, s.sky.store) == StatusCode::no_data);
  CHECK(code_of(s.epoch, EphemerisStore<1>{}) == StatusCode::no_data);
  ObservationEpoch e = s.epoch;
  e.tag = e.tag.plus_seconds(40'000);  // every record is too old
  CHECK(code_of(e, s.sky.store) == StatusCode::no_data);
  e = s.epoch;
  e.satellites.resize(3);
  const auto few = solve_single_point(e, s.sky.store);
  CHECK(few.status().code == StatusCode::too_few);
  CHECK(few.status().index == 3);
  CHECK(few.status().detail == 4);
  e = s.epoch;
  for (SatelliteObservation& o : e.satellites) o.signals[0].code_m = std::numeric_limits<double>::infinity();
  CHECK(code_of(e, s.sky.store) == StatusCode::no_data);
  e = s.epoch;  // four codes that contradict each other by thousands of kilometres
  e.satellites.resize(4);
  for (std::size_t i = 0; i < 4; ++i) e.satellites[i].signals[0].code_m = 2e7 + 3e6 * static_cast<double>(i * i);
  CHECK(code_of(e, s.sky.store) != StatusCode::ok);
  SinglePointOptions options;
  options.codes_per_satellite = 3;
  CHECK(code_of(s.epoch, s.sky.store, options) == StatusCode::invalid_argument);
  options = {};
  options.late_factor = 0.5;
  CHECK(code_of(s.epoch, s.sky.store, options) == StatusCode::invalid_argument);
  options = {};
  options.clock_difference_sigma_m[1] = 0;
  CHECK(code_of(s.epoch, s.sky.store, options) == StatusCode::invalid_argument);
  options = {};
  options.other_carrier_sigma_m = std::numeric_limits<double>::quiet_NaN();
  CHECK(code_of(s.epoch, s.sky.store, options) == StatusCode::invalid_argument);
  options = {};
  options.start_e_m.x() = std::numeric_limits<double>::quiet_NaN();
  CHECK(code_of(s.epoch, s.sky.store, options) == StatusCode::invalid_argument);
}

TEST_CASE("single point: garbage in the codes, C/N0 and records ends in a status or in finite numbers") {
  for_all_seeds(300, [](Rng& rng) {
    Scene s = random_scene(rng, {4, 4, 4});
    const double garbage[] = {0,
                              -1,
                              1e-300,
                              101,
                              1e6,
                              2.9e9,
                              -2e7,
                              1e15,
                              std::numeric_limits<double>::max(),
                              std::numeric_limits<double>::infinity(),
                              std::numeric_limits<double>::quiet_NaN()};
    const auto draw = [&] { return garbage[static_cast<std::size_t>(integer(rng, 0, 10))]; };
    for (SatelliteObservation& o : s.epoch.satellites)
      for (SignalObservation& signal : o.signals) {
        if (test::chance(rng, 0.4)) signal.code_m = draw();
        if (test::chance(rng, 0.3)) signal.cn0_dbhz = draw();
      }
    EphemerisStore<16> store;
    for (Ephemeris e : s.sky.store.records()) {
      if (test::chance(rng, 0.1)) e.af0 = draw();
      if (test::chance(rng, 0.1)) e.crs = draw();
      if (test::chance(rng, 0.1)) e.accuracy_m = draw();
      REQUIRE(store.insert(e));
    }
    const auto solution = solve_single_point(s.epoch, store);
    if (!solution) return;
    CHECK(solution->position_e_m.allFinite());
    CHECK(solution->covariance.allFinite());
    CHECK(solution->covariance.diagonal().minCoeff() > 0);
  });
}
