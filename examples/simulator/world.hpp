// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// What lies between satellite and antenna: the way of the signal, the atmosphere and the walls of a street.
///
/// Way. The satellite is taken at transmission and turned with the Earth during the flight; tau = |p - Rot_z(-omega tau) s(t - tau)| / c is
/// iterated to convergence, so no Sagnac term has to be added.
///
/// Street. Walls of height H (above the antenna) run along the heading psi at distances d to either side. With a = |sin(azimuth - psi)| the
/// direct ray clears its wall when tan(el) > H a / d. Else it can come back from the opposite wall (distance d'), when it passes over its
/// own wall on the way there and still meets the other one,
///
///     H a / (2 d' + d)  <  tan(el)  <  H a / d'          extra path 2 d' a cos(el)      (mirror image of the antenna behind the wall).
/// The facade does not reflect everywhere; the receiver model decides when.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cmath>
#include <numbers>

#include <searvins/geodesy/local_frame.hpp>

#include "orbit.hpp"

namespace searvins::simulator {

/// How a signal arrives.
enum class Path { direct, reflected, blocked };

/// Walls to the left and to the right of the antenna.
struct Street {
  double heading_rad{0}, wall_height_m{0}, left_m{1}, right_m{1};

  /// How a satellite in this direction is received.
  [[nodiscard]] Path path(const geodesy::AzimuthElevation& line) const {
    const double side = std::sin(line.azimuth_rad - heading_rad), across = std::abs(side), slope = std::tan(line.elevation_rad);
    const double own_m = side > 0 ? right_m : left_m, opposite_m = side > 0 ? left_m : right_m;
    if (slope > wall_height_m * across / own_m) return Path::direct;
    if (slope > wall_height_m * across / (2 * opposite_m + own_m) && slope < wall_height_m * across / opposite_m) return Path::reflected;
    return Path::blocked;
  }

  /// How much longer than the direct way a reflection in the opposite wall is, metres.
  [[nodiscard]] double extra_m(const geodesy::AzimuthElevation& line) const {
    const double side = std::sin(line.azimuth_rad - heading_rad);
    return 2 * (side > 0 ? left_m : right_m) * std::abs(side) * std::cos(line.elevation_rad);
  }
};

/// The direct way of a signal that is received at t (GPS time).
struct Flight {
  double length_m{0}, transmitted_s{0};
  geodesy::AzimuthElevation line{};
};

[[nodiscard]] inline Flight flight_of(const Orbit& orbit, const Eigen::Vector3d& p_e_m, double t_s) {
  double tau_s = 0.075;
  Eigen::Vector3d seen_e_m;
  for (int i = 0; i < 8; ++i) {
    seen_e_m = Eigen::AngleAxisd(-7.2921151467e-5 * tau_s, Eigen::Vector3d::UnitZ()) * satellite_position_e_m(orbit, t_s - tau_s);
    tau_s = (p_e_m - seen_e_m).norm() / kLightMps;
  }
  return {tau_s * kLightMps, t_s - tau_s, geodesy::azimuth_elevation(p_e_m, seen_e_m)};
}

/// Delay of the troposphere, metres: 2.31 m hydrostatic and 0.14 m wet at sea level, mapped as Chao (1974) does for the wet part.
[[nodiscard]] inline double troposphere_m(double height_m, double elevation_rad) {
  const double zenith_m = 2.31 * std::exp(-height_m / 8400) + 0.14 * std::exp(-height_m / 2100);
  return zenith_m / (std::sin(elevation_rad) + 0.00143 / (std::tan(elevation_rad) + 0.0445));
}

/// Delay of the ionosphere on L1 (1575.42 MHz), metres: a thin shell at 400 km, 2.4 m at the zenith, growing southwards.
[[nodiscard]] inline double ionosphere_l1_m(const geodesy::Geodetic& receiver, const geodesy::AzimuthElevation& line) {
  const double sine = 6371.0 / 6771.0 * std::cos(line.elevation_rad);
  const double central_rad = std::numbers::pi / 2 - line.elevation_rad - std::asin(sine);
  const double latitude_rad = receiver.lat_rad + central_rad * std::cos(line.azimuth_rad);
  return 2.4 * (1 - 1.5 * (latitude_rad - 48 * std::numbers::pi / 180)) / std::sqrt(1 - sine * sine);
}

}  // namespace searvins::simulator
