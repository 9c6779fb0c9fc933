// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The vehicle on its way: place, velocity and attitude of the IMU, what an ideal IMU feels, and where the antenna is.
///
/// Frames: e (ECEF), w (East-North-Up at the origin of the map), b (IMU; right, forward, up), i (inertial, the axes of e at the moment).
/// The heading h follows the way (the IMU sits over the rear axle); the nose rises with the slope and when accelerating, the body leans out
/// of a bend: R_wb = Rz(-h) Rx(pitch) Ry(roll), with Ry(r) lowering the right side for r > 0.
///
/// What the IMU feels, from p_i = R_ie(t) p_e with R_ie turning at the rate of the Earth, Omega, differentiated twice in i:
///
///     f_b = R_eb' (a_e + 2 Omega x v_e + Omega x Omega x p_e - gravitation_e)        w_ib_b = R_eb' Omega + w_wb_b
///
/// Gravitation is normal gravity (along the normal of the ellipsoid) without its centrifugal part; w_wb_b is the vee of R_wb' dR_wb/dt, a
/// five-point difference.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cmath>
#include <variant>

#include <searvins/geodesy/local_frame.hpp>
#include <searvins/geodesy/wgs84.hpp>

#include "path_motion.hpp"
#include "spline_route.hpp"
#include "street_route.hpp"

namespace searvins::simulator {

inline constexpr double kEarthRateRadps = 7.2921151467e-5;

/// State of the IMU at a time.
struct VehicleState {
  Eigen::Vector3d p_w_m, v_w_mps, a_w_mps2;
  Eigen::Matrix3d R_wb;
  Eigen::Vector3d w_wb_b_radps;
};

/// What an ideal IMU measures: specific force and rotation against inertial space, in body axes.
struct ImuTruth {
  Eigen::Vector3d f_b_mps2, w_ib_b_radps;
};

/// Normal gravity of the WGS-84 ellipsoid by Somigliana's formula in its symmetric form, second order in height, m/s^2.
[[nodiscard]] inline double normal_gravity_of_latitude(double latitude_rad, double height_m) {
  constexpr double a = 6'378'137.0, b = 6'356'752.3142, at_equator = 9.7803253359, at_pole = 9.8321849378;
  constexpr double flattening = 1 / 298.257223563, rotation = 0.00344978650684;  // w^2 a^2 b / GM
  const double c2 = std::cos(latitude_rad) * std::cos(latitude_rad), s2 = 1 - c2;
  const double on_ellipsoid = (a * at_equator * c2 + b * at_pole * s2) / std::sqrt(a * a * c2 + b * b * s2);
  const double up = height_m / a;
  return on_ellipsoid * (1 - 2 * (1 + flattening + rotation - 2 * flattening * s2) * up + 3 * up * up);
}

/// A vehicle that drives a route.
class Vehicle {
 public:
  using Route = std::variant<StreetRoute, SplineRoute>;

  Vehicle(Route route, const geodesy::LocalFrame& frame, const Eigen::Vector3d& lever_arm_b_m)
      : route_(std::move(route)), frame_(frame), lever_arm_b_m_(lever_arm_b_m) {}

  [[nodiscard]] const Route& route() const { return route_; }
  [[nodiscard]] const geodesy::LocalFrame& frame() const { return frame_; }
  [[nodiscard]] const Eigen::Vector3d& lever_arm_b_m() const { return lever_arm_b_m_; }
  [[nodiscard]] PathMotion path(double t_s) const {
    return std::visit([t_s](const auto& r) { return r.at(t_s); }, route_);
  }
  /// Height of the road under the vehicle, metres above the origin of the map.
  [[nodiscard]] double ground_m(double t_s) const { return climb(t_s, path(t_s)).x() - kImuAboveRoadM; }

  [[nodiscard]] VehicleState state(double t_s) const {
    const PathMotion m = path(t_s);
    const Eigen::Vector3d z = climb(t_s, m);
    VehicleState s;
    s.p_w_m << m.p_m, z.x();
    s.v_w_mps << m.v_mps, z.y();
    s.a_w_mps2 << m.a_mps2, z.z();
    s.R_wb = attitude(t_s);
    constexpr double h = 2e-3;
    const Eigen::Matrix3d rate = (8 * (attitude(t_s + h) - attitude(t_s - h)) - (attitude(t_s + 2 * h) - attitude(t_s - 2 * h))) / (12 * h);
    const Eigen::Matrix3d skew = s.R_wb.transpose() * rate;
    s.w_wb_b_radps << (skew(2, 1) - skew(1, 2)) / 2, (skew(0, 2) - skew(2, 0)) / 2, (skew(1, 0) - skew(0, 1)) / 2;
    return s;
  }

  [[nodiscard]] ImuTruth imu(double t_s) const {
    const VehicleState s = state(t_s);
    const Eigen::Vector3d earth_e{0, 0, kEarthRateRadps};
    const Eigen::Vector3d p_e = frame_.to_ecef(s.p_w_m), v_e = frame_.R_ew * s.v_w_mps;
    const geodesy::Geodetic place = geodesy::geodetic_from_ecef(p_e);
    const Eigen::Vector3d normal_e{std::cos(place.lat_rad) * std::cos(place.lon_rad), std::cos(place.lat_rad) * std::sin(place.lon_rad),
                                   std::sin(place.lat_rad)};
    const Eigen::Vector3d centripetal_e = earth_e.cross(earth_e.cross(p_e));
    const Eigen::Vector3d gravitation_e = -normal_gravity_of_latitude(place.lat_rad, place.height_m) * normal_e + centripetal_e;
    const Eigen::Vector3d a_i = frame_.R_ew * s.a_w_mps2 + 2 * earth_e.cross(v_e) + centripetal_e;
    const Eigen::Matrix3d R_eb = frame_.R_ew * s.R_wb;
    return {R_eb.transpose() * (a_i - gravitation_e), R_eb.transpose() * earth_e + s.w_wb_b_radps};
  }

  /// Antenna in the map, metres.
  [[nodiscard]] Eigen::Vector3d antenna_w_m(double t_s) const {
    const PathMotion m = path(t_s);
    return Eigen::Vector3d{m.p_m.x(), m.p_m.y(), climb(t_s, m).x()} + attitude(t_s) * lever_arm_b_m_;
  }
  [[nodiscard]] Eigen::Vector3d antenna_e_m(double t_s) const { return frame_.to_ecef(antenna_w_m(t_s)); }

  /// Attitude, body to map.
  [[nodiscard]] Eigen::Matrix3d attitude(double t_s) const {
    const PathMotion m = path(t_s);
    const double sine = std::sin(m.heading_rad), cosine = std::cos(m.heading_rad);
    const double forward = m.a_mps2.x() * sine + m.a_mps2.y() * cosine, right = m.a_mps2.x() * cosine - m.a_mps2.y() * sine;
    const double pitch = slope(m) + kPitchPerMps2 * forward, roll = -kRollPerMps2 * right;
    using Turn = Eigen::AngleAxisd;
    return (Turn(-m.heading_rad, Eigen::Vector3d::UnitZ()) * Turn(pitch, Eigen::Vector3d::UnitX()) * Turn(roll, Eigen::Vector3d::UnitY()))
        .toRotationMatrix();
  }

 private:
  static constexpr double kImuAboveRoadM = 1.6, kPitchPerMps2 = 0.008, kRollPerMps2 = 0.010;
  static constexpr double kHillEastM = 2.0, kHillNorthM = 1.5, kPerEastM = 1 / 170.0, kPerNorthM = 1 / 210.0;

  /// Height of the IMU with two derivatives in time: hills on generated routes, the given height on others.
  [[nodiscard]] Eigen::Vector3d climb(double t_s, const PathMotion& m) const {
    if (const auto* given = std::get_if<SplineRoute>(&route_)) return given->height_at(t_s);
    const double e = m.p_m.x() * kPerEastM, n = m.p_m.y() * kPerNorthM;
    const double de = kHillEastM * kPerEastM * std::cos(e), dn = -kHillNorthM * kPerNorthM * std::sin(n);
    const double dee = -kHillEastM * kPerEastM * kPerEastM * std::sin(e), dnn = -kHillNorthM * kPerNorthM * kPerNorthM * std::cos(n);
    return {kImuAboveRoadM + kHillEastM * std::sin(e) + kHillNorthM * (std::cos(n) - 1), de * m.v_mps.x() + dn * m.v_mps.y(),
            de * m.a_mps2.x() + dn * m.a_mps2.y() + dee * m.v_mps.x() * m.v_mps.x() + dnn * m.v_mps.y() * m.v_mps.y()};
  }

  /// Slope of the road along the heading, radians; given routes keep level.
  [[nodiscard]] double slope(const PathMotion& m) const {
    if (std::holds_alternative<SplineRoute>(route_)) return 0;
    const double de = kHillEastM * kPerEastM * std::cos(m.p_m.x() * kPerEastM);
    const double dn = -kHillNorthM * kPerNorthM * std::sin(m.p_m.y() * kPerNorthM);
    return std::atan(de * std::sin(m.heading_rad) + dn * std::cos(m.heading_rad));
  }

  Route route_;
  geodesy::LocalFrame frame_;
  Eigen::Vector3d lever_arm_b_m_;
};

}  // namespace searvins::simulator
