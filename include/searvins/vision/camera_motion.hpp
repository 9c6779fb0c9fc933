// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// How the left camera moved from one frame to the next, and how far two opinions on that are apart.
///
///     p_prev = R_prev_cur p_cur + t_prev_cur        a point fixed in the world, in the axes of the previous and of the current camera
///
/// so t_prev_cur is where the current camera stands in the previous one's axes: (0, 0, +z) when the vehicle drives forward. From poses of
/// the camera in the world, R_prev_cur = R_wprev' R_wcur and t_prev_cur = R_wprev' (p_wcur - p_wprev).
///
/// Tangent order: dtheta (on the right, in current axes: R Exp(dtheta), rad), dt (previous axes, m), as everywhere in the library.
#pragma once

#include <Eigen/Core>

#include <searvins/math/so3.hpp>

namespace searvins::vision {

/// See the file comment.
template <class Scalar>
struct BasicCameraMotion {
  using Vector3 = Eigen::Matrix<Scalar, 3, 1>;
  using Matrix3 = Eigen::Matrix<Scalar, 3, 3>;
  using Tangent = Eigen::Matrix<Scalar, 6, 1>;

  Matrix3 R_prev_cur{Matrix3::Identity()};
  Vector3 t_prev_cur_m{Vector3::Zero()};

  /// A point of the previous frame in coordinates of the current one.
  [[nodiscard]] Vector3 to_current(const Vector3& p_prev_m) const { return R_prev_cur.transpose() * (p_prev_m - t_prev_cur_m); }
  /// A point of the current frame in coordinates of the previous one.
  [[nodiscard]] Vector3 to_previous(const Vector3& p_cur_m) const { return R_prev_cur * p_cur_m + t_prev_cur_m; }

  /// This motion followed by `next`, the one from its current frame on.
  [[nodiscard]] BasicCameraMotion then(const BasicCameraMotion& next) const {
    return {R_prev_cur * next.R_prev_cur, R_prev_cur * next.t_prev_cur_m + t_prev_cur_m};
  }
  /// The motion moved by a tangent vector [dtheta, dt].
  [[nodiscard]] BasicCameraMotion plus(const Tangent& delta) const {
    return {R_prev_cur * so3::exp(delta.template head<3>()), t_prev_cur_m + delta.template tail<3>()};
  }
  /// Tangent vector that leads from `other` to this one: other.plus(minus(other)) is this motion.
  [[nodiscard]] Tangent minus(const BasicCameraMotion& other) const {
    Tangent delta;
    delta << so3::log(other.R_prev_cur.transpose() * R_prev_cur), t_prev_cur_m - other.t_prev_cur_m;
    return delta;
  }
  /// Angle of the rotation, rad in [0, pi].
  [[nodiscard]] Scalar angle_rad() const { return so3::log(R_prev_cur).norm(); }
  [[nodiscard]] bool finite() const { return R_prev_cur.allFinite() && t_prev_cur_m.allFinite(); }
};

using CameraMotion = BasicCameraMotion<double>;  ///< in double precision

}  // namespace searvins::vision
