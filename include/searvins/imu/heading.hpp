// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Heading from motion: what a velocity or a displacement of the antenna says about where a vehicle points.
///
/// A road vehicle moves along its forward axis. Its antenna, at the lever arm l, moves with  v forward + w x l,  so with the sideways part s of w x l
///
///     heading = course - asin(s / speed)       sigma^2 = (sigma_v / speed)^2 + sigma_course^2 + (w_up L / speed)^2
///
/// sigma_course: the unit's mounting and side slip; w_up L / speed: the body's own sideways speed in a turn, at L from the rear axle. A vehicle in
/// reverse moves against its forward axis: heading = course + pi, for the caller to tell (initializer.hpp does, from the accelerometer).
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cmath>

#include <searvins/imu/attitude_angles.hpp>

namespace searvins::imu {

/// A heading of the body's forward axis, clockwise from north of w.
struct HeadingEstimate {
  double heading_rad{0}, sigma_rad{0};
};

/// How vehicles move.
struct CourseModel {
  double sigma_course_rad{0.035};  ///< 2 degrees: mounting and side slip
  double rear_axle_m{1.5};         ///< between the unit and the rear axle, about
};

/// Heading from the antenna's velocity. `rate_level_radps` is the body's rate and `arm_level_m` the lever arm, both in level body axes: right,
/// forward, up. Needs a horizontal speed above zero.
[[nodiscard]] inline HeadingEstimate heading_from_velocity(const Eigen::Vector3d& v_w_mps, double sigma_mps, const Eigen::Vector3d& rate_level_radps,
                                                           const Eigen::Vector3d& arm_level_m, const CourseModel& model = {}) {
  const double speed = std::hypot(v_w_mps.x(), v_w_mps.y());
  const double sideways = rate_level_radps.y() * arm_level_m.z() - rate_level_radps.z() * arm_level_m.y();  // x of w x l
  const double slip = rate_level_radps.z() * model.rear_axle_m;
  return {wrapped(course_of(v_w_mps) - std::asin(std::clamp(sideways / speed, -1.0, 1.0))),
          std::sqrt((sigma_mps * sigma_mps + slip * slip) / (speed * speed) + model.sigma_course_rad * model.sigma_course_rad)};
}

/// Heading from two positions of the antenna on a straight stretch, `turn_rad` the most that the heading changed along it. The lever arm cancels but
/// for that turn. Needs a horizontal distance above zero.
[[nodiscard]] inline HeadingEstimate heading_from_displacement(const Eigen::Vector3d& d_w_m, double sigma_m, double turn_rad, double arm_m,
                                                               const CourseModel& model = {}) {
  const double distance = std::hypot(d_w_m.x(), d_w_m.y());
  const double lever = arm_m * turn_rad;
  return {course_of(d_w_m), std::sqrt((sigma_m * sigma_m + lever * lever) / (distance * distance) + turn_rad * turn_rad / 4 +
                                      model.sigma_course_rad * model.sigma_course_rad)};
}

}  // namespace searvins::imu
