// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The rectified stereo camera: where a point is seen by both eyes [paper eq. (stereo-factor), pi_s].
///
/// Camera frame c: the left camera, x right, y down, z forward. The right camera lies at (B, 0, 0) with the same axes and intrinsics (that
/// is what rectification is for, rectification.hpp), so one row v serves both. With q = 1/z,
///
///     uL = cx + fx x q        uR = uL - fx B q        v = cy + fy y q                       pixels
///
///                 | fx q    0    fx x q'       |
///     d / d p_c = | fx q    0    fx (x - B) q' |           q' = -q^2
///                 |  0    fy q   fy y q'       |           determinant  fx^2 fy B q^2 q'
///
/// Near and behind. A point nearer than `min_depth_m` is seen by no camera, and project() refuses it. An optimiser may still put a
/// landmark there on its way (a moving thing taken for a static one drifts behind the vehicle), and needs a function that is defined for
/// every point, has no stationary point and no jump, and leads back in front. continued() is that: below a depth m, 1/z is replaced by its
/// tangent,
///
///     q(z) = (2 m - z) / m^2,   q' = -1/m^2          z < m
///
/// q then is positive, decreasing, convex and continuously differentiable on the whole line. Positive and decreasing: the determinant above
/// is never zero, so one observation informs all three axes wherever the point is. Convex: Newton's method on q(z) = q_seen from below
/// climbs to the root without ever passing it. Where z >= m the two functions are the same. The larger m, the gentler the slope behind:
/// fx B / m^2 pixels a metre.
///
/// A pixel (0, 0) is the centre of the first pixel; v grows downwards.
#pragma once

#include <Eigen/Core>

#include <cmath>
#include <concepts>

#include <searvins/core/status.hpp>
#include <searvins/math/so3.hpp>

namespace searvins::vision {

/// What both eyes see of a point: (uL, uR, v), pixels of the rectified images.
template <class S>
using StereoPixel = Eigen::Matrix<S, 3, 1>;

/// See the file comment.
template <std::floating_point S>
struct StereoCamera {
  using Scalar = S;
  using Vector3 = Eigen::Matrix<S, 3, 1>;
  using Matrix3 = Eigen::Matrix<S, 3, 3>;

  S fx_px{0}, fy_px{0}, cx_px{0}, cy_px{0};
  S baseline_m{0};        ///< B > 0
  S min_depth_m{S(0.1)};  ///< m > 0: nothing nearer is seen
  int width_px{0}, height_px{0};
  Matrix3 R_bc{Matrix3::Identity()};  ///< camera axes in b
  Vector3 p_bc_m{Vector3::Zero()};    ///< left camera in b

  template <class T>
  [[nodiscard]] StereoCamera<T> cast() const {
    return {static_cast<T>(fx_px),
            static_cast<T>(fy_px),
            static_cast<T>(cx_px),
            static_cast<T>(cy_px),
            static_cast<T>(baseline_m),
            static_cast<T>(min_depth_m),
            width_px,
            height_px,
            R_bc.template cast<T>(),
            p_bc_m.template cast<T>()};
  }

  /// Camera axes from body axes, and back.
  [[nodiscard]] Vector3 camera_from_body(const Vector3& p_b_m) const { return R_bc.transpose() * (p_b_m - p_bc_m); }
  [[nodiscard]] Vector3 body_from_camera(const Vector3& p_c_m) const { return R_bc * p_c_m + p_bc_m; }

  /// Whether a point is far enough in front to be seen. A NaN is not.
  [[nodiscard]] bool in_front(const Vector3& p_c_m) const { return p_c_m.z() >= min_depth_m; }
  /// Whether a pixel lies on the image; `border_px` from its edges.
  [[nodiscard]] bool inside(S u_px, S v_px, S border_px = S(0)) const {
    return u_px >= border_px && v_px >= border_px && u_px <= static_cast<S>(width_px - 1) - border_px &&
           v_px <= static_cast<S>(height_px - 1) - border_px;
  }
  /// Whether both eyes see it.
  [[nodiscard]] bool inside(const StereoPixel<S>& z, S border_px = S(0)) const {
    return inside(z[0], z[2], border_px) && inside(z[1], z[2], border_px);
  }

  /// pi_s and, if asked, its Jacobian by p_c. Errors: rejected (value: the depth, m) nearer than min_depth_m, behind, or not finite.
  [[nodiscard]] Result<StereoPixel<S>> project(const Vector3& p_c_m, Matrix3* d_p_c = nullptr) const {
    if (!in_front(p_c_m) || !p_c_m.allFinite())
      return failure(StatusCode::rejected, "point is behind the camera or too near", -1, -1, static_cast<double>(p_c_m.z()));
    return continued(p_c_m, d_p_c);
  }

  /// pi_s, continued to every point by its tangent below `below_m` (at least min_depth_m): see the file comment. For optimisers.
  [[nodiscard]] StereoPixel<S> continued(const Vector3& p_c_m, Matrix3* d_p_c, S below_m) const {
    const S z = p_c_m.z(), m = below_m > min_depth_m ? below_m : min_depth_m;
    const S q = z >= m ? S(1) / z : (2 * m - z) / (m * m);
    if (d_p_c) {
      const S dq = z >= m ? -q * q : S(-1) / (m * m);
      *d_p_c << fx_px * q, S(0), fx_px * p_c_m.x() * dq,           //
          fx_px * q, S(0), fx_px * (p_c_m.x() - baseline_m) * dq,  //
          S(0), fy_px * q, fy_px * p_c_m.y() * dq;
    }
    const S u = cx_px + fx_px * p_c_m.x() * q;
    return {u, u - fx_px * baseline_m * q, cy_px + fy_px * p_c_m.y() * q};
  }
  [[nodiscard]] StereoPixel<S> continued(const Vector3& p_c_m, Matrix3* d_p_c = nullptr) const {
    return continued(p_c_m, d_p_c, min_depth_m);
  }

  /// Disparity uL - uR of a depth, px, and depth of a disparity, m (both positive).
  [[nodiscard]] S disparity_px(S depth_m) const { return fx_px * baseline_m / depth_m; }
  [[nodiscard]] S depth_m(S disparity) const { return fx_px * baseline_m / disparity; }
};

namespace detail {

/// Orthonormal to 1e-4 and right-handed.
template <class S>
[[nodiscard]] bool is_rotation(const Eigen::Matrix<S, 3, 3>& R) {
  const Eigen::Matrix<S, 3, 1> x = R.col(0), y = R.col(1), z = R.col(2);
  return (R.transpose() * R).isIdentity(S(1e-4)) && (so3::skew(x) * y).dot(z) > S(0);
}

}  // namespace detail

/// Errors: invalid_argument with what is wrong.
template <class S>
[[nodiscard]] Status check(const StereoCamera<S>& c) {
  const auto positive = [](S x) { return x > S(0) && std::isfinite(x); };
  if (c.width_px < 2 || c.height_px < 2)
    return failure(StatusCode::invalid_argument, "stereo camera: the image needs a width and a height");
  if (!positive(c.fx_px) || !positive(c.fy_px))
    return failure(StatusCode::invalid_argument, "stereo camera: focal lengths must be positive");
  if (!positive(c.baseline_m))
    return failure(StatusCode::invalid_argument, "stereo camera: the baseline must be positive: are left and right swapped?");
  if (!positive(c.min_depth_m)) return failure(StatusCode::invalid_argument, "stereo camera: the least depth must be positive");
  if (!c.inside(c.cx_px, c.cy_px))
    return failure(StatusCode::invalid_argument, "stereo camera: the principal point lies outside the image");
  if (!detail::is_rotation(c.R_bc) || !c.p_bc_m.allFinite())
    return failure(StatusCode::invalid_argument, "stereo camera: its pose in the body is not a rotation and a place");
  return ok_status();
}

}  // namespace searvins::vision
