// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The WGS-84 ellipsoid: geodetic <-> Earth-centred Earth-fixed coordinates, local axes, normal gravity.
///
///     x = (N + h) cos(lat) cos(lon)        N = a / sqrt(1 - e^2 sin^2 lat)   (radius of the prime vertical)
///     y = (N + h) cos(lat) sin(lon)
///     z = (N (1 - e^2) + h) sin(lat)
///
/// Frame e is ECEF. Frame w is East-North-Up at an origin. R_ew maps w to e.
/// Positions have a Scalar, double or wider; geodetic coordinates are double.
#pragma once

#include <Eigen/Core>

#include <cmath>

#include <searvins/math/deferred.hpp>

namespace searvins::geodesy {

inline constexpr double kSemiMajorAxisM = 6378137.0;  ///< a of the ellipsoid, m
inline constexpr double kFlattening = 1.0 / 298.257223563;  ///< f of the ellipsoid
inline constexpr double kEccentricitySquared = kFlattening * (2.0 - kFlattening);  ///< e^2 of the ellipsoid
inline constexpr double kEarthRateRadps = 7.2921151467e-5;  ///< rotation of the Earth, IS-GPS-200

/// Geodetic coordinates: latitude and longitude in radians, height above the ellipsoid in metres.
struct Geodetic {
  double lat_rad{0}, lon_rad{0}, height_m{0};
};

/// ECEF position of a geodetic one, metres.
template <class Scalar = double>
[[nodiscard]] inline math::Vector3<Scalar> ecef_from_geodetic(const Geodetic& g) {
  const double s = std::sin(g.lat_rad), c = std::cos(g.lat_rad);
  const double n = kSemiMajorAxisM / std::sqrt(1.0 - kEccentricitySquared * s * s);
  return {(n + g.height_m) * c * std::cos(g.lon_rad), (n + g.height_m) * c * std::sin(g.lon_rad),
          (n * (1.0 - kEccentricitySquared) + g.height_m) * s};
}

/// Geodetic position of an ECEF one. Bowring's start and fixed-point refinement: a few rounding errors (measured 3 nm near the ground,
/// 15 nm at 50,000 km) from 6000 km below the ellipsoid upwards. Within 43 km of the centre of the Earth latitude is not unique; the
/// centre itself gives latitude 0. On the axis longitude is 0.
template <class Scalar = double>
[[nodiscard]] inline Geodetic geodetic_from_ecef(const math::Vector3<Scalar>& p_e_m) {
  const auto x = static_cast<double>(p_e_m.x()), y = static_cast<double>(p_e_m.y()), z = static_cast<double>(p_e_m.z());
  const double rho = std::hypot(x, y);
  Geodetic g;
  g.lon_rad = rho > 0 ? std::atan2(y, x) : 0.0;
  if (rho == 0 && z == 0) {
    g.height_m = -kSemiMajorAxisM;
    return g;
  }
  const double b = kSemiMajorAxisM * (1.0 - kFlattening);
  double beta = std::atan2(z, rho * (1.0 - kFlattening));  // reduced latitude, Bowring 1976
  for (int i = 0; i < 4; ++i) {
    const double sb = std::sin(beta), cb = std::cos(beta);
    const double ep2 = kEccentricitySquared / (1.0 - kEccentricitySquared);
    g.lat_rad = std::atan2(z + ep2 * b * sb * sb * sb, rho - kEccentricitySquared * kSemiMajorAxisM * cb * cb * cb);
    beta = std::atan2((1.0 - kFlattening) * std::sin(g.lat_rad), std::cos(g.lat_rad));
  }
  const double s = std::sin(g.lat_rad), c = std::cos(g.lat_rad);
  g.height_m = rho * c + z * s - kSemiMajorAxisM * std::sqrt(1.0 - kEccentricitySquared * s * s);
  return g;
}

/// R_ew: columns are the east, north and up axes at a geodetic position, in ECEF.
template <class Scalar = double>
[[nodiscard]] inline math::Matrix3<Scalar> ecef_from_enu(const Geodetic& g) {
  const double sp = std::sin(g.lat_rad), cp = std::cos(g.lat_rad), sl = std::sin(g.lon_rad), cl = std::cos(g.lon_rad);
  math::Matrix3<Scalar> R_ew;
  R_ew << -sl, -sp * cl, cp * cl,  //
      cl, -sp * sl, cp * sl,       //
      0, cp, sp;
  return R_ew;
}

/// Normal gravity on the ellipsoid, m/s^2 [Somigliana, WGS-84], reduced to height h to second order [Groves 2013, eq. 2.139].
[[nodiscard]] inline double normal_gravity_mps2(double lat_rad, double height_m) {
  const double s2 = std::sin(lat_rad) * std::sin(lat_rad);
  const double g0 = 9.7803253359 * (1.0 + 0.001931853 * s2) / std::sqrt(1.0 - kEccentricitySquared * s2);
  const double m =
      kEarthRateRadps * kEarthRateRadps * kSemiMajorAxisM * kSemiMajorAxisM * kSemiMajorAxisM * (1.0 - kFlattening) / 3.986004418e14;
  const double h = height_m / kSemiMajorAxisM;
  return g0 * (1.0 - 2.0 * h * (1.0 + kFlattening + m - 2.0 * kFlattening * s2) + 3.0 * h * h);
}

}  // namespace searvins::geodesy
