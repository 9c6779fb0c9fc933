// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Geometric range and range rate between a satellite and a receiver in ECEF, with the rotation of the Earth during the flight.
///
/// The satellite position s is given in the ECEF axes of the transmission, the receiver position p in those of the reception. In the
/// latter the satellite stood at S = Rz(theta) s with theta = omega_e rho / c. To first order in theta (error below 0.3 mm near the Earth)
///
///     |p - Rz(theta) s|  =  |p - s| + (omega_e / c) (x_s y_p - y_s x_p)                    the Sagnac term, up to 41 m (MEO), 66 m (GEO)
///     d range / d p      =  (p - s)' / |p - s| + (omega_e / c) [-y_s, x_s, 0]
///
/// Range rate. With u = (p - S) / |p - S|, pointing from satellite to receiver, velocities in inertial space v + omega x position, and
/// the light time d t_tx / d t_rx = 1 - rate / c,
///
///     rate = u' (v_p + omega x p) - (1 - rate / c) u' (V_s + omega x S)           V_s = Rz(theta) v_s
///          = u' (v_p - V_s) / (1 - u' (V_s + omega x S) / c)                      since u' (omega x (p - S)) = 0
///
/// The denominator is worth up to 2 mm/s. Clock drifts come on top: -wavelength * Doppler = rate + c (receiver drift - satellite drift).
#pragma once

#include <Eigen/Core>

#include <cmath>

#include <searvins/geodesy/wgs84.hpp>
#include <searvins/gnss/signal.hpp>
#include <searvins/math/deferred.hpp>

namespace searvins::gnss {

/// Coordinates, in the ECEF axes `flight_s` later, of a point or a velocity given in ECEF axes: Rz(omega_e flight_s) v.
template <class Scalar = double>
[[nodiscard]] inline math::Vector3<Scalar> in_axes_after(const math::Vector3<Scalar>& v_e, double flight_s) {
  const double theta = geodesy::kEarthRateRadps * flight_s, c = std::cos(theta), s = std::sin(theta);
  return {c * v_e.x() + s * v_e.y(), c * v_e.y() - s * v_e.x(), v_e.z()};
}

/// Range in metres from the satellite (ECEF at transmission) to the receiver (ECEF at reception). Optionally d range / d p.
/// The two points must differ.
template <class Scalar = double>
[[nodiscard]] inline double range_m(const math::Vector3<Scalar>& p_e_m, const math::Vector3<Scalar>& satellite_e_m,
                                    math::Vector3<Scalar>* d_range_d_p = nullptr) {
  constexpr double k = geodesy::kEarthRateRadps / kSpeedOfLightMps;
  const math::Vector3<Scalar> line = p_e_m - satellite_e_m;
  const double distance_m = line.norm();
  if (d_range_d_p) *d_range_d_p = line / distance_m + math::Vector3<Scalar>{-k * satellite_e_m.y(), k * satellite_e_m.x(), 0.0};
  return distance_m + k * (satellite_e_m.x() * p_e_m.y() - satellite_e_m.y() * p_e_m.x());
}

/// Unit vector from the satellite to the receiver, in ECEF axes at reception.
template <class Scalar = double>
[[nodiscard]] inline math::Vector3<Scalar> direction_from_satellite(const math::Vector3<Scalar>& p_e_m,
                                                                    const math::Vector3<Scalar>& satellite_e_m) {
  const math::Vector3<Scalar> rotated_e_m = in_axes_after<Scalar>(satellite_e_m, (p_e_m - satellite_e_m).norm() / kSpeedOfLightMps);
  return (p_e_m - rotated_e_m).normalized();
}

/// Range rate in m/s, positive when the satellite recedes, clocks excluded. Velocities are relative to ECEF: the receiver's at reception,
/// the satellite's at transmission. Optionally d rate / d v (receiver velocity).
template <class Scalar = double>
[[nodiscard]] inline double range_rate_mps(const math::Vector3<Scalar>& p_e_m, const math::Vector3<Scalar>& v_e_mps,
                                           const math::Vector3<Scalar>& satellite_e_m, const math::Vector3<Scalar>& satellite_v_e_mps,
                                           math::Vector3<Scalar>* d_rate_d_v = nullptr) {
  const double flight_s = (p_e_m - satellite_e_m).norm() / kSpeedOfLightMps;
  const math::Vector3<Scalar> S = in_axes_after<Scalar>(satellite_e_m, flight_s), u = (p_e_m - S).normalized();
  const double toward_mps = u.dot(in_axes_after<Scalar>(satellite_v_e_mps, flight_s));
  const double turning_mps = geodesy::kEarthRateRadps * (u.y() * S.x() - u.x() * S.y());  // u' (omega x S)
  const double scale = 1.0 / (1.0 - (toward_mps + turning_mps) / kSpeedOfLightMps);
  if (d_rate_d_v) *d_rate_d_v = scale * u;
  return scale * (u.dot(v_e_mps) - toward_mps);
}

}  // namespace searvins::gnss
