// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The motion of an estimator with an inertial unit and a stereo camera: the inertial one (inertial_motion.hpp), and landmarks that its states see.
///
/// A frame goes to a state of its time, or of up to shared_state_s beside it: then the camera is put where the body carries it in the time s between,
/// with the state's velocity and the reading's rate,
///
///     p_bc(s) = Exp(s w) p_bc + s R_wb' v        R_bc(s) = Exp(s w) R_bc
///
/// Whether the camera's clock and axes are taken as they were calibrated, or estimated beside the states, is a policy (camera_calibration.hpp).
///
/// Admission (vision/admission.hpp) compares the frame's motion with that of the window's states and says which observations become factors. A landmark
/// begins where its first observation puts it, with a weak prior, and ends with its arc. It is marginalised whole when the first state that sees it leaves
/// the window; before that it is looked at once more: squared whitened residuals beyond the chi-square quantile of its 3 n - 3 redundant rows say that it
/// was no fixed point, and then it is dropped with all its factors instead of being frozen into the prior.
///
/// At rest all frames show the same picture, whose errors would be counted every time: only one frame in thin_rest_s becomes factors. The stop cue of the
/// frames joins the rest detector of the unit.
#pragma once

#include <Eigen/Core>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

#include <searvins/core/static_vector.hpp>
#include <searvins/core/status.hpp>
#include <searvins/core/time.hpp>
#include <searvins/estimator/camera_calibration.hpp>
#include <searvins/estimator/inertial_motion.hpp>
#include <searvins/math/deferred.hpp>
#include <searvins/math/quantiles.hpp>
#include <searvins/vision/admission.hpp>
#include <searvins/vision/calibrating_stereo_factor.hpp>
#include <searvins/vision/camera_correction.hpp>
#include <searvins/vision/landmark.hpp>
#include <searvins/vision/stereo_factor.hpp>
#include <searvins/vision/triangulation.hpp>

namespace searvins::estimator {

/// Compile-time sizes of a desktop build with a camera: 10 Hz over 6 s beside the GNSS epochs.
struct StereoCapacity : HostedCapacity {
  using WithoutCamera = HostedCapacity;  ///< until the unit is aligned
  static constexpr int states = 80;
  static constexpr int landmarks = 1024;             ///< in the window
  static constexpr int stereo_observations = 10240;  ///< in the window
  static constexpr int max_front_dimension = 720;
  static constexpr int member_capacity = 32768;
  static constexpr std::size_t arena_scalars = 24'000'000;
};

/// Arcs of ten frames: longer ones tie more states together (25 cost about 1.8 times as much).
[[nodiscard]] inline vision::AdmissionOptions default_admission() {
  vision::AdmissionOptions o;
  o.tracks.max_arc = 10;
  return o;
}

/// Settings of the camera's part.
struct StereoOptions {
  vision::StereoCamera<double> camera{};  ///< width 0: there is no camera
  vision::AdmissionOptions admission{default_admission()};
  double landmark_prior_sigma_m{30};
  double thin_rest_s{1};             ///< at rest one frame in this time becomes factors
  double landmark_confidence{0.999};  ///< of the chi-square look at a landmark that leaves
  vision::CameraCorrectionOptions correction{};  ///< of CalibratedCamera
  vision::Eyes eyes{vision::Eyes::both};         ///< left: reprojection in one view; both still serve the screening, and where a landmark begins
};

/// Settings of the inertial part and of the camera's.
struct StereoInertialOptions : InertialOptions {
  StereoOptions stereo{};
};

/// What a frame came to.
struct FrameReport {
  vision::FrameFate fate{vision::FrameFate::empty};
  int offered{0}, admitted{0};  ///< observations
  int landmarks{0};             ///< alive after it
};

/// See the file comment. At most N observations a frame, L landmarks. CameraType: KnownCamera or CalibratedCamera.
template <class Earth = imu::RotatingEarth, std::size_t N = 256, std::size_t L = 1024, class CameraType = KnownCamera>
class StereoInertialMotion : public InertialMotion<Earth> {
 public:
  using Base = InertialMotion<Earth>;
  using State = typename Base::State;
  using Vector3 = typename Base::Vector3;
  using Matrix3 = typename Base::Matrix3;
  using Options = StereoInertialOptions;
  using Frame = vision::StereoFrame<N>;
  using Camera = CameraType;
  using StereoFactor = typename Camera::Factor;
  static constexpr bool has_camera = true;

  template <class Cap>
  using Variables = smoother::Joined<typename Base::template Variables<Cap>,
                                     smoother::Joined<smoother::Types<smoother::Capacity<vision::Landmark, Cap::landmarks>>, typename Camera::template Variables<Cap>>>;
  template <class Cap>
  using Factors = smoother::Joined<typename Base::template Factors<Cap>,
                                   smoother::Joined<typename Camera::template Factors<Cap>, smoother::Types<smoother::Capacity<vision::LandmarkPriorFactor, Cap::landmarks>>>>;

  explicit StereoInertialMotion(const RtkOptions& rtk, const Options& options = {})
      : Base(rtk, options), stereo_(options.stereo), admission_(options.stereo.camera, options.stereo.admission), camera_(options.stereo.correction) {}

  [[nodiscard]] const StereoOptions& stereo() const { return stereo_; }
  [[nodiscard]] const vision::AdmissionCounts& counts() const { return admission_.counts(); }
  /// The last frame as admission saw it, for reports.
  [[nodiscard]] const vision::AdmittedFrame<N>& admitted() const { return admitted_; }
  [[nodiscard]] const FrameReport& frame_report() const { return report_; }
  /// How far the calibration is believed, and what was found of it.
  [[nodiscard]] const Camera& camera() const { return camera_; }
  /// Landmarks that failed the look before marginalisation.
  [[nodiscard]] long dropped_landmarks() const { return dropped_; }

  /// Adds a frame to a state of about its time. Errors: those of admission (order, calibration); nothing was changed then.
  template <class Smoother>
  Status add_frame(Smoother& smoother, smoother::Key<State> key, GpsTime state_time, const Frame& frame, bool at_rest) {
    const State x = *smoother.find(key);
    const View view = view_of(x, seconds_between(state_time, frame.time), frame.time);
    const vision::StereoCamera<double>& camera = view.camera;
    const Pose& pose = view.pose;
    if (const Status s = admission_.add(frame, predicted_motion(smoother, pose), admitted_); !s.ok()) return s;
    report_ = {admitted_.fate, static_cast<int>(frame.observations.size()), 0, 0};
    this->set_rest_cue(admitted_.stands_still);
    if (admission_.reference_time() == std::optional<GpsTime>{frame.time}) reference_ = Reference{key, camera};
    forget_gone(smoother);
    const bool thinned = at_rest && has_used_ && seconds_between(last_used_, frame.time) < stereo_.thin_rest_s;
    if (!thinned && !admitted_.observations.empty()) {
      camera_.begin_frame(smoother, state_time);
      for (const vision::AdmittedObservation& o : admitted_.observations) report_.admitted += observe(smoother, key, state_time, view, o) ? 1 : 0;
    }
    if (report_.admitted > 0) has_used_ = true, last_used_ = frame.time;
    report_.landmarks = static_cast<int>(seen_.size());
    return ok_status();
  }

  /// The window was optimised.
  template <class Smoother>
  void remember(Smoother& smoother) {
    camera_.remember(smoother);
  }

  /// The oldest state is about to leave: landmarks that it sees first are looked at, and dropped when they were no fixed points.
  template <class Smoother>
  void before_marginalising(Smoother& smoother, smoother::Key<State> oldest) {
    for (std::size_t i = 0; i < seen_.size();) {
      Seen& s = seen_[i];
      if (!(s.first == oldest)) {
        ++i;
        continue;
      }
      if (!is_fixed_point(smoother, s)) {
        for (const auto& f : s.factors) (void)smoother.remove_factor(f);
        (void)smoother.remove_factor(s.prior);
        (void)smoother.remove_variable(s.key);
        ++dropped_;
      }
      admission_.end_landmark(s.track);
      seen_.erase(i);
    }
  }

 private:
  using PredictedMotion = math::Deferred<vision::PredictedMotion, Earth>;

  struct Pose {
    Matrix3 R_wc{Matrix3::Identity()};
    Vector3 p_wc_m{Vector3::Zero()};
  };
  /// The state that the admission's reference frame belongs to, and the camera's place in its body at that frame.
  struct Reference {
    smoother::Key<State> key{};
    vision::StereoCamera<double> camera{};
  };
  /// A landmark of the window.
  struct Seen {
    std::uint64_t number{0}, track{0};
    smoother::Key<vision::Landmark> key{};
    smoother::Key<vision::LandmarkPriorFactor> prior{};
    smoother::Key<State> first{};
    StaticVector<smoother::Key<StereoFactor>, 32> factors{};
  };
  /// A frame seen from its state, as that was predicted.
  struct View {
    vision::FrameMotion motion{};
    vision::StereoCamera<double> camera{};  ///< in the body at the state, by all that is known of it
    Pose pose{};
  };

  [[nodiscard]] View view_of(const State& x, double late_s, GpsTime t) const {
    View view;
    view.motion = {late_s, x.v_wb_mps, Vector3::Zero()};
    if (Camera::calibrates || late_s != 0) view.motion.rate_b_radps = this->antenna_at(t).gyro_b_radps - x.gyro_bias_b_radps;
    view.camera = camera_.placed(stereo_.camera, x.R_wb, view.motion);
    view.pose = {x.R_wb * view.camera.R_bc, x.p_wb_m + x.R_wb * view.camera.p_bc_m};
    return view;
  }

  /// The camera's motion since the reference frame by the states of the window; nothing when that state is gone.
  template <class Smoother>
  [[nodiscard]] std::optional<PredictedMotion> predicted_motion(const Smoother& smoother, const Pose& now) const {
    const State* before = reference_.key.valid() ? smoother.find(reference_.key) : nullptr;
    if (!before) return std::nullopt;
    const Matrix3 R_wc = before->R_wb * reference_.camera.R_bc;
    const Vector3 p_wc_m = before->p_wb_m + before->R_wb * reference_.camera.p_bc_m;
    PredictedMotion motion;
    motion.motion = {R_wc.transpose() * now.R_wc, R_wc.transpose() * (now.p_wc_m - p_wc_m)};
    return motion;
  }

  /// Landmarks that left the window by another way (it was given up) end their arcs.
  template <class Smoother>
  void forget_gone(const Smoother& smoother) {
    seen_.erase_if([&](const Seen& s) {
      if (smoother.find(s.key)) return false;
      admission_.end_landmark(s.track);
      return true;
    });
  }

  [[nodiscard]] Seen* find_seen(std::uint64_t number) {
    for (Seen& s : seen_)
      if (s.number == number) return &s;
    return nullptr;
  }

  /// The factor of an admitted observation, and its landmark where that begins.
  template <class Smoother>
  bool observe(Smoother& smoother, smoother::Key<State> key, GpsTime t, const View& view, const vision::AdmittedObservation& o) {
    Seen* s = find_seen(o.landmark);
    if (!s) {
      s = begin_landmark(smoother, key, t, view, o);
      if (!s) {
        admission_.end_landmark(o.track);
        return false;
      }
    }
    if (s->factors.full()) return false;
    const auto factor = camera_.observation(key, s->key, stereo_.camera, view.camera, view.motion, o.pixel_px, vision::pixel_covariance_px2(o.sigma_px),
                                            stereo_.eyes);
    if (!factor.ok()) return false;
    const auto added = smoother.add_factor(*factor);
    if (!added.ok()) return false;
    return s->factors.push_back(*added);
  }

  template <class Smoother>
  Seen* begin_landmark(Smoother& smoother, smoother::Key<State> key, GpsTime t, const View& view, const vision::AdmittedObservation& o) {
    if (seen_.full()) return nullptr;
    const Vector3 p_w_m = view.pose.p_wc_m + view.pose.R_wc * vision::point_at(view.camera, o.pixel_px);  // admission has looked at its range
    const auto landmark = smoother.add_variable(vision::Landmark{p_w_m}, t);
    if (!landmark.ok()) return nullptr;
    const auto prior = vision::LandmarkPriorFactor::make(*landmark, p_w_m, stereo_.landmark_prior_sigma_m);
    const auto held = prior.ok() ? smoother.add_factor(*prior) : Result<smoother::Key<vision::LandmarkPriorFactor>>{prior.status()};
    if (!held.ok()) {
      (void)smoother.remove_variable(*landmark);
      return nullptr;
    }
    Seen s;
    s.number = o.landmark, s.track = o.track, s.key = *landmark, s.prior = *held, s.first = key;
    (void)seen_.push_back(s);
    return &seen_.back();
  }

  template <class Smoother>
  [[nodiscard]] bool is_fixed_point(const Smoother& smoother, const Seen& s) const {
    const int redundant = (stereo_.eyes == vision::Eyes::both ? 3 : 2) * static_cast<int>(s.factors.size()) - 3;
    if (redundant <= 0) return true;
    double sum = 0;
    for (const auto& f : s.factors) {
      const double* e = smoother.whitened_rows(f);
      if (e) sum += e[0] * e[0] + e[1] * e[1] + e[2] * e[2];
    }
    const auto bound = math::chi_square_quantile(stereo_.landmark_confidence, redundant);
    return bound.ok() && sum <= *bound;
  }

  StereoOptions stereo_;
  vision::StereoAdmission<N> admission_;
  Camera camera_;
  vision::AdmittedFrame<N> admitted_{};
  FrameReport report_{};
  Reference reference_{};
  StaticVector<Seen, L> seen_{};
  GpsTime last_used_{};
  long dropped_{0};
  bool has_used_{false};
};

}  // namespace searvins::estimator
