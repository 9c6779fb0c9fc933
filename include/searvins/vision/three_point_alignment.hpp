// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The motion between two frames from three points seen in both: the minimal solver of stereo odometry.
///
/// Both frames know the points in three dimensions, a_i in the previous camera and b_i in the current one. Sought are R, t with a_i = R
/// b_i + t in the least-squares sense. With centroids taken off (they give t = a0 - R b0), R maximises  sum a_i . R b_i = tr(R H), H =
/// sum b_i a_i'. [Horn 1987; Kabsch 1976]
///
/// Three points lie in a plane, so H has rank two, and its null directions are the normals n_a and n_b of the triangles. The best R takes
/// n_b to n_a (points in the same order turn the same way round), and what is left is a turn by phi in the plane, where
///
///     sum a_i . R b_i = cos phi sum (x_a x_b + y_a y_b) + sin phi sum (y_a x_b - x_a y_b)
///     phi = atan2( sum (y_a x_b - x_a y_b), sum (x_a x_b + y_a y_b) )
///
/// is the maximum in closed form: no eigenvalues, no iteration. (x, y) are coordinates in the orthonormal frames F = [f1 f2 n], so R =
/// F_a Rz(phi) F_b'.
///
/// Thin triangles say nothing of the turn about their long side and are refused.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>

#include <searvins/core/status.hpp>
#include <searvins/vision/camera_motion.hpp>

namespace searvins::vision {

/// Three points in the axes of one camera, m.
using PointTriple = std::array<Eigen::Vector3d, 3>;

/// Twice the area of a triangle over the square of its longest side: 0 for points on a line, sqrt(3)/2 at most. NaN for one point thrice.
[[nodiscard]] inline double triangle_shape(const PointTriple& p) {
  const Eigen::Vector3d u = p[1] - p[0], v = p[2] - p[0];
  const double longest2 = std::max({u.squaredNorm(), v.squaredNorm(), (v - u).squaredNorm()});
  return u.cross(v).norm() / longest2;
}

namespace detail {

/// Orthonormal axes of a triangle: its first side, the direction in its plane, its normal.
[[nodiscard]] inline Eigen::Matrix3d triangle_axes(const PointTriple& p) {
  Eigen::Matrix3d F;
  F.col(0) = (p[1] - p[0]).normalized();
  F.col(2) = (p[1] - p[0]).cross(p[2] - p[0]).normalized();
  F.col(1) = F.col(2).cross(F.col(0));
  return F;
}

}  // namespace detail

/// The motion that aligns three points; p_prev_m[i] and p_cur_m[i] are the same point.
/// Errors: under_determined (a triangle of triangle_shape below min_shape, or not finite; value: the shape).
[[nodiscard]] inline Result<CameraMotion> align_three_points(const PointTriple& p_prev_m, const PointTriple& p_cur_m,
                                                             double min_shape = 0.02) {
  const double shape_prev = triangle_shape(p_prev_m), shape_cur = triangle_shape(p_cur_m);
  if (!(shape_prev >= min_shape && shape_cur >= min_shape))
    return failure(StatusCode::under_determined, "three points: nearly on a line", -1, -1, std::min(shape_prev, shape_cur));
  const Eigen::Vector3d mean_prev = (p_prev_m[0] + p_prev_m[1] + p_prev_m[2]) / 3, mean_cur = (p_cur_m[0] + p_cur_m[1] + p_cur_m[2]) / 3;
  const Eigen::Matrix3d F_prev = detail::triangle_axes(p_prev_m), F_cur = detail::triangle_axes(p_cur_m);
  double along = 0, across = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const Eigen::Vector3d a = F_prev.transpose() * (p_prev_m[i] - mean_prev), b = F_cur.transpose() * (p_cur_m[i] - mean_cur);
    along += a.x() * b.x() + a.y() * b.y();
    across += a.y() * b.x() - a.x() * b.y();
  }
  const double length = std::hypot(along, across);
  if (!(length > 0)) return failure(StatusCode::under_determined, "three points: the triangles have nothing in common");
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  turn(0, 0) = turn(1, 1) = along / length;
  turn(1, 0) = across / length, turn(0, 1) = -across / length;
  CameraMotion motion;
  motion.R_prev_cur = F_prev * turn * F_cur.transpose();
  motion.t_prev_cur_m = mean_prev - motion.R_prev_cur * mean_cur;
  return motion;
}

}  // namespace searvins::vision
