// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Does the camera stand still? Told from the motion that PnP finds between frames: a cue for zero-velocity updates and anchors, to be
/// confirmed by the inertial unit. [paper sec. Semantic-Aware Stereo Vision Frontend]
///
/// A frame is still when the motion and the median displacement of the points are small, small being what was asked for or, where the
/// points are noisy, what noise alone shows: with rms_px the noise of one pixel coordinate, a point that does not move is displaced by
/// the difference of two observations, of length sqrt(2) rms_px times a Rayleigh number with median sqrt(2 ln 2), so by 1.67 rms_px in
/// the median (2.5 leaves room for few points).
///
///     translation < max(max_way, 2 sigma_way)      turn < max(max_turn_rad, 2 sigma_turn)      median < max(max_median_px, 2.5 rms_px)
///     max_way = min(max_way_m, max_speed_mps dt)
///
/// dt is the time between the frames: 2 cm are 0.2 m/s at ten frames a second, but a walk at thirty.
///
/// Sigmas are those of PnP. Where they are large, PnP knows nothing and the frame is not still. `frames` still ones in a row raise the
/// cue, the first other one ends it, and so does a frame without a motion.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cmath>

#include <searvins/math/deferred.hpp>
#include <searvins/vision/camera_motion.hpp>

namespace searvins::vision {

/// See the file comment.
struct StopCueOptions {
  double max_way_m{0.02};          ///< between frames
  double max_speed_mps{0.2};
  double max_turn_rad{8.7266e-4};  ///< 0.05 degrees
  double max_median_px{0.5};
  double useful_way_m{0.05};       ///< a sigma of translation above this says nothing
  double useful_turn_rad{2.6e-3};  ///< a sigma of rotation above this (0.15 degrees) says nothing
  int frames{5};                   ///< still ones in a row, >= 1
};

/// See the file comment.
class StopCue {
 public:
  explicit StopCue(const StopCueOptions& options = {}) : options_(options) {}

  /// Takes the motion of a frame, its covariance (tangent order of CameraMotion), the median displacement of its points in the left image
  /// and their noise; `step_s`: time since the frame before. Returns whether the cue is up.
  template <class Scalar = double>
  bool add(const BasicCameraMotion<Scalar>& motion, const math::Matrix<Scalar, 6, 6>& covariance, double median_px, double rms_px,
           double step_s) {
    const Scalar sigma_turn = std::sqrt(covariance.template topLeftCorner<3, 3>().trace()),
                 sigma_way = std::sqrt(covariance.template bottomRightCorner<3, 3>().trace());
    const bool known = sigma_turn < options_.useful_turn_rad && sigma_way < options_.useful_way_m;
    const double max_way_m = std::min(options_.max_way_m, options_.max_speed_mps * step_s);
    const bool still = known && motion.t_prev_cur_m.norm() < std::max(max_way_m, 2 * sigma_way) &&
                       motion.angle_rad() < std::max(options_.max_turn_rad, 2 * sigma_turn) &&
                       median_px < std::max(options_.max_median_px, 2.5 * rms_px);
    still_frames_ = still ? std::min(still_frames_ + 1, options_.frames) : 0;
    return up();
  }

  /// A frame without a motion.
  void reset() { still_frames_ = 0; }

  [[nodiscard]] bool up() const { return still_frames_ >= options_.frames; }

 private:
  StopCueOptions options_;
  int still_frames_{0};
};

}  // namespace searvins::vision
