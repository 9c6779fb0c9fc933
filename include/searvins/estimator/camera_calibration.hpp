// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// How far a camera's calibration is believed: a policy of StereoInertialMotion.
///
///     KnownCamera        as it was calibrated (the default): nothing is estimated, nothing is paid
///     CalibratedCamera   the offset of its clock and a small turn of its axes are estimated beside the states (vision/camera_correction.hpp)
///
/// A policy makes the factors of a frame, and says where the camera is by what is known: admission compares motions there, and landmarks begin there.
///
/// The correction. A variable begins with the first frame, or when the last is older than renew_s: then the two are tied by the walk. It leaves with the
/// last state that saw by it. What was known is remembered with every solution, so that a window that was given up, or long without frames,
/// does not take it along: the next begins from there, with three times the sigmas (the prior's at the most), because a window that fails says nothing good of its
/// calibration, and with the walk of the time between.
#pragma once

#include <Eigen/Core>

#include <algorithm>

#include <searvins/core/status.hpp>
#include <searvins/core/time.hpp>
#include <searvins/imu/navigation_state.hpp>
#include <searvins/math/deferred.hpp>
#include <searvins/smoother/factor.hpp>
#include <searvins/smoother/variable.hpp>
#include <searvins/vision/calibrating_stereo_factor.hpp>
#include <searvins/vision/camera_correction.hpp>
#include <searvins/vision/landmark.hpp>
#include <searvins/vision/stereo_camera.hpp>
#include <searvins/vision/stereo_factor.hpp>

namespace searvins::estimator {

/// See the file comment. Scalar: double, as that of the states.
template <class Scalar>
class BasicKnownCamera {
  using Matrix3 = Eigen::Matrix<Scalar, 3, 3>;

 public:
  static constexpr bool calibrates = false;
  using Camera = vision::StereoCamera<Scalar>;
  using Factor = math::Deferred<vision::StereoFactor<>, Scalar>;
  template <class Cap>
  using Variables = smoother::Types<>;
  template <class Cap>
  using Factors = smoother::Types<smoother::Capacity<Factor, Cap::stereo_observations>>;

  explicit BasicKnownCamera(const vision::CameraCorrectionOptions& = {}) {}

  /// A frame of this time is about to become factors.
  template <class Smoother>
  void begin_frame(Smoother&, GpsTime) {}
  /// The camera at a frame, in the body at the state.
  [[nodiscard]] Camera placed(const Camera& nominal, const Matrix3& R_wb, const vision::FrameMotion& motion) const {
    return motion.late_s == 0 ? nominal : vision::carried(nominal, motion.late_s, R_wb.transpose() * motion.v_w_mps, motion.rate_b_radps);
  }
  /// An observation of a frame; `there`: placed(nominal). Errors: those of StereoFactor::make.
  [[nodiscard]] Result<Factor> observation(smoother::Key<imu::NavigationState> state, smoother::Key<vision::Landmark> landmark,
                                           const Camera&, const Camera& there, const vision::FrameMotion&, const vision::StereoPixel<Scalar>& pixel,
                                           const Matrix3& covariance_px2, vision::Eyes eyes = vision::Eyes::both) const {
    return Factor::make(state, landmark, there, pixel, covariance_px2, 1, {}, eyes);
  }
  /// The window was optimised.
  template <class Smoother>
  void remember(Smoother&) {}
};
using KnownCamera = BasicKnownCamera<double>;  ///< in double precision

/// See the file comment. Scalar: double, as that of the states.
template <class Scalar>
class BasicCalibratedCamera {
  using Matrix3 = Eigen::Matrix<Scalar, 3, 3>;
  using Matrix4 = Eigen::Matrix<Scalar, 4, 4>;
  using Estimate = math::Deferred<vision::CameraCorrectionEstimate, Scalar>;
  using PlainFactor = math::Deferred<vision::StereoFactor<>, Scalar>;  ///< by the camera as it was calibrated
  static constexpr int kCorrections = 8;  ///< in the window
  static constexpr double kDoubt = 3;     ///< sigmas of what a lost window said

 public:
  static constexpr bool calibrates = true;
  using Camera = vision::StereoCamera<Scalar>;
  using Factor = math::Deferred<vision::CalibratingStereoFactor<>, Scalar>;
  template <class Cap>
  using Variables = smoother::Types<smoother::Capacity<vision::CameraCorrection, kCorrections>>;
  template <class Cap>
  using Factors = smoother::Types<smoother::Capacity<Factor, Cap::stereo_observations>, smoother::Capacity<vision::CameraCorrectionPriorFactor, kCorrections>,
                                  smoother::Capacity<vision::CameraCorrectionWalk, kCorrections>>;

  explicit BasicCalibratedCamera(const vision::CameraCorrectionOptions& options = {}) : options_(options) {
    estimate_.covariance = vision::prior_covariance(options);
  }

  /// What is known: the last solution's, or the prior.
  [[nodiscard]] const Estimate& estimate() const { return estimate_; }

  template <class Smoother>
  void begin_frame(Smoother& smoother, GpsTime time) {
    const bool lives = key_.valid() && smoother.find(key_);
    if (lives && seconds_between(begun_, time) < options_.renew_s) return;
    const auto next = smoother.add_variable(lives ? *smoother.find(key_) : estimate_.value, time);
    if (!next.ok()) return;  // the old one goes on standing
    const bool held = lives ? tie(smoother, *next, seconds_between(begun_, time)) : hold(smoother, *next, time);
    if (!held) return void(smoother.remove_variable(*next));
    key_ = *next, begun_ = time;
  }
  [[nodiscard]] Camera placed(const Camera& nominal, const Matrix3& R_wb, const vision::FrameMotion& motion) const {
    Camera camera = vision::carried(nominal, motion.late_s + estimate_.value.time_offset_s, R_wb.transpose() * motion.v_w_mps, motion.rate_b_radps);
    camera.R_bc = camera.R_bc * estimate_.value.R_nc;
    return camera;
  }
  [[nodiscard]] Result<Factor> observation(smoother::Key<imu::NavigationState> state, smoother::Key<vision::Landmark> landmark,
                                           const Camera& nominal, const Camera&, const vision::FrameMotion& motion, const vision::StereoPixel<Scalar>& pixel,
                                           const Matrix3& covariance_px2, vision::Eyes eyes = vision::Eyes::both) const {
    const auto seen = PlainFactor::make(state, landmark, nominal, pixel, covariance_px2, 1, {}, eyes);
    return seen.ok() ? Factor::make(*seen, key_, motion) : seen.status();
  }
  template <class Smoother>
  void remember(Smoother& smoother) {
    const vision::CameraCorrection* const now = key_.valid() ? smoother.find(key_) : nullptr;
    if (!now) return;
    estimate_.value = *now;
    if (const auto covariance = smoother.covariance(key_); covariance.ok()) estimate_.covariance = *covariance;
    remembered_ = begun_, was_used_ = true;
  }

 private:
  template <class Smoother>
  [[nodiscard]] bool tie(Smoother& smoother, smoother::Key<vision::CameraCorrection> next, double duration_s) const {
    const auto walk = vision::CameraCorrectionWalk::make(key_, next, options_, duration_s);
    return walk.ok() && smoother.add_factor(*walk).ok();
  }
  template <class Smoother>
  [[nodiscard]] bool hold(Smoother& smoother, smoother::Key<vision::CameraCorrection> next, GpsTime time) const {
    const Matrix4 first = vision::prior_covariance(options_);
    Matrix4 P = estimate_.covariance;
    if (was_used_) P = kDoubt * kDoubt * P + vision::walk_covariance(options_, std::max(0.0, seconds_between(remembered_, time)));
    if ((P.diagonal() - first.diagonal()).maxCoeff() > 0) P = first;
    const auto prior = vision::CameraCorrectionPriorFactor::make(next, estimate_.value, P);
    return prior.ok() && smoother.add_factor(*prior).ok();
  }

  vision::CameraCorrectionOptions options_;
  Estimate estimate_{};
  smoother::Key<vision::CameraCorrection> key_{};
  GpsTime begun_{}, remembered_{};
  bool was_used_{false};
};
using CalibratedCamera = BasicCalibratedCamera<double>;  ///< in double precision

}  // namespace searvins::estimator
