// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// A point in space from one stereo observation (uL, uR, v), with its covariance. The inverse of pi_s (stereo_camera.hpp): with the
/// disparity d = uL - uR,
///
///     x = (uL - cx) B / d        y = (v - cy) fx B / (fy d)        z = fx B / d
///
///                     | (B - x)/d    x/d     0   |
///     J = d p / d z = |   -y/d       y/d   z/fy  |        covariance  J Sigma J'
///                     |   -z/d       z/d     0   |
///
/// To first order: the spread of z is z sigma_d / d = z^2 sigma_d / (fx B), growing with the square of the depth, and second order adds a
/// mean error of z (sigma_d / d)^2. Both are small against z while d is many sigma_d; the limits on depth and disparity see to that.
#pragma once

#include <Eigen/Core>

#include <concepts>
#include <cstdint>

#include <searvins/core/status.hpp>
#include <searvins/vision/stereo_camera.hpp>

namespace searvins::vision {

/// Which observations are worth a point. Defaults: a street seen with a baseline of half a metre.
template <std::floating_point S>
struct RangeLimits {
  S min_depth_m{S(1)}, max_depth_m{S(60)};
  S min_disparity_px{S(3)};
};

/// Why an observation gives no point.
enum class RangeFault : std::uint8_t {
  none,
  not_finite,    ///< a NaN or infinity
  no_disparity,  ///< uL <= uR: behind the camera, or a wrong match
  too_near,      ///< nearer than min_depth_m
  too_far        ///< beyond max_depth_m, or less disparity than min_disparity_px
};

/// Text of a fault, for messages.
[[nodiscard]] constexpr const char* name_of(RangeFault fault) {
  switch (fault) {
    case RangeFault::none: return "none";
    case RangeFault::not_finite: return "stereo observation with a NaN or infinity";
    case RangeFault::no_disparity: return "stereo observation without positive disparity";
    case RangeFault::too_near: return "stereo observation of a point nearer than the least depth";
    case RangeFault::too_far: return "stereo observation of a point beyond the greatest depth";
  }
  return "?";
}

/// Looks at the disparity alone. The bounds themselves are within.
template <class S>
[[nodiscard]] RangeFault range_fault(const StereoCamera<S>& camera, const StereoPixel<S>& pixel, const RangeLimits<S>& limits = {}) {
  if (!pixel.allFinite()) return RangeFault::not_finite;
  const S disparity = pixel[0] - pixel[1];
  if (!(disparity > S(0))) return RangeFault::no_disparity;
  const S depth_m = camera.depth_m(disparity);
  if (depth_m < limits.min_depth_m || depth_m < camera.min_depth_m) return RangeFault::too_near;
  if (!(depth_m <= limits.max_depth_m) || disparity < limits.min_disparity_px) return RangeFault::too_far;
  return RangeFault::none;
}

/// A point in camera axes and how well it is known.
template <std::floating_point S>
struct StereoPoint {
  Eigen::Matrix<S, 3, 1> p_c_m{Eigen::Matrix<S, 3, 1>::Zero()};
  Eigen::Matrix<S, 3, 3> covariance_c_m2{Eigen::Matrix<S, 3, 3>::Zero()};
};

/// The point at a pixel of positive disparity, and optionally its Jacobian by (uL, uR, v).
template <class S>
[[nodiscard]] Eigen::Matrix<S, 3, 1> point_at(const StereoCamera<S>& camera, const StereoPixel<S>& pixel,
                                              Eigen::Matrix<S, 3, 3>* d_pixel = nullptr) {
  const S d = pixel[0] - pixel[1], z = camera.depth_m(d);
  const S x = (pixel[0] - camera.cx_px) * camera.baseline_m / d, y = (pixel[2] - camera.cy_px) * z / camera.fy_px;
  if (d_pixel) {
    *d_pixel << (camera.baseline_m - x) / d, x / d, S(0),  //
        -y / d, y / d, z / camera.fy_px,                   //
        -z / d, z / d, S(0);
  }
  return {x, y, z};
}

/// Triangulates. `covariance_px2`: of (uL, uR, v). Errors: non_finite; rejected with the text of the fault (detail: the RangeFault).
template <class S>
[[nodiscard]] Result<StereoPoint<S>> triangulate(const StereoCamera<S>& camera, const StereoPixel<S>& pixel,
                                                 const Eigen::Matrix<S, 3, 3>& covariance_px2, const RangeLimits<S>& limits = {}) {
  const RangeFault fault = range_fault(camera, pixel, limits);
  if (fault != RangeFault::none) {
    const StatusCode code = fault == RangeFault::not_finite ? StatusCode::non_finite : StatusCode::rejected;
    return failure(code, name_of(fault), -1, static_cast<std::int32_t>(fault), static_cast<double>(pixel[0] - pixel[1]));
  }
  StereoPoint<S> point;
  Eigen::Matrix<S, 3, 3> J;
  point.p_c_m = point_at(camera, pixel, &J);
  const Eigen::Matrix<S, 3, 3> JC = J * covariance_px2;
  point.covariance_c_m2 = JC * J.transpose();
  if (!point.covariance_c_m2.allFinite()) return failure(StatusCode::non_finite, "covariance of a stereo observation is not finite");
  return point;
}

}  // namespace searvins::vision
