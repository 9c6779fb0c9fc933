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
template <class Scalar>
using BasicPointTriple = std::array<Eigen::Matrix<Scalar, 3, 1>, 3>;
using PointTriple = BasicPointTriple<double>;  ///< in double precision

/// Twice the area of a triangle over the square of its longest side: 0 for points on a line, sqrt(3)/2 at most. NaN for one point thrice.
template <class Scalar = double>
[[nodiscard]] inline Scalar triangle_shape(const BasicPointTriple<Scalar>& p) {
  const Eigen::Matrix<Scalar, 3, 1> u = p[1] - p[0], v = p[2] - p[0];
  const Scalar longest2 = std::max({u.squaredNorm(), v.squaredNorm(), (v - u).squaredNorm()});
  return u.cross(v).norm() / longest2;
}

namespace detail {

/// Orthonormal axes of a triangle: its first side, the direction in its plane, its normal.
template <class Scalar>
[[nodiscard]] inline Eigen::Matrix<Scalar, 3, 3> triangle_axes(const BasicPointTriple<Scalar>& p) {
  Eigen::Matrix<Scalar, 3, 3> F;
  F.col(0) = (p[1] - p[0]).normalized();
  F.col(2) = (p[1] - p[0]).cross(p[2] - p[0]).normalized();
  F.col(1) = F.col(2).cross(F.col(0));
  return F;
}

}  // namespace detail

/// The motion that aligns three points; p_prev_m[i] and p_cur_m[i] are the same point.
/// Errors: under_determined (a triangle of triangle_shape below min_shape, or not finite; value: the shape).
template <class Scalar = double>
[[nodiscard]] inline Result<BasicCameraMotion<Scalar>> align_three_points(const BasicPointTriple<Scalar>& p_prev_m,
                                                                          const BasicPointTriple<Scalar>& p_cur_m,
                                                                          double min_shape = 0.02) {
  using Vector3 = Eigen::Matrix<Scalar, 3, 1>;
  using Matrix3 = Eigen::Matrix<Scalar, 3, 3>;
  const Scalar shape_prev = triangle_shape(p_prev_m), shape_cur = triangle_shape(p_cur_m);
  if (!(shape_prev >= min_shape && shape_cur >= min_shape))
    return failure(StatusCode::under_determined, "three points: nearly on a line", -1, -1, std::min(shape_prev, shape_cur));
  const Vector3 mean_prev = (p_prev_m[0] + p_prev_m[1] + p_prev_m[2]) / 3, mean_cur = (p_cur_m[0] + p_cur_m[1] + p_cur_m[2]) / 3;
  const Matrix3 F_prev = detail::triangle_axes(p_prev_m), F_cur = detail::triangle_axes(p_cur_m);
  Scalar along = 0, across = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vector3 a = F_prev.transpose() * (p_prev_m[i] - mean_prev), b = F_cur.transpose() * (p_cur_m[i] - mean_cur);
    along += a.x() * b.x() + a.y() * b.y();
    across += a.y() * b.x() - a.x() * b.y();
  }
  const Scalar length = std::hypot(along, across);
  if (!(length > 0)) return failure(StatusCode::under_determined, "three points: the triangles have nothing in common");
  Matrix3 turn = Matrix3::Identity();
  turn(0, 0) = turn(1, 1) = along / length;
  turn(1, 0) = across / length, turn(0, 1) = -across / length;
  BasicCameraMotion<Scalar> motion;
  motion.R_prev_cur = F_prev * turn * F_cur.transpose();
  motion.t_prev_cur_m = mean_prev - motion.R_prev_cur * mean_cur;
  return motion;
}

}  // namespace searvins::vision
