// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The local frame w: East-North-Up at a fixed origin, and its place in the Earth.
///
///     p_e = p_e0 + R_ew p_w        p_w = R_ew' (p_e - p_e0)
#pragma once

#include <Eigen/Core>

#include <searvins/geodesy/wgs84.hpp>

namespace searvins::geodesy {

/// An East-North-Up frame. Positions in metres.
struct LocalFrame {
  Eigen::Vector3d origin_e_m{Eigen::Vector3d::Zero()};
  Eigen::Matrix3d R_ew{Eigen::Matrix3d::Identity()};

  [[nodiscard]] static LocalFrame at(const Eigen::Vector3d& origin_e_m) { return {origin_e_m, ecef_from_enu(geodetic_from_ecef(origin_e_m))}; }

  [[nodiscard]] Eigen::Vector3d to_local(const Eigen::Vector3d& p_e_m) const { return R_ew.transpose() * (p_e_m - origin_e_m); }
  [[nodiscard]] Eigen::Vector3d to_ecef(const Eigen::Vector3d& p_w_m) const { return origin_e_m + R_ew * p_w_m; }
};

/// Azimuth (clockwise from north) and elevation of a line of sight, radians.
struct AzimuthElevation {
  double azimuth_rad{0}, elevation_rad{0};
};

/// Where `target_e_m` appears from `position_e_m`, in the local axes of the position.
[[nodiscard]] inline AzimuthElevation azimuth_elevation(const Eigen::Vector3d& position_e_m, const Eigen::Vector3d& target_e_m) {
  const Eigen::Vector3d enu = ecef_from_enu(geodetic_from_ecef(position_e_m)).transpose() * (target_e_m - position_e_m);
  return {std::atan2(enu.x(), enu.y()), std::atan2(enu.z(), std::hypot(enu.x(), enu.y()))};
}

/// Gravity (gravitation plus centrifugal) at an ECEF position, in ECEF, m/s^2: normal gravity along the ellipsoidal normal.
[[nodiscard]] inline Eigen::Vector3d gravity_e_mps2(const Eigen::Vector3d& p_e_m) {
  const Geodetic g = geodetic_from_ecef(p_e_m);
  return -normal_gravity_mps2(g.lat_rad, g.height_m) * ecef_from_enu(g).col(2);
}

}  // namespace searvins::geodesy
