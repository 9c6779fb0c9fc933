// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Roll, pitch and heading of the body, as reports give them, and back. Body b is right-forward-up, w is east-north-up; the angles are those of the body
/// turned into forward-right-down axes in north-east-down:
///
///     R_wb = S Rz(heading) Ry(pitch) Rx(roll) S        S swaps the first two axes and negates the third
///
/// heading is clockwise from north, pitch positive nose up, roll positive right side down. Hence, with forward f = R_wb e_y and right r = R_wb e_x,
///
///     heading = atan2(f_east, f_north)      pitch = asin(f_up)      roll = atan2(-r_up, u_up)
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <numbers>

#include <searvins/math/deferred.hpp>

namespace searvins::imu {

/// Radians, each in [-pi, pi], pitch in [-pi/2, pi/2].
struct AttitudeAngles {
  double roll_rad{0}, pitch_rad{0}, heading_rad{0};
};

/// The angle in [-pi, pi] that is the same direction.
[[nodiscard]] inline double wrapped(double angle_rad) { return std::remainder(angle_rad, 2 * std::numbers::pi); }

/// Heading of the body's forward axis, clockwise from north; 0 when it points straight up or down.
[[nodiscard]] inline double heading_of(const Eigen::Matrix3d& R_wb) { return std::atan2(R_wb(0, 1), R_wb(1, 1)); }

/// Heading of a horizontal direction in w, clockwise from north.
[[nodiscard]] inline double course_of(const Eigen::Vector3d& v_w) { return std::atan2(v_w.x(), v_w.y()); }

/// Angles of an attitude.
[[nodiscard]] inline AttitudeAngles attitude_angles(const Eigen::Matrix3d& R_wb) {
  return {std::atan2(-R_wb(2, 0), R_wb(2, 2)), std::asin(std::clamp(R_wb(2, 1), -1.0, 1.0)), heading_of(R_wb)};
}

/// Attitude of angles.
template <class Scalar = double>
[[nodiscard]] inline math::Matrix3<Scalar> R_wb_from(const AttitudeAngles& a) {
  const double sr = std::sin(a.roll_rad), cr = std::cos(a.roll_rad), sp = std::sin(a.pitch_rad), cp = std::cos(a.pitch_rad);
  const double sh = std::sin(a.heading_rad), ch = std::cos(a.heading_rad);
  math::Matrix3<Scalar> R_wb;  // columns: right, forward, up of the body in east, north, up
  R_wb << sh * sp * sr + ch * cr, sh * cp, -sh * sp * cr + ch * sr,  //
      ch * sp * sr - sh * cr, ch * cp, -ch * sp * cr - sh * sr,      //
      -cp * sr, sp, cp * cr;
  return R_wb;
}

}  // namespace searvins::imu
