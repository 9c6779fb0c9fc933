// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Is the motion that the picture shows the one that the inertial unit predicts? What a frame may do in the estimator depends on it.
/// [paper sec. Semantic-Aware Stereo Vision Frontend]
///
/// A majority of points that moves together is what PnP finds, and in traffic it may be a lorry. The unit knows better over a tenth of a
/// second:
///
///     turn  |Log(R_predicted' R_seen)|        way  |t_seen - t_predicted|
///     full         turn <= max_turn and way <= max(max_way, share |t_predicted|), either plus `noise_sigmas` sigmas of the two motions
///     reuse only   within reuse_factor times that: landmarks that exist are observed, none begins
///     reject       otherwise, and when PnP finds no motion
///
/// The support of PnP also says how good the frame is: few points, or points that agree badly, scale the sigma of all its observations by
///
///     clamp( max( rms_px / sigma_px, sqrt(60 / inliers) ), 1, 4 )
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <searvins/math/deferred.hpp>
#include <searvins/vision/camera_motion.hpp>
#include <searvins/vision/pnp.hpp>

namespace searvins::vision {

/// What a frame may do.
enum class FrameDecision : std::uint8_t {
  full,        ///< begin landmarks and observe them
  reuse_only,  ///< observe landmarks that exist
  reject,      ///< nothing
};

/// Name of a decision, for tables.
[[nodiscard]] constexpr const char* name_of(FrameDecision decision) {
  switch (decision) {
    case FrameDecision::full: return "full";
    case FrameDecision::reuse_only: return "reuse only";
    case FrameDecision::reject: return "reject";
  }
  return "?";
}

/// See the file comment.
struct ConsistencyOptions {
  double max_turn_rad{0.0174533};  ///< one degree
  double max_way_m{0.15};
  double max_way_share{0.10};  ///< of the predicted way
  double noise_sigmas{0};      ///< sigmas of the difference that are allowed on top
  double reuse_factor{2};      ///< >= 1
};

/// What the inertial unit says of the camera's motion since the last frame, and how well it knows (tangent order of CameraMotion).
template <class Scalar>
struct BasicPredictedMotion {
  BasicCameraMotion<Scalar> motion{};
  Eigen::Matrix<Scalar, 6, 6, Eigen::DontAlign> covariance{Eigen::Matrix<Scalar, 6, 6>::Zero()};
};

using PredictedMotion = BasicPredictedMotion<double>;  ///< in double precision

/// How far two motions are apart, and how far they may be for `full`.
struct MotionDifference {
  double turn_rad{0}, way_m{0};
  double turn_bound_rad{0}, way_bound_m{0};
};

/// `covariance`: of the seen motion. A prediction that is not finite is infinitely far away.
template <class Scalar = double>
[[nodiscard]] inline MotionDifference difference(const BasicCameraMotion<Scalar>& seen, const math::Matrix<Scalar, 6, 6>& covariance,
                                                 const BasicPredictedMotion<Scalar>& predicted, const ConsistencyOptions& options = {}) {
  const Eigen::Matrix<Scalar, 6, 1> delta = seen.minus(predicted.motion);
  const Eigen::Matrix<Scalar, 6, 6> both = covariance + predicted.covariance;
  MotionDifference d;
  d.turn_rad = delta.template head<3>().norm(), d.way_m = delta.template tail<3>().norm();
  d.turn_bound_rad = options.max_turn_rad + options.noise_sigmas * std::sqrt(both.template topLeftCorner<3, 3>().trace());
  d.way_bound_m = std::max(options.max_way_m, options.max_way_share * predicted.motion.t_prev_cur_m.norm()) +
                  options.noise_sigmas * std::sqrt(both.template bottomRightCorner<3, 3>().trace());
  return d;
}

/// See the file comment. A NaN rejects.
[[nodiscard]] inline FrameDecision decide(const MotionDifference& d, const ConsistencyOptions& options = {}) {
  const auto within = [&](double factor) { return d.turn_rad <= factor * d.turn_bound_rad && d.way_m <= factor * d.way_bound_m; };
  if (within(1)) return FrameDecision::full;
  return within(options.reuse_factor) ? FrameDecision::reuse_only : FrameDecision::reject;
}

/// See the file comment; at least 1, at most 4.
[[nodiscard]] inline double sigma_scale(const PnpStatistics& support, double sigma_px) {
  constexpr double kPlenty = 60, kMost = 4;
  if (support.inliers == 0) return kMost;
  return std::clamp(std::max(support.rms_px / sigma_px, std::sqrt(kPlenty / static_cast<double>(support.inliers))), 1.0, kMost);
}

}  // namespace searvins::vision
