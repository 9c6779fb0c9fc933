// SPDX-License-Identifier: BSD-3-Clause
// Doppler velocities under made-up skies: exact, with outliers, with a prior, and bad input.
#include <doctest/doctest.h>

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include <searvins/gnss/doppler_velocity.hpp>

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

struct Scene {
  test::SimulatedSky sky;
  test::SimulatedReceiver receiver;
  ObservationEpoch epoch;
};

Scene random_scene(Rng& rng, double noise_mps = 0) {
  Scene s;
  s.receiver.t0 = GpsTime::from_week_sow(2300, integer(rng, 4000, 600'000));
  s.receiver.p0_e_m = test::random_place(rng);
  s.receiver.v_e_mps = test::random_vector<3>(rng, 40);
  s.receiver.clock_s = uniform(rng, -0.01, 0.01), s.receiver.drift_sps = uniform(rng, -1e-6, 1e-6);
  s.receiver.signals = {test::signal("G1C"), test::signal("E1C"), test::signal("C2I")};
  s.sky = test::random_sky(rng, s.receiver.t0, s.receiver.p0_e_m, {6, 5, 5});
  s.epoch = test::simulate(s.sky, s.receiver, 0);
  for (SatelliteObservation& o : s.epoch.satellites)
    for (SignalObservation& signal : o.signals) signal.doppler_hz += test::normal(rng, noise_mps) / wavelength_m(signal.signal);
  return s;
}

}  // namespace

TEST_CASE("Doppler velocity: exact Dopplers give velocity and drift, to 1 mm/s") {
  for_all_seeds(60, [](Rng& rng) {
    const Scene s = random_scene(rng);
    const auto d = solve_doppler_velocity(s.epoch, s.sky.store, s.receiver.p0_e_m);
    REQUIRE(d);
    CHECK((d->velocity_e_mps - s.receiver.v_e_mps).norm() < 1e-3);
    CHECK(std::abs(d->drift_mps - kSpeedOfLightMps * s.receiver.drift_sps) < 1e-3);
    CHECK(d->used == 16);
    CHECK(d->excluded == 0);
    CHECK(d->redundancy == 12);
    CHECK(d->consistent);
  });
}

TEST_CASE("Doppler velocity: one that is filled again holds nothing of the last, and is cleared when there is none") {
  DopplerVelocity reused;
  for_all_seeds(20, [&](Rng& rng) {
    Scene s = random_scene(rng, 0.1);
    s.epoch.satellites.resize(static_cast<std::size_t>(integer(rng, 4, 16)));
    const Status status = solve_doppler_velocity(s.epoch, s.sky.store, s.receiver.p0_e_m, {}, {}, reused);
    const auto fresh = solve_doppler_velocity(s.epoch, s.sky.store, s.receiver.p0_e_m);
    REQUIRE(status.code == fresh.status().code);
    CHECK(reused.velocity_e_mps == fresh->velocity_e_mps);
    CHECK(reused.covariance == fresh->covariance);
    CHECK(reused.used == fresh->used);
    CHECK(reused.excluded == fresh->excluded);
    REQUIRE(reused.rows.size() == fresh->rows.size());
    for (std::size_t i = 0; i < reused.rows.size(); ++i) CHECK(reused.rows[i].residual_mps == fresh->rows[i].residual_mps);
    s.epoch.satellites.resize(3);
    CHECK(solve_doppler_velocity(s.epoch, s.sky.store, s.receiver.p0_e_m, {}, {}, reused).code == StatusCode::too_few);
    CHECK(reused.rows.empty());
    CHECK(reused.velocity_e_mps == Vector3d::Zero());
    CHECK(reused.covariance.isZero(0));
  });
}

TEST_CASE("Doppler velocity: a position error of 10 m is worth millimetres per second") {
  for_all_seeds(60, [](Rng& rng) {
    const Scene s = random_scene(rng);
    const auto d = solve_doppler_velocity(s.epoch, s.sky.store, s.receiver.p0_e_m + test::random_vector<3>(rng, 1).normalized() * 10);
    REQUIRE(d);
    CHECK((d->velocity_e_mps - s.receiver.v_e_mps).norm() < 0.03);
  });
}

TEST_CASE("Doppler velocity: up to a third of gross errors are found, in 99 % of the epochs") {
  int wrong = 0, runs = 0;
  for_all_seeds(200, [&](Rng& rng) {
    Scene s = random_scene(rng, 0.03);
    std::set<int> bad;
    while (static_cast<int>(bad.size()) < 1 + integer(rng, 0, 4)) bad.insert(integer(rng, 0, 15));
    for (const int i : bad) {
      SignalObservation& o = s.epoch.satellites[static_cast<std::size_t>(i)].signals[0];
      o.doppler_hz += (test::chance(rng, 0.5) ? 1 : -1) * uniform(rng, 2, 40) / wavelength_m(o.signal);
    }
    const auto d = solve_doppler_velocity(s.epoch, s.sky.store, s.receiver.p0_e_m);
    REQUIRE(d);
    ++runs;
    bool missed = (d->velocity_e_mps - s.receiver.v_e_mps).norm() > 0.5;
    for (const DopplerRow& r : d->rows)
      for (const int i : bad) missed = missed || (r.used && r.satellite == s.epoch.satellites[static_cast<std::size_t>(i)].satellite);
    wrong += missed;
  });
  MESSAGE(wrong << " of " << runs << " epochs with a missed outlier or more than 0.5 m/s of error");
  CHECK(wrong * 100 <= runs);
}

TEST_CASE("Doppler velocity: a prior settles what four range rates alone cannot check") {
  for_all_seeds(40, [](Rng& rng) {
    Scene s = random_scene(rng);
    s.epoch.satellites.resize(5);
    SignalObservation& o = s.epoch.satellites[2].signals[0];
    o.doppler_hz += 15 / wavelength_m(o.signal);
    VelocityPrior prior{s.receiver.v_e_mps + test::random_vector<3>(rng, 0.1), Eigen::Matrix3d::Identity() / (0.2 * 0.2)};
    const auto d = solve_doppler_velocity(s.epoch, s.sky.store, s.receiver.p0_e_m, {}, prior);
    REQUIRE(d);
    CHECK_FALSE(d->rows[2].used);
    CHECK((d->velocity_e_mps - s.receiver.v_e_mps).norm() < 0.5);
  });
}

TEST_CASE("Doppler velocity: bad input is answered with its reason") {
  Rng rng{9};
  const Scene s = random_scene(rng);
  const auto code = [&](const ObservationEpoch& e, const Vector3d& p) { return solve_doppler_velocity(e, s.sky.store, p).status().code; };
  CHECK(code(s.epoch, s.receiver.p0_e_m) == StatusCode::ok);
  CHECK(code(s.epoch, {0, std::numeric_limits<double>::quiet_NaN(), 0}) == StatusCode::non_finite);
  CHECK(code({}, s.receiver.p0_e_m) == StatusCode::too_few);
  ObservationEpoch e = s.epoch;
  e.satellites.resize(3);
  const auto few = solve_doppler_velocity(e, s.sky.store, s.receiver.p0_e_m);
  CHECK(few.status().code == StatusCode::too_few);
  CHECK(few.status().index == 3);
  e = s.epoch;
  for (SatelliteObservation& o : e.satellites) o.signals[0].doppler_hz = kMissing;
  CHECK(code(e, s.receiver.p0_e_m) == StatusCode::too_few);
  CHECK(code(s.epoch, -s.receiver.p0_e_m) == StatusCode::too_few);  // on the other side of the Earth everything is below the mask
}
