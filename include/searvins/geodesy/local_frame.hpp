// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The local frame w: East-North-Up at a fixed origin, and its place in the Earth.
///
///     p_e = p_e0 + R_ew p_w        p_w = R_ew' (p_e - p_e0)
#pragma once

#include <Eigen/Core>

#include <searvins/geodesy/wgs84.hpp>
#include <searvins/math/deferred.hpp>

namespace searvins::geodesy {

/// An East-North-Up frame. Positions in metres. Scalar: double or wider, as everywhere in ECEF.
template <class Scalar>
struct BasicLocalFrame {
  using Vector3 = Eigen::Matrix<Scalar, 3, 1>;
  using Matrix3 = Eigen::Matrix<Scalar, 3, 3>;

  Vector3 origin_e_m{Vector3::Zero()};
  Matrix3 R_ew{Matrix3::Identity()};

  [[nodiscard]] static BasicLocalFrame at(const Vector3& origin_e_m) {
    return {origin_e_m, ecef_from_enu<Scalar>(geodetic_from_ecef<Scalar>(origin_e_m))};
  }

  [[nodiscard]] Vector3 to_local(const Vector3& p_e_m) const { return R_ew.transpose() * (p_e_m - origin_e_m); }
  [[nodiscard]] Vector3 to_ecef(const Vector3& p_w_m) const { return origin_e_m + R_ew * p_w_m; }
};
using LocalFrame = BasicLocalFrame<double>;  ///< in double precision

/// Azimuth (clockwise from north) and elevation of a line of sight, radians.
struct AzimuthElevation {
  double azimuth_rad{0}, elevation_rad{0};
};

/// Where `target_e_m` appears from `position_e_m`, in the local axes of the position.
template <class Scalar = double>
[[nodiscard]] inline AzimuthElevation azimuth_elevation(const math::Vector3<Scalar>& position_e_m,
                                                        const math::Vector3<Scalar>& target_e_m) {
  const math::Vector3<Scalar> enu =
      ecef_from_enu<Scalar>(geodetic_from_ecef<Scalar>(position_e_m)).transpose() * (target_e_m - position_e_m);
  return {std::atan2(enu.x(), enu.y()), std::atan2(enu.z(), std::hypot(enu.x(), enu.y()))};
}

/// Gravity (gravitation plus centrifugal) at an ECEF position, in ECEF, m/s^2: normal gravity along the ellipsoidal normal.
template <class Scalar = double>
[[nodiscard]] inline math::Vector3<Scalar> gravity_e_mps2(const math::Vector3<Scalar>& p_e_m) {
  const Geodetic g = geodetic_from_ecef<Scalar>(p_e_m);
  return -normal_gravity_mps2(g.lat_rad, g.height_m) * ecef_from_enu<Scalar>(g).col(2);
}

}  // namespace searvins::geodesy
