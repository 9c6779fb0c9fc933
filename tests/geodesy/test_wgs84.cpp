// SPDX-License-Identifier: BSD-3-Clause
// WGS-84: round trips from 6000 km below the ellipsoid to 50,000 km above, poles and equator included; axes; gravity against
// published values and against the gradient of the Earth's potential, which shares no formula with the header.
#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include <searvins/geodesy/wgs84.hpp>

#include "examples/support/angle_units.hpp"
#include "support/property.hpp"

namespace geodesy = searvins::geodesy;
using geodesy::Geodetic;
using searvins::test::Rng;
using searvins::test::uniform;

namespace {

using Real = long double;
using searvins::examples::kRadPerDeg;
using std::numbers::pi;

/// The forward transform in long double: truth for the inverse.
Eigen::Matrix<Real, 3, 1> exact_ecef(const Geodetic& g) {
  const Real f = 1.0L / 298.257223563L, e2 = f * (2 - f), a = 6378137.0L;
  const Real s = std::sin(static_cast<Real>(g.lat_rad)), c = std::cos(static_cast<Real>(g.lat_rad));
  const Real n = a / std::sqrt(1 - e2 * s * s), h = g.height_m, lon = g.lon_rad;
  return {(n + h) * c * std::cos(lon), (n + h) * c * std::sin(lon), (n * (1 - e2) + h) * s};
}

/// Distance on the ground between two geodetic positions whose latitudes and longitudes are close, metres.
double horizontal_m(const Geodetic& a, const Geodetic& b) {
  const double radius = geodesy::kSemiMajorAxisM + std::abs(a.height_m);
  const double east = std::remainder(a.lon_rad - b.lon_rad, 2 * pi) * std::cos(a.lat_rad);
  return radius * std::hypot(a.lat_rad - b.lat_rad, east);
}

/// Gravity from the potential GM/r (1 - J2 (a/r)^2 P2 - J4 (a/r)^4 P4) + (w rho)^2/2 by central differences, m/s^2 in ECEF.
Eigen::Vector3d gravity_from_potential(const Eigen::Vector3d& p_e_m) {
  const auto potential = [](Real x, Real y, Real z) {
    const Real gm = 3.986004418e14L, a = 6378137.0L, w = 7.292115e-5L, j2 = 1.082629821e-3L, j4 = -2.37091e-6L;
    const Real r = std::sqrt(x * x + y * y + z * z), s2 = z * z / (r * r), q = a * a / (r * r);
    const Real p2 = (3 * s2 - 1) / 2, p4 = (35 * s2 * s2 - 30 * s2 + 3) / 8;
    return gm / r * (1 - j2 * q * p2 - j4 * q * q * p4) + w * w * (x * x + y * y) / 2;
  };
  const Real x = p_e_m.x(), y = p_e_m.y(), z = p_e_m.z(), d = 10;
  return {static_cast<double>((potential(x + d, y, z) - potential(x - d, y, z)) / (2 * d)),
          static_cast<double>((potential(x, y + d, z) - potential(x, y - d, z)) / (2 * d)),
          static_cast<double>((potential(x, y, z + d) - potential(x, y, z - d)) / (2 * d))};
}

Geodetic random_geodetic(Rng& rng, double low_m, double high_m) {
  const double lat = searvins::test::chance(rng, 0.2) ? pi / 2 - std::pow(10.0, uniform(rng, -9, -1)) : uniform(rng, 0, pi / 2);
  return {searvins::test::chance(rng, 0.5) ? lat : -lat, uniform(rng, -pi, pi), uniform(rng, low_m, high_m)};
}

/// The error of the inverse, metres, along and across the surface.
double round_trip_error_m(const Geodetic& g) {
  const Eigen::Vector3d p_e_m = exact_ecef(g).cast<double>();
  const Geodetic back = geodesy::geodetic_from_ecef(p_e_m);
  return std::hypot(horizontal_m(g, back), back.height_m - g.height_m);
}

}  // namespace

TEST_CASE("wgs84: geodetic -> ECEF agrees with long double") {
  searvins::test::for_all_seeds(1000, [](Rng& rng) {
    const Geodetic g = random_geodetic(rng, -6e6, 5e7);
    const double radius = 6.4e6 + std::abs(g.height_m);
    CHECK((geodesy::ecef_from_geodetic(g) - exact_ecef(g).cast<double>()).norm() <= 1e-15 * radius);
  });
}

TEST_CASE("wgs84: ECEF -> geodetic inverts it to a few rounding errors, from 6000 km depth to 50,000 km height") {
  searvins::test::for_all_seeds(3000, [](Rng& rng) {
    const Geodetic near = random_geodetic(rng, -12e3, 20e3);
    CHECK(round_trip_error_m(near) <= 5e-9);
    const Geodetic orbit = random_geodetic(rng, 1e5, 5e7);
    CHECK(round_trip_error_m(orbit) <= 1e-15 * (6.4e6 + orbit.height_m));
    const Geodetic deep = random_geodetic(rng, -6e6, 0);  // nearer the centre than 43 km (the evolute) latitude is not unique
    CHECK(round_trip_error_m(deep) <= 1e-8);
  });
}

TEST_CASE("wgs84: poles, equator, date line and the centre of the Earth") {
  const double b = geodesy::kSemiMajorAxisM * (1 - geodesy::kFlattening);
  CHECK(std::abs(b - 6356752.314245) < 1e-6);
  for (const double h : {-5e6, -100.0, 0.0, 1.0, 8848.0, 2e7, 5e7}) {
    CAPTURE(h);
    for (const double sign : {1.0, -1.0}) {
      const Geodetic pole = geodesy::geodetic_from_ecef({0, 0, sign * (b + h)});
      CHECK(pole.lat_rad == doctest::Approx(sign * pi / 2).epsilon(1e-15));
      CHECK(pole.lon_rad == 0);
      CHECK(std::abs(pole.height_m - h) <= 1e-8 * (1 + std::abs(h) * 1e-7));
      const Geodetic east = geodesy::geodetic_from_ecef({0, sign * (geodesy::kSemiMajorAxisM + h), 0});
      CHECK(east.lat_rad == 0);
      CHECK(east.lon_rad == doctest::Approx(sign * pi / 2).epsilon(1e-15));
      CHECK(std::abs(east.height_m - h) <= 1e-8 * (1 + std::abs(h) * 1e-7));
    }
    const Geodetic date_line = geodesy::geodetic_from_ecef({-(geodesy::kSemiMajorAxisM + h), 1e-9, 0});
    CHECK(date_line.lon_rad == doctest::Approx(pi).epsilon(1e-15));
  }
  const Geodetic centre = geodesy::geodetic_from_ecef(Eigen::Vector3d::Zero());
  CHECK(centre.lat_rad == 0);
  CHECK(centre.height_m == -geodesy::kSemiMajorAxisM);
  CHECK((geodesy::ecef_from_geodetic({0, 0, 0}) - Eigen::Vector3d{6378137, 0, 0}).norm() == 0);
}

TEST_CASE("wgs84: the base station of the recordings, geodetic <-> ECEF") {
  const Geodetic base{30.290840979 * kRadPerDeg, -97.736925093 * kRadPerDeg, 169.191};
  const Eigen::Vector3d base_e_m{-742080.4125, -5462031.7412, 3198339.6909};
  CHECK((geodesy::ecef_from_geodetic(base) - base_e_m).norm() < 6e-4);  // the printed digits
  const Geodetic back = geodesy::geodetic_from_ecef(base_e_m);
  CHECK(std::abs(back.lat_rad - base.lat_rad) < 5.1e-10 * kRadPerDeg);
  CHECK(std::abs(back.lon_rad - base.lon_rad) < 5.1e-10 * kRadPerDeg);
  CHECK(std::abs(back.height_m - base.height_m) < 5.1e-4);
}

TEST_CASE("wgs84: R_ew is a rotation whose columns are the derivatives of position by longitude, latitude and height") {
  searvins::test::for_all_seeds(500, [](Rng& rng) {
    Geodetic g = random_geodetic(rng, -1e3, 1e5);
    g.lat_rad = uniform(rng, -1.5, 1.5);  // longitude has no derivative at a pole
    const Eigen::Matrix3d R_ew = geodesy::ecef_from_enu(g);
    CHECK((R_ew.transpose() * R_ew - Eigen::Matrix3d::Identity()).norm() <= 1e-15);
    CHECK((R_ew.col(0).cross(R_ew.col(1)) - R_ew.col(2)).norm() <= 1e-15);
    const auto slope = [&](double dlat, double dlon, double dh) -> Eigen::Vector3d {
      const Eigen::Vector3d ahead = geodesy::ecef_from_geodetic({g.lat_rad + dlat, g.lon_rad + dlon, g.height_m + dh});
      const Eigen::Vector3d behind = geodesy::ecef_from_geodetic({g.lat_rad - dlat, g.lon_rad - dlon, g.height_m - dh});
      return (ahead - behind).normalized();
    };
    CHECK((slope(0, 1e-5, 0) - R_ew.col(0)).norm() <= 1e-8);
    CHECK((slope(1e-5, 0, 0) - R_ew.col(1)).norm() <= 1e-8);
    CHECK((slope(0, 0, 100) - R_ew.col(2)).norm() <= 1e-9);
  });
}

TEST_CASE("wgs84: normal gravity, published values") {
  CHECK(geodesy::normal_gravity_mps2(0, 0) == doctest::Approx(9.7803253359).epsilon(1e-12));
  CHECK(std::abs(geodesy::normal_gravity_mps2(pi / 2, 0) - 9.8321849378) < 5e-9);
  CHECK(geodesy::normal_gravity_mps2(-pi / 2, 0) == geodesy::normal_gravity_mps2(pi / 2, 0));
  CHECK(std::abs(geodesy::normal_gravity_mps2(pi / 4, 0) - 9.8061977694) < 5e-9);
  CHECK(std::abs(geodesy::normal_gravity_mps2(30.290840979 * kRadPerDeg, 0) - 9.793477) < 2e-6);        // the base, on the ellipsoid
  CHECK(std::abs(geodesy::normal_gravity_mps2(30.290840979 * kRadPerDeg, 169.191) - 9.792953) < 1e-6);  // and at its height
  const double gradient = (geodesy::normal_gravity_mps2(pi / 4, 1) - geodesy::normal_gravity_mps2(pi / 4, -1)) / 2;
  CHECK(std::abs(gradient + 3.086e-6) < 3e-9);  // the free-air gradient, 0.3086 mGal/m
}

TEST_CASE("wgs84: normal gravity agrees with the gradient of the Earth's potential up to 20 km") {
  searvins::test::for_all_seeds(300, [](Rng& rng) {
    const Geodetic g = random_geodetic(rng, 0, 20e3);
    const Eigen::Vector3d truth = gravity_from_potential(geodesy::ecef_from_geodetic(g));
    CHECK(std::abs(geodesy::normal_gravity_mps2(g.lat_rad, g.height_m) - truth.norm()) < 2e-6);
  });
}

TEST_CASE("P22 wgs84: NaN and infinity give NaN or infinity, never a trap") {
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  for (const double bad : {nan, inf, -inf})
    for (int axis = 0; axis < 3; ++axis) {
      Eigen::Vector3d p_e_m{4e6, 1e6, 4.8e6};
      p_e_m[axis] = bad;
      const Geodetic g = geodesy::geodetic_from_ecef(p_e_m);
      CHECK_FALSE((std::isfinite(g.lat_rad) && std::isfinite(g.lon_rad) && std::isfinite(g.height_m)));
    }
  CHECK_FALSE(geodesy::ecef_from_geodetic({nan, 0, 0}).allFinite());
  CHECK_FALSE(geodesy::ecef_from_enu({nan, 0, 0}).allFinite());
  CHECK(std::isnan(geodesy::normal_gravity_mps2(nan, 0)));
  const double tiny = std::numeric_limits<double>::denorm_min();
  CHECK(std::isfinite(geodesy::geodetic_from_ecef({tiny, tiny, tiny}).height_m));
}
