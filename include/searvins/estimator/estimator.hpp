// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// RTK, inertial unit and stereo camera from the first epoch on: the estimator that most users touch.
///
/// Readings, base and rover epochs, and frames come in any order within the declared latency; next() answers one solution after the other, in time order:
///
///     before alignment   GNSS alone (RtkEstimator<FreeMotion>); its velocities and positions align the unit (imu/initializer.hpp)
///     aligned            navigation states, tightly coupled (RtkEstimator<InertialMotion>)
///     positions          instead of rover epochs: loosely coupled to another program's positions
///     frames             with a motion that has a camera, from alignment on: a state each (stereo_inertial_motion.hpp)
///     no rover epoch     states from the inertial unit alone, every silence_s, labelled dr
///     readings missing   GNSS alone again, until readings are back and aligned
///
/// An epoch or frame is answered when readings reach past it and the rhythms of the other streams put nothing of its time or before it that has not come,
/// or when the newest input is later than it by the latency: nothing waits for ever. A window that
/// had to be given up several times in a row is taken for a wrong alignment, which is then made anew.
///
/// The object is about a hundred megabytes with HostedCapacity and never allocates: create it once, static or on the heap, never as a local.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cstddef>
#include <optional>
#include <utility>

#include <searvins/core/ring_buffer.hpp>
#include <searvins/core/status.hpp>
#include <searvins/core/time.hpp>
#include <searvins/estimator/inertial_motion.hpp>
#include <searvins/estimator/rtk_estimator.hpp>
#include <searvins/estimator/rtk_options.hpp>
#include <searvins/estimator/rtk_solution.hpp>
#include <searvins/geodesy/local_frame.hpp>
#include <searvins/imu/imu_sample.hpp>
#include <searvins/imu/initializer.hpp>
#include <searvins/imu/position_fix.hpp>
#include <searvins/imu/preintegration.hpp>
#include <searvins/math/deferred.hpp>
#include <searvins/stationary/detector.hpp>

namespace searvins::estimator {

/// Settings. The unit's noise and the lever arm are those of `inertial`, also for the initialisation.
template <class MotionOptions>
struct BasicEstimatorOptions {
  RtkOptions rtk{};
  MotionOptions inertial{};
  imu::InitializerSettings initializer{};
  double latency_s{0.2};       ///< how much later than the rest a stream may come
  double silence_s{1};         ///< a state from the inertial unit alone after this time without a rover epoch
  int restarts_to_realign{3};  ///< windows given up within realign_within_s, after which the alignment is made anew
  double realign_within_s{30};
};

/// Settings of an estimator without a camera.
using EstimatorOptions = BasicEstimatorOptions<InertialOptions>;

/// When the next of a stream that comes at even intervals is due.
class Rhythm {
 public:
  void note(GpsTime t) {
    const double step_s = has_any_ ? seconds_between(newest_, t) : 0;
    if (!(interval_s_ > 0) || step_s < 1.5 * interval_s_) interval_s_ = step_s;  // a gap is no rhythm
    newest_ = t, has_any_ = true;
  }
  /// Whether one of about time `t` (`margin_s`) or before it is still to come.
  [[nodiscard]] bool may_come(GpsTime t, double margin_s) const {
    if (has_any_ && newest_ >= t.plus_seconds(-margin_s)) return false;
    return !(interval_s_ > 0) || seconds_between(newest_, t) > interval_s_ - margin_s;  // its rhythm may not be known yet
  }
  /// The same, but a stream that has been silent for longer than its rhythm is not waited for.
  [[nodiscard]] bool is_to_come(GpsTime t, double margin_s) const {
    return may_come(t, margin_s) && (!(interval_s_ > 0) || seconds_between(newest_, t) < 2 * interval_s_);
  }
  [[nodiscard]] bool has_any() const { return has_any_; }

 private:
  GpsTime newest_{};
  double interval_s_{0};
  bool has_any_{false};
};

/// The capacity of the part without a camera: WithoutCamera of a capacity that has landmarks, else the capacity itself.
template <class C>
struct WithoutCamera {
  using type = C;
};
/// A capacity that names its part without a camera.
template <class C>
  requires requires { typename C::WithoutCamera; }
struct WithoutCamera<C> {
  using type = typename C::WithoutCamera;
};

/// See the file comment. Form: robust::Batch, ScalarRows, LatentPivot or LatentPivotSymmetric. Motion: InertialMotion<>, or StereoInertialMotion<> with a
/// capacity that has landmarks.
template <template <class> class Form, class CapacityType = HostedCapacity, class MotionType = InertialMotion<>>
class Estimator {
 public:
  using Motion = MotionType;
  using Earth = typename Motion::EarthType;
  using Free = RtkEstimator<RtkConfig<Form, typename WithoutCamera<CapacityType>::type>>;
  using Bound = RtkEstimator<RtkConfig<Form, CapacityType, Motion>>;
  using Options = BasicEstimatorOptions<typename Motion::Options>;
  using Vector3 = typename Bound::Vector3;
  using Matrix3 = typename Bound::Matrix3;
  using LocalFrame = typename Bound::LocalFrame;

  using CodePhaseForm = typename Bound::CodePhaseForm;
  using DopplerForm = typename Bound::DopplerForm;

  /// Settings of the robust policies are those of the forms themselves (their `loss`).
  explicit Estimator(const Options& options = {}, const CodePhaseForm& code_phase = {}, const DopplerForm& doppler = {});

  /// Broadcast records. Errors: capacity_exceeded.
  Status add_ephemeris(const gnss::Ephemeris& e);
  void set_ionosphere(const gnss::KlobucharCoefficients& k) { free_.set_ionosphere(k), bound_.set_ionosphere(k); }
  /// Base antenna, ECEF metres. Errors: non_finite, invalid_argument.
  Status set_base_position(const Eigen::Vector3d& position_e_m);
  /// A heading from elsewhere, clockwise from north, of the present moment. Errors: those of imu::Initializer::set_heading.
  Status set_heading(double heading_rad, double sigma_rad);

  /// A map of lanes for stretches without integers (options: inertial.lanes, inertial.lane_way_m), in the caller's memory for as long as it is used.
  /// A state that is not on a lane yet costs one pass over all of it.
  void set_centrelines(imu::Centrelines lines) { bound_.motion().set_centrelines(lines); }

  /// A reading, in time order. Errors: non_finite, duplicate, out_of_order, capacity_exceeded (ask next() for solutions more often).
  Status add_imu(const imu::ImuSample& sample);
  /// A base epoch, in time order. Errors: duplicate, out_of_order.
  Status add_base(const gnss::ObservationEpoch& epoch);
  /// A rover epoch, in time order. Errors: duplicate, out_of_order (also: later than the latency), capacity_exceeded.
  Status add_rover(const gnss::ObservationEpoch& epoch);
  /// A position of the antenna from another program or receiver (loose coupling), in time order. Errors: duplicate, out_of_order, capacity_exceeded.
  Status add_position(const imu::PositionFix& fix);
  /// A frame, in time order. Those from before the alignment are let go. Errors: duplicate, out_of_order (also: later than the latency),
  /// capacity_exceeded.
  template <class Frame>
  Status add_stereo(const Frame& frame) {
    static_assert(Motion::has_camera, "Estimator needs a motion with a camera: StereoInertialMotion<>");
    if (has_frame_time_ && frame.time <= newest_frame_)
      return failure(frame.time == newest_frame_ ? StatusCode::duplicate : StatusCode::out_of_order, "stereo frame not after the last one");
    if (is_answered(frame.time.plus_seconds(kClockMarginS))) return failure(StatusCode::out_of_order, "stereo frame later than the declared latency");
    if (!frames_.push(frame)) return failure(StatusCode::capacity_exceeded, "stereo frames wait for next(): take solutions more often");
    has_frame_time_ = true, newest_frame_ = frame.time;
    frame_rhythm_.note(frame.time);
    see(frame.time);
    return ok_status();
  }
  /// No more input will come: what waits is due.
  void finish() { finished_ = true; }

  /// The next solution that is due. Errors: no_data when none is (is_nothing_due()); else what is wrong with the epoch that was next (it is gone then).
  Result<RtkSolution> next();

  /// The antenna at a time after the newest state, from readings alone: output at the unit's rate. Errors: no_data (not aligned, not covered).
  [[nodiscard]] Result<RtkSolution> predict(GpsTime time) const;

  [[nodiscard]] bool is_aligned() const { return aligned_; }
  /// What the alignment is at, and in words what it waits for.
  [[nodiscard]] imu::AlignmentState alignment_state() const { return aligned_ ? imu::AlignmentState::aligned : initializer_.state(); }
  [[nodiscard]] imu::HeadingSource heading_source() const { return initializer_.heading_source(); }
  [[nodiscard]] const char* waiting_text() const { return aligned_ ? imu::text_of(imu::AlignmentWait::nothing) : initializer_.waiting_text(); }
  [[nodiscard]] int alignments() const { return alignments_; }
  /// Frames that next() could not use, and why the last of them: later than a newer state, or a calibration that is none.
  [[nodiscard]] long refused_frames() const { return refused_frames_; }
  [[nodiscard]] const Status& frame_status() const { return frame_status_; }
  /// The estimator that gave the last solution, for reports.
  [[nodiscard]] const gnss::DifferencedEpoch& differenced() const { return aligned_ ? bound_.differenced() : free_.differenced(); }
  [[nodiscard]] const gnss::SinglePointSolution& single_point() const { return aligned_ ? bound_.single_point() : free_.single_point(); }
  [[nodiscard]] const Bound& inertial() const { return bound_; }
  [[nodiscard]] const Free& gnss_only() const { return free_; }

 private:
  using Initializer = math::Deferred<imu::Initializer, Motion>;
  using Detector = math::Deferred<stationary::Detector, Motion>;

  struct NoFrame {};
  struct NoFrames {
    [[nodiscard]] static bool empty() { return true; }
  };
  template <class M>
  struct FrameTypes {
    using Frame = NoFrame;
    using Queue = NoFrames;
  };
  template <class M>
    requires M::has_camera
  struct FrameTypes<M> {
    using Frame = typename M::Frame;
    using Queue = RingBuffer<Frame, 16>;
  };

  static constexpr double kNoVelocityMps = 1e3;  ///< sigma of a velocity that there is none of
  static constexpr double kClockMarginS = 0.03;  ///< a state's time lies this much around its epoch's tag

  /// With an inertial unit two satellites are worth differencing, what codes have said is remembered over a longer way, and the float is good enough to ask
  /// more of small subsets of integers.
  [[nodiscard]] static RtkOptions inertial_rtk(RtkOptions options) {
    options.min_satellites = std::min(options.min_satellites, 2);
    options.code_correlation_m *= 3;
    options.resolution.min_ratio_partial = std::max(options.resolution.min_ratio_partial, 7.0);
    if (!(options.resolution.ratio_subset_size > 0)) options.resolution.ratio_subset_size = 10;
    return options;
  }
  [[nodiscard]] static imu::InitializerSettings initializer_settings(const Options& options) {
    imu::InitializerSettings s = options.initializer;
    s.noise = options.inertial.preintegration.noise;
    s.lever_arm_b_m = options.inertial.lever_arm_b_m;
    return s;
  }

  void see(GpsTime t) {
    if (!has_input_ || t > newest_input_) newest_input_ = t;
    has_input_ = true;
  }
  /// Readings reach past the epoch and the base is there, or nobody may wait any longer.
  [[nodiscard]] bool is_due(GpsTime tag, bool needs_base) const {
    if (finished_ || seconds_between(tag, newest_input_) > options_.latency_s) return true;
    if (needs_base && base_rhythm_.is_to_come(tag, kClockMarginS)) return false;
    if (frame_rhythm_.has_any() && frame_rhythm_.is_to_come(tag, kClockMarginS)) return false;
    return has_imu_ && newest_imu_ >= tag.plus_seconds(kClockMarginS);
  }
  /// The same for a frame, which waits for what the rover may still say of its time: also for a rover that has been silent, whose first epoch would come
  /// too late else.
  [[nodiscard]] bool is_frame_due(GpsTime time) const {
    if (finished_ || seconds_between(time, newest_input_) > options_.latency_s) return true;
    return has_imu_ && newest_imu_ >= time && !rover_rhythm_.may_come(time, kClockMarginS);
  }
  /// Whether a frame comes before everything else that waits. An epoch of about its time makes the state that both share.
  [[nodiscard]] bool is_frame_next() const {
    if constexpr (Motion::has_camera) {
      if (frames_.empty()) return false;
      const GpsTime shared = frames_.front().time.plus_seconds(options_.rtk.shared_state_s);
      return (epochs_.empty() || epochs_.front().tag > shared) && (positions_.empty() || positions_.front().time > shared);
    } else {
      return false;
    }
  }
  /// Readings reach further than a rover epoch may still be missing for.
  [[nodiscard]] bool is_silent() const {
    if (!aligned_ || !epochs_.empty() || !positions_.empty() || !frames_.empty()) return false;
    const GpsTime next = bound_.state_time().plus_seconds(options_.silence_s);
    return has_imu_ && newest_imu_ >= next.plus_seconds(finished_ ? 0.0 : options_.latency_s);
  }

  Result<RtkSolution> answer(Result<RtkSolution> solution) {
    if (aligned_) look_ahead();
    if (!solution.ok()) return solution;
    has_answered_ = true, answered_ = solution->tag;
    const bool by_epoch = solution->source == SolutionSource::rover && solution->status != SolutionStatus::dr;
    answered_margin_s_ = by_epoch ? 0 : solution->source == SolutionSource::camera ? options_.rtk.shared_state_s : kClockMarginS;
    return solution;
  }
  /// Whether the time of a rover epoch has been answered for. A state from readings or a frame knows its receiver tag to the clock's drift only.
  [[nodiscard]] bool is_answered(GpsTime tag) const { return has_answered_ && tag <= answered_.plus_seconds(answered_margin_s_); }

  /// Integrates ahead of the newest state, for predict().
  void look_ahead() {
    const auto bias = imu::bias_of(bound_.state());
    if (ahead_.restart(bound_.state_time(), bias).ok()) return;
    (void)ahead_.start(bound_.state_time(), bias, options_.inertial.preintegration);
    (void)ahead_.push(last_sample_);
    for (std::size_t k = 0; k < samples_.size(); ++k) (void)ahead_.push(samples_[k]);
  }

  [[nodiscard]] Result<RtkSolution> solve(const gnss::ObservationEpoch& epoch) {
    if (aligned_) {
      feed_motion(epoch.tag.plus_seconds(kClockMarginS));
      if (aligned_ && bound_.motion().covers(epoch.tag.plus_seconds(-kClockMarginS))) {
        const Result<RtkSolution> solution = bound_.update(epoch);
        if (solution.ok()) watch(*solution);
        return solution;
      }
      lose_alignment();
    }
    feed_initializer(epoch.tag);
    const Result<RtkSolution> solution = free_.update(epoch);
    if (solution.ok() && has_imu_) align(*solution);
    return solution;
  }

  /// The same for a position from elsewhere. Before alignment it is the solution.
  [[nodiscard]] Result<RtkSolution> solve(const imu::PositionFix& fix) {
    if (aligned_) {
      feed_motion(fix.time);
      if (aligned_ && bound_.motion().covers(fix.time)) {
        const Result<RtkSolution> solution = bound_.advance_to(fix);
        if (solution.ok()) watch(*solution);
        return solution;
      }
      lose_alignment();
    }
    feed_initializer(fix.time);
    const RtkSolution solution = solution_of(fix);
    if (has_imu_) align(solution);
    return solution;
  }

  /// The same for a frame. Before alignment there is nothing for it to say.
  template <class Frame>
  [[nodiscard]] Result<RtkSolution> solve(const Frame& frame) {
    if (aligned_ && frame.time < bound_.state_time().plus_seconds(-options_.rtk.shared_state_s))
      return failure(StatusCode::out_of_order, "stereo frame before the newest state");
    if (aligned_) feed_motion(frame.time);
    if (!aligned_ || !bound_.motion().covers(frame.time)) return failure(StatusCode::no_data, "the unit is not aligned");
    const Result<RtkSolution> solution = bound_.see(frame);
    if (solution.ok()) watch(*solution);
    return solution;
  }

  [[nodiscard]] static RtkSolution solution_of(const imu::PositionFix& fix) {
    RtkSolution s;
    s.source = SolutionSource::position;
    s.tag = s.time = fix.time;
    s.status = Bound::status_of_quality(fix.quality);
    s.position_e_m = fix.position_e_m;
    s.satellites = std::max(0, fix.satellites);
    const Matrix3 R_en = geodesy::ecef_from_enu(geodesy::geodetic_from_ecef(fix.position_e_m)), R = R_en.transpose();
    s.covariance_enu_m2 = R * fix.covariance_e_m2 * R.transpose();
    const double sigma_v = fix.has_velocity() ? fix.sigma_velocity_mps : kNoVelocityMps;
    if (fix.has_velocity()) s.velocity_e_mps = fix.velocity_e_mps;
    s.velocity_covariance_enu = Matrix3::Identity() * sigma_v * sigma_v;
    return s;
  }

  /// A state from the readings alone.
  [[nodiscard]] Result<RtkSolution> bridge() {
    const GpsTime time = bound_.state_time().plus_seconds(options_.silence_s);
    feed_motion(time.plus_seconds(kClockMarginS));
    const Result<RtkSolution> solution = aligned_ ? bound_.advance(time) : Result<RtkSolution>{failure(StatusCode::no_data, "readings are missing")};
    if (!solution.ok()) lose_alignment();
    return solution;
  }

  /// Hands readings up to a time, and one beyond, to the motion. A gap ends the alignment.
  void feed_motion(GpsTime until) {
    while (!samples_.empty() && (samples_.front().time <= until || !bound_.motion().covers(until))) {
      const Status s = bound_.motion().add_sample(samples_.front());
      if (!s.ok() && s.code != StatusCode::duplicate && s.code != StatusCode::out_of_order) return lose_alignment();
      last_sample_ = samples_.front();
      samples_.pop();
    }
  }

  void feed_initializer(GpsTime until) {
    while (!samples_.empty() && samples_.front().time <= until) {
      last_sample_ = samples_.front();
      (void)detector_.add(last_sample_);
      (void)initializer_.add_imu(last_sample_, detector_.stationary());
      samples_.pop();
    }
  }

  /// Aligns with the GNSS solution of an epoch, and starts the inertial window when that is done.
  void align(const RtkSolution& s) {
    if (!has_frame_) frame_ = LocalFrame::at(s.position_e_m), has_frame_ = true;
    const Earth earth{frame_};
    const Matrix3 &position_covariance = s.covariance_enu_m2, &velocity_covariance = s.velocity_covariance_enu;
    const Vector3 p_w_m = frame_.to_local(s.position_e_m), v_w_mps = frame_.R_ew.transpose() * s.velocity_e_mps;
    (void)initializer_.set_local_gravity(earth.gravity_w_mps2(p_w_m), imu::RotatingEarth{frame_}.rate_w_radps());
    const double sigma_v = std::sqrt(std::max(1e-4, velocity_covariance.trace() / 3));
    if (s.status != SolutionStatus::dr && sigma_v < kNoVelocityMps) {
      (void)initializer_.add_velocity(s.time, v_w_mps, sigma_v);
      detector_.set_speed_hint(s.time, v_w_mps.norm(), sigma_v);
    }
    if (s.status == SolutionStatus::fix || s.status == SolutionStatus::float_)
      (void)initializer_.add_position(s.time, p_w_m, std::sqrt(std::max(1e-4, position_covariance.template topLeftCorner<2, 2>().trace() / 2)));
    if (initializer_.state() != imu::AlignmentState::aligned) return;
    const double late_s = seconds_between(last_sample_.time, s.time);  // the alignment is of the last reading
    const Matrix3 room = Matrix3::Identity() * 0.01;
    const auto alignment = initializer_.alignment(p_w_m - late_s * v_w_mps, 4 * position_covariance + room);
    if (!alignment.ok()) return;
    bound_.begin_at(alignment->state, alignment->covariance, alignment->time, frame_);
    (void)bound_.motion().add_sample(last_sample_);
    aligned_ = true, ++alignments_;
    restarts_ = 0;
  }

  /// Counts windows that were given up.
  void watch(const RtkSolution& s) {
    if (!s.restarted) return;
    restarts_ = restarts_ > 0 && seconds_between(last_restart_, s.time) < options_.realign_within_s ? restarts_ + 1 : 1;
    last_restart_ = s.time;
    if (restarts_ > options_.restarts_to_realign) lose_alignment();
  }

  void lose_alignment() {
    aligned_ = false;
    initializer_ = Initializer{initializer_settings(options_)};
    detector_ = Detector{options_.inertial.preintegration.noise, options_.inertial.detector};
  }

  Options options_;
  Free free_;
  Bound bound_;
  Initializer initializer_;
  Detector detector_;
  LocalFrame frame_{};
  imu::Preintegration<double, 4096> ahead_{};  ///< from the newest state to the newest reading
  RingBuffer<imu::ImuSample, 8192> samples_{};
  RingBuffer<gnss::ObservationEpoch, 16> epochs_{};
  RingBuffer<imu::PositionFix, 64> positions_{};
  gnss::ObservationEpoch epoch_{};
  imu::ImuSample last_sample_{};
  typename FrameTypes<Motion>::Queue frames_{};
  typename FrameTypes<Motion>::Frame stereo_frame_{};
  Rhythm base_rhythm_{}, rover_rhythm_{}, frame_rhythm_{};
  GpsTime newest_imu_{}, newest_rover_{}, newest_frame_{}, newest_input_{}, answered_{}, last_restart_{};
  double answered_margin_s_{0};
  long refused_frames_{0};
  Status frame_status_{};
  bool has_frame_time_{false}, has_imu_{false}, has_rover_{false}, has_input_{false}, has_answered_{false}, has_frame_{false}, aligned_{false}, finished_{false};
  int alignments_{0}, restarts_{0};
};

// ---- the interface: outside the class, so that a file that sees it declared `extern template` does not instantiate it and all below it -------------------

template <template <class> class Form, class CapacityType, class MotionType>
Estimator<Form, CapacityType, MotionType>::Estimator(const Options& options, const CodePhaseForm& code_phase, const DopplerForm& doppler)
    : options_(options), free_(options.rtk, code_phase, doppler), bound_(inertial_rtk(options.rtk), code_phase, doppler, options.inertial), initializer_(initializer_settings(options)),
      detector_(options.inertial.preintegration.noise, options.inertial.detector) {}

template <template <class> class Form, class CapacityType, class MotionType>
Status Estimator<Form, CapacityType, MotionType>::add_ephemeris(const gnss::Ephemeris& e) {
  (void)bound_.add_ephemeris(e);
  return free_.add_ephemeris(e);
}

template <template <class> class Form, class CapacityType, class MotionType>
Status Estimator<Form, CapacityType, MotionType>::set_base_position(const Eigen::Vector3d& position_e_m) {
  (void)bound_.set_base_position(position_e_m);
  return free_.set_base_position(position_e_m);
}

template <template <class> class Form, class CapacityType, class MotionType>
Status Estimator<Form, CapacityType, MotionType>::set_heading(double heading_rad, double sigma_rad) { return initializer_.set_heading(heading_rad, sigma_rad); }

template <template <class> class Form, class CapacityType, class MotionType>
Status Estimator<Form, CapacityType, MotionType>::add_imu(const imu::ImuSample& sample) {
  if (!sample.finite()) return failure(StatusCode::non_finite, "IMU sample with a NaN or infinite reading");
  if (has_imu_ && sample.time == newest_imu_) return failure(StatusCode::duplicate, "IMU sample with the time of the one before");
  if (has_imu_ && sample.time < newest_imu_) return failure(StatusCode::out_of_order, "IMU sample earlier than the one before");
  if (samples_.full() && !aligned_ && epochs_.empty() && positions_.empty()) samples_.pop();  // nothing to align with yet: the oldest say least
  if (!samples_.push(sample)) return failure(StatusCode::capacity_exceeded, "IMU samples wait for next(): take solutions more often");
  has_imu_ = true, newest_imu_ = sample.time;
  if (aligned_) (void)ahead_.push(sample);  // what it refuses is refused again, and acted on, where the state is made
  see(sample.time);
  return ok_status();
}

template <template <class> class Form, class CapacityType, class MotionType>
Status Estimator<Form, CapacityType, MotionType>::add_base(const gnss::ObservationEpoch& epoch) {
  (void)bound_.add_base(epoch);
  const Status s = free_.add_base(epoch);
  if (s.ok()) base_rhythm_.note(epoch.tag);
  return s;
}

template <template <class> class Form, class CapacityType, class MotionType>
Status Estimator<Form, CapacityType, MotionType>::add_rover(const gnss::ObservationEpoch& epoch) {
  if (has_rover_ && epoch.tag <= newest_rover_)
    return failure(epoch.tag == newest_rover_ ? StatusCode::duplicate : StatusCode::out_of_order, "rover epoch not after the last one");
  if (is_answered(epoch.tag)) return failure(StatusCode::out_of_order, "rover epoch later than the declared latency");
  if (!epochs_.push(epoch)) return failure(StatusCode::capacity_exceeded, "rover epochs wait for next(): take solutions more often");
  has_rover_ = true, newest_rover_ = epoch.tag;
  rover_rhythm_.note(epoch.tag);
  see(epoch.tag);
  return ok_status();
}

template <template <class> class Form, class CapacityType, class MotionType>
Status Estimator<Form, CapacityType, MotionType>::add_position(const imu::PositionFix& fix) {
  const Vector3& position_e_m = fix.position_e_m;
  const Matrix3& covariance_e_m2 = fix.covariance_e_m2;
  if (!position_e_m.allFinite() || !covariance_e_m2.allFinite()) return failure(StatusCode::non_finite, "position or its covariance is not finite");
  if (has_rover_ && fix.time <= newest_rover_) return failure(fix.time == newest_rover_ ? StatusCode::duplicate : StatusCode::out_of_order, "position not after the last one");
  if (is_answered(fix.time)) return failure(StatusCode::out_of_order, "position later than the declared latency");
  if (!positions_.push(fix)) return failure(StatusCode::capacity_exceeded, "positions wait for next(): take solutions more often");
  has_rover_ = true, newest_rover_ = fix.time;
  rover_rhythm_.note(fix.time);
  see(fix.time);
  return ok_status();
}

template <template <class> class Form, class CapacityType, class MotionType>
Result<RtkSolution> Estimator<Form, CapacityType, MotionType>::next() {
  if constexpr (Motion::has_camera)
    while (is_frame_next()) {
      if (!is_frame_due(frames_.front().time)) return failure(StatusCode::no_data, kNothingDue);
      stereo_frame_ = frames_.front();
      frames_.pop();
      Result<RtkSolution> seen = solve(stereo_frame_);
      if (seen.ok()) return answer(std::move(seen));
      if (seen.status().code != StatusCode::no_data) ++refused_frames_, frame_status_ = seen.status();
    }
  if (!epochs_.empty() && is_due(epochs_.front().tag, true)) {
    // Copied: the queue's place may be taken while the epoch is worked on.
    epoch_ = epochs_.front();
    epochs_.pop();
    return answer(solve(epoch_));
  }
  if (!positions_.empty() && is_due(positions_.front().time, false)) {
    const imu::PositionFix fix = positions_.front();
    positions_.pop();
    return answer(solve(fix));
  }
  if (is_silent()) return answer(bridge());
  return failure(StatusCode::no_data, kNothingDue);
}

template <template <class> class Form, class CapacityType, class MotionType>
Result<RtkSolution> Estimator<Form, CapacityType, MotionType>::predict(GpsTime time) const {
  if (!aligned_) return failure(StatusCode::no_data, "not aligned yet");
  const auto motion = ahead_.until(time);
  if (!motion.ok()) return motion.status();
  return bound_.predict_by(*motion);
}

}  // namespace searvins::estimator
