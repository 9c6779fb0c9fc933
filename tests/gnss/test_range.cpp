// SPDX-License-Identifier: BSD-3-Clause
// Range and range rate against an independent light-time solution that turns the satellite's position through the full angle.
#include <doctest/doctest.h>

#include <Eigen/Core>

#include <cmath>

#include <searvins/geodesy/wgs84.hpp>
#include <searvins/gnss/range.hpp>

#include "support/property.hpp"

using namespace searvins;
using namespace searvins::gnss;
using Eigen::Vector3d;
using test::for_all_seeds;
using test::Rng;
using test::uniform;

namespace {

/// A receiver and a satellite that move uniformly in ECEF.
struct Pair {
  Vector3d p_e_m, v_e_mps, satellite_e_m, satellite_v_e_mps;
};

Pair random_pair(Rng& rng) {
  Pair pair;
  const double lat = uniform(rng, -1.5, 1.5), lon = uniform(rng, -3.1, 3.1);
  pair.p_e_m = geodesy::ecef_from_geodetic({lat, lon, uniform(rng, -100, 10'000)});
  pair.v_e_mps = test::random_vector<3>(rng, 50);
  const Vector3d enu{uniform(rng, -1, 1), uniform(rng, -1, 1), uniform(rng, 0.1, 1)};
  pair.satellite_e_m = pair.p_e_m + uniform(rng, 2.0e7, 3.9e7) * (geodesy::ecef_from_enu({lat, lon, 0}) * enu.normalized());
  pair.satellite_v_e_mps = test::random_vector<3>(rng, 2500);
  return pair;
}

/// Length of the way of the signal that arrives at time t; the satellite is at satellite_e_m at time `sent`.
double true_range_m(const Pair& pair, double t, double sent) {
  const Vector3d p = pair.p_e_m + t * pair.v_e_mps;
  double flight_s = 0.08;
  for (int i = 0; i < 12; ++i) {
    const Vector3d s = pair.satellite_e_m + (t - flight_s - sent) * pair.satellite_v_e_mps;
    const double a = geodesy::kEarthRateRadps * flight_s;
    const Vector3d turned{std::cos(a) * s.x() + std::sin(a) * s.y(), -std::sin(a) * s.x() + std::cos(a) * s.y(), s.z()};
    flight_s = (p - turned).norm() / kSpeedOfLightMps;
  }
  return flight_s * kSpeedOfLightMps;
}

/// Time of transmission of the signal that arrives at 0 from where the satellite is then.
double time_sent(const Pair& pair) {
  double sent = -0.08;
  for (int i = 0; i < 12; ++i) {
    const double a = -geodesy::kEarthRateRadps * sent;
    const Vector3d& s = pair.satellite_e_m;
    const Vector3d turned{std::cos(a) * s.x() + std::sin(a) * s.y(), -std::sin(a) * s.x() + std::cos(a) * s.y(), s.z()};
    sent = -(pair.p_e_m - turned).norm() / kSpeedOfLightMps;
  }
  return sent;
}

}  // namespace

TEST_CASE("range: the Sagnac term is the rotation of the Earth during the flight, to 0.3 mm") {
  for_all_seeds(300, [](Rng& rng) {
    const Pair pair = random_pair(rng);
    const double exact_m = true_range_m(pair, 0, time_sent(pair));
    CHECK(std::abs(range_m(pair.p_e_m, pair.satellite_e_m) - exact_m) < 3e-4);
    const double plain_m = (pair.p_e_m - pair.satellite_e_m).norm();
    CHECK(std::abs(range_m(pair.p_e_m, pair.satellite_e_m) - plain_m) < 75);
  });
}

TEST_CASE("range: the gradient agrees with central differences, and asking for it changes nothing") {
  for_all_seeds(200, [](Rng& rng) {
    const Pair pair = random_pair(rng);
    Vector3d gradient;
    const double with = range_m(pair.p_e_m, pair.satellite_e_m, &gradient);
    CHECK(with == range_m(pair.p_e_m, pair.satellite_e_m));
    for (int i = 0; i < 3; ++i) {
      const Vector3d h = Vector3d::Unit(i) * 10;
      CHECK(
          gradient[i] ==
          doctest::Approx((range_m(pair.p_e_m + h, pair.satellite_e_m) - range_m(pair.p_e_m - h, pair.satellite_e_m)) / 20).epsilon(1e-8));
    }
  });
}

TEST_CASE("direction: a unit vector from satellite to receiver, the gradient of the range but for 2e-6") {
  for_all_seeds(100, [](Rng& rng) {
    const Pair pair = random_pair(rng);
    Vector3d gradient;
    static_cast<void>(range_m(pair.p_e_m, pair.satellite_e_m, &gradient));
    const Vector3d u = direction_from_satellite(pair.p_e_m, pair.satellite_e_m);
    CHECK(u.norm() == doctest::Approx(1).epsilon(1e-14));
    CHECK((u - gradient).norm() < 2e-6);  // a longer way also turns the axes further
    CHECK(u.dot(pair.p_e_m) < 0);         // a visible satellite is above: the way to the receiver points down
  });
}

TEST_CASE("range rate: the derivative of the light-time range, to 20 um/s") {
  for_all_seeds(300, [](Rng& rng) {
    const Pair pair = random_pair(rng);
    const double sent = time_sent(pair), h = 0.02;
    const double numeric = (true_range_m(pair, h, sent) - true_range_m(pair, -h, sent)) / (2 * h);
    const double analytic = range_rate_mps(pair.p_e_m, pair.v_e_mps, pair.satellite_e_m, pair.satellite_v_e_mps);
    CHECK(std::abs(analytic - numeric) < 2e-5);
  });
}

TEST_CASE("range rate: positive when the satellite recedes, linear in the receiver's velocity") {
  for_all_seeds(100, [](Rng& rng) {
    const Pair pair = random_pair(rng);
    const Vector3d away = (pair.satellite_e_m - pair.p_e_m).normalized() * 800;
    CHECK(range_rate_mps(pair.p_e_m, Vector3d::Zero(), pair.satellite_e_m, away) == doctest::Approx(800).epsilon(1e-3));
    Vector3d gradient;
    const double with = range_rate_mps(pair.p_e_m, pair.v_e_mps, pair.satellite_e_m, pair.satellite_v_e_mps, &gradient);
    const double at_rest = range_rate_mps(pair.p_e_m, Vector3d::Zero(), pair.satellite_e_m, pair.satellite_v_e_mps);
    CHECK(with == doctest::Approx(at_rest + gradient.dot(pair.v_e_mps)).epsilon(1e-12));
  });
}

TEST_CASE("axes after a flight: a rotation that a turn back undoes") {
  for_all_seeds(50, [](Rng& rng) {
    const Vector3d v = test::random_vector<3>(rng, 3e7);
    const double flight_s = uniform(rng, 0, 0.2);
    const Vector3d turned = in_axes_after(v, flight_s);
    CHECK(turned.norm() == doctest::Approx(v.norm()).epsilon(1e-14));
    CHECK(turned.z() == v.z());
    CHECK((in_axes_after(turned, -flight_s) - v).norm() < 1e-7);
    // A point fixed in inertial space moves westward in ECEF axes.
    CHECK(v.x() * turned.y() - v.y() * turned.x() <= 0);
  });
}
