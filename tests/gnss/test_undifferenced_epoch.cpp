// SPDX-License-Identifier: BSD-3-Clause
// Codes of one receiver in groups: right at the truth whatever the clocks, one group a constellation and carrier, blind to order; and the symmetric
// latent-pivot cost of a group is that of its codes under one free clock.
#include <doctest/doctest.h>

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>

#include <searvins/gnss/gnss_factors.hpp>
#include <searvins/gnss/motion.hpp>
#include <searvins/gnss/undifferenced_epoch.hpp>
#include <searvins/robust/formulation.hpp>
#include <searvins/robust/loss.hpp>

#include "simulated_sky.hpp"
#include "support/property.hpp"

using namespace searvins;
using namespace searvins::gnss;
using namespace searvins::test;

namespace {

/// A receiver under a made-up sky, with the atmosphere that the models know, and clocks of its own for each constellation and carrier.
struct Scene {
  SimulatedSky sky;
  SimulatedReceiver receiver;
  ObservationEpoch epoch;
};

double delay_m(const SignalCode& s, const std::array<double, 4>& clocks_m) {
  return clocks_m[static_cast<std::size_t>(s.constellation)] + (s.band == '1' || s.band == '2' ? 0.0 : clocks_m[3]);
}

Scene random_scene(Rng& rng, std::array<int, 3> counts) {
  Scene s;
  s.receiver.t0 = GpsTime::from_week_sow(2300, integer(rng, 4000, 600'000));
  s.receiver.p0_e_m = random_place(rng);
  s.receiver.clock_s = uniform(rng, -1e-3, 1e-3);
  s.receiver.signals = {signal("G1C"), signal("E1C"), signal("C2I"), signal("G5Q"), signal("E5Q")};
  s.sky = random_sky(rng, s.receiver.t0, s.receiver.p0_e_m, counts);
  s.epoch = simulate(s.sky, s.receiver, 0);
  std::array<double, 4> clocks_m{};
  for (double& c : clocks_m) c = uniform(rng, -30, 30);
  const geodesy::Geodetic g = geodesy::geodetic_from_ecef(s.receiver.p0_e_m);
  for (SatelliteObservation& o : s.epoch.satellites)
    for (SignalObservation& signal : o.signals) {
      const Result<Transmission> t = transmission_from_code(s.sky.store, o.satellite, s.epoch.tag, signal.code_m);
      const geodesy::AzimuthElevation line = geodesy::azimuth_elevation(s.receiver.p0_e_m, t->state.position_e_m);
      signal.code_m += troposphere_delay_m(g, line.elevation_rad) + klobuchar_delay_m(kTypicalIonosphere, g, line, t->time, frequency_hz(signal.signal)) +
                       delay_m(signal.signal, clocks_m);
    }
  return s;
}

SinglePointOptions two_carriers() {
  SinglePointOptions o;
  o.codes_per_satellite = 2;
  return o;
}

struct Undifferenced {
  std::unique_ptr<DifferencedEpoch> epoch = std::make_unique<DifferencedEpoch>();
  std::unique_ptr<SinglePointSolution> codes = std::make_unique<SinglePointSolution>();
};

Undifferenced undifferenced(const Scene& s, const Eigen::Vector3d& near_e_m, const SinglePointOptions& options = two_carriers()) {
  Undifferenced u;
  undifference(s.epoch, s.sky.store, near_e_m, options, *u.codes, *u.epoch);
  return u;
}

/// Code of a signal less its range from the truth: the clock of its group.
double clock_m(const Scene& s, const CorrectedSignal& c) { return c.code_m - range_m(s.receiver.p0_e_m, c.satellite_e_m); }

}  // namespace

TEST_CASE("undifferenced codes: at the truth a group knows one clock, whatever the clocks of other constellations and carriers") {
  for_all_seeds(50, [](Rng& rng) {
    const Scene s = random_scene(rng, {integer(rng, 2, 8), integer(rng, 2, 6), integer(rng, 2, 6)});
    const Undifferenced u = undifferenced(s, s.receiver.p0_e_m);
    CHECK(u.epoch->groups.size() == 5);  // three constellations, GPS and Galileo with a second carrier
    CHECK(u.epoch->satellites == static_cast<int>(s.epoch.satellites.size()));
    for (const SignalGroup& g : u.epoch->groups) {
      const CorrectedSignal& pivot = u.epoch->signals[static_cast<std::size_t>(g.pivot)];
      for (const std::uint16_t i : g.candidates) {
        const CorrectedSignal& c = u.epoch->signals[i];
        CHECK(same_carrier(c.rover_signal, pivot.rover_signal));
        CHECK(c.elevation_rad <= pivot.elevation_rad);
        CHECK(std::abs(clock_m(s, c) - clock_m(s, pivot)) < 0.02);  // group delays are zero in this sky; delays shift transmission times a little
        CHECK(std::isnan(c.phase_m));
        CHECK(c.code_variance_m2 > 0.01);
      }
    }
  });
}

TEST_CASE("undifferenced codes: a position a hundred metres off moves the models by centimetres") {
  for_all_seeds(20, [](Rng& rng) {
    const Scene s = random_scene(rng, {5, 4, 3});
    const Undifferenced at = undifferenced(s, s.receiver.p0_e_m), off = undifferenced(s, s.receiver.p0_e_m + random_vector<3>(rng, 100.0));
    REQUIRE(at.epoch->signals.size() == off.epoch->signals.size());
    for (std::size_t i = 0; i < at.epoch->signals.size(); ++i)
      CHECK(std::abs(at.epoch->signals[i].code_m - off.epoch->signals[i].code_m) < 0.1);
  });
}

TEST_CASE("undifferenced codes: lone codes, low and weak satellites and codes that are none are left out; nothing else is disturbed") {
  for_all_seeds(20, [](Rng& rng) {
    Scene s = random_scene(rng, {6, 1, 4});
    s.epoch.satellites[0].signals[0].cn0_dbhz = 5;
    s.epoch.satellites[1].signals[0].code_m = std::numeric_limits<double>::quiet_NaN();
    SinglePointOptions one_carrier;
    for (const char* name : {"G1C", "E1C", "C2I"}) REQUIRE(one_carrier.signals.push_back(signal(name)));
    Undifferenced u;
    u.epoch->base_status = failure(StatusCode::no_data, "no base");
    u.epoch->doppler_pivot = 7;
    undifference(s.epoch, s.sky.store, s.receiver.p0_e_m, one_carrier, *u.codes, *u.epoch);
    CHECK(u.epoch->groups.size() == 2);
    CHECK(u.epoch->satellites == 4 + 4);
    CHECK(!u.epoch->base_status.ok());
    CHECK(u.epoch->doppler_pivot == 7);
    for (const SignalGroup& g : u.epoch->groups) CHECK(g.rover_signal.constellation != Constellation::galileo);

    ObservationEpoch none;
    none.tag = s.epoch.tag;
    undifference(none, s.sky.store, s.receiver.p0_e_m, one_carrier, *u.codes, *u.epoch);
    CHECK(u.epoch->groups.empty());
    CHECK(u.epoch->satellites == 0);
  });
}

TEST_CASE("undifferenced codes: the order of satellites changes neither the groups' members nor their pivots") {
  for_all_seeds(20, [](Rng& rng) {
    Scene s = random_scene(rng, {6, 5, 4});
    const Undifferenced before = undifferenced(s, s.receiver.p0_e_m);
    std::shuffle(s.epoch.satellites.begin(), s.epoch.satellites.end(), rng);
    const Undifferenced after = undifferenced(s, s.receiver.p0_e_m);
    REQUIRE(before.epoch->groups.size() == after.epoch->groups.size());
    for (const SignalGroup& a : before.epoch->groups) {
      const auto b = std::find_if(after.epoch->groups.begin(), after.epoch->groups.end(), [&](const SignalGroup& g) { return same_carrier(g.rover_signal, a.rover_signal); });
      REQUIRE(b != after.epoch->groups.end());
      const auto id = [](const Undifferenced& u, int i) { return u.epoch->signals[static_cast<std::size_t>(i)].satellite; };
      CHECK(id(before, a.pivot) == id(after, b->pivot));
      CHECK(a.candidates.size() == b->candidates.size());
    }
  });
}

TEST_CASE("the symmetric latent-pivot cost of undifferenced codes is that of all codes under one free clock, for any loss") {
  using Loss = robust::Dcs<double>;
  for_all_seeds(200, [](Rng& rng) {
    constexpr int kMost = 12;
    const int m = integer(rng, 1, kMost - 1);
    std::array<double, kMost> z_less_h_m{}, variance_m2{};
    const double clock_0_m = uniform(rng, -1e5, 1e5);
    for (int i = 0; i <= m; ++i) {
      z_less_h_m[static_cast<std::size_t>(i)] = clock_0_m + normal(rng, 2) + (chance(rng, 0.3) ? uniform(rng, 10, 80) : 0.0);
      variance_m2[static_cast<std::size_t>(i)] = uniform(rng, 0.2, 9);
    }
    const double pivot_m = z_less_h_m[static_cast<std::size_t>(m)], pivot_variance = variance_m2[static_cast<std::size_t>(m)];
    const auto covariance = robust::SharedPivot<double, kMost>::from(variance_m2.data(), m, pivot_variance);
    REQUIRE(covariance.ok());
    const robust::LatentPivotSymmetric<Loss> form{};
    for (int k = 0; k < 5; ++k) {
      const double clock_m = clock_0_m + uniform(rng, -40, 40), pivot_error_m = pivot_m - clock_m;
      std::array<double, kMost> r{};
      for (int i = 0; i < m; ++i) r[static_cast<std::size_t>(i)] = z_less_h_m[static_cast<std::size_t>(i)] - pivot_m;
      std::array<double, kMost + 1> e{}, w{};
      form.whiten(*covariance, r.data(), pivot_error_m, e.data());
      const double differenced = form.weigh(e.data(), m + 1, w.data());
      double undifferenced_cost = 0;
      for (int i = 0; i <= m; ++i) {
        const double d = z_less_h_m[static_cast<std::size_t>(i)] - clock_m;
        undifferenced_cost += form.loss.rho(d * d / variance_m2[static_cast<std::size_t>(i)]);
      }
      CHECK(differenced == doctest::Approx(undifferenced_cost).epsilon(1e-9));
    }
  });
}
