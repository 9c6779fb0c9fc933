// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Which observations of a frame become factors. A frontend finds matches; here it is decided which of them the estimator may believe.
/// [paper sec. Semantic-Aware Stereo Vision Frontend, Fig. vision-frontend]
///
///     observation    finite, its track once in the frame
///     geometric      score, rows of both views, on the image, disparity, range                        (use_geometric)
///     semantic       class and its margin in both views, semantic_mask.hpp                            (use_semantic)
///     motion         pairs with the previous frame -> PnP; outliers break their tracks, pnp.hpp       (use_motion)
///                    the motion against the prediction: full, reuse only, reject, motion_consistency.hpp
///     maturity       n_min observations before a landmark, arcs of bounded length, track.hpp          (use_maturity)
///     number         at most max_admitted, spread over the picture, spread.hpp
///
/// Each of the four can be switched off, to see what it earns. Without `geometric` only positive disparity is asked for (nothing else can
/// be triangulated), without `motion` every frame is full and no association is checked, without `maturity` a track has a landmark at
/// once.
///
/// A refused observation breaks its track, and so does a frame without the track where associations are checked. A frame whose motion is
/// not found or not believed does not: it says nothing of the tracks one by one. They are counted on and compared with the next frame,
/// but nothing is admitted.
///
/// Everything that enters is counted under one fate (admission_report.hpp): the counts of a run add up to what was offered.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

#include <searvins/core/static_vector.hpp>
#include <searvins/core/status.hpp>
#include <searvins/core/time.hpp>
#include <searvins/vision/admission_report.hpp>
#include <searvins/vision/motion_consistency.hpp>
#include <searvins/vision/pnp.hpp>
#include <searvins/vision/semantic_mask.hpp>
#include <searvins/vision/spread.hpp>
#include <searvins/vision/stereo_camera.hpp>
#include <searvins/vision/stereo_observation.hpp>
#include <searvins/vision/stop_cue.hpp>
#include <searvins/vision/track.hpp>
#include <searvins/vision/triangulation.hpp>

namespace searvins::vision {

/// See the file comment. The noise of an observation is pnp.sigma_px.
struct AdmissionOptions {
  bool use_geometric{true}, use_semantic{true}, use_motion{true}, use_maturity{true};
  double min_score{0.3};
  double max_v_difference_px{2};  ///< asked only of frontends that say it
  RangeLimits<double> range{};    ///< holds for PnP too
  SemanticRules semantic{};
  PnpOptions pnp{};
  ConsistencyOptions consistency{};
  TrackOptions tracks{};
  StopCueOptions stop{};
  double max_gap_s{0.55};         ///< longer without a frame: the next one is a first frame
  std::size_t max_admitted{150};  ///< observations a frame, spread over the picture (spread.hpp)
};

/// An observation that becomes a factor.
struct AdmittedObservation {
  std::uint64_t track{0};
  std::uint64_t landmark{0};  ///< number of the landmark, never used again (track.hpp)
  bool begins{false};         ///< the first observation of that landmark
  StereoPixel<double> pixel_px{StereoPixel<double>::Zero()};
  double sigma_px{1};  ///< of each of u_left, u_right, v
};

/// What a frame gives.
template <std::size_t N>
struct AdmittedFrame {
  using Scalar = typename StereoPnp<N>::Scalar;

  GpsTime time{};
  FrameFate fate{FrameFate::empty};
  FrameDecision decision{FrameDecision::reject};
  StaticVector<AdmittedObservation, N> observations{};  ///< none when rejected
  StaticVector<ObservationFate, N> fates{};             ///< of the observations offered, in their order
  bool has_motion{false};                               ///< PnP found a motion since the previous frame
  BasicCameraMotion<Scalar> motion{};
  Eigen::Matrix<Scalar, 6, 6, Eigen::DontAlign> covariance{Eigen::Matrix<Scalar, 6, 6>::Zero()};  ///< in the tangent order of CameraMotion
  PnpStatistics pnp{};
  MotionDifference difference{};  ///< from the prediction, where there was one
  double sigma_scale{1};
  bool stands_still{false};  ///< the stop cue is up
};

/// See the file comment. At most N observations a frame and T tracks. The object is all the memory it uses; it belongs in static storage.
template <std::size_t N, std::size_t T = 2 * N>
class StereoAdmission {
 public:
  using Scalar = typename StereoPnp<N>::Scalar;
  using Camera = StereoCamera<Scalar>;
  using Frame = StereoFrame<N>;
  using Predicted = BasicPredictedMotion<Scalar>;
  using Admitted = AdmittedFrame<N>;

  explicit StereoAdmission(const Camera& camera, const AdmissionOptions& options = {})
      : camera_(camera), options_(effective(options)), pnp_(camera, options_.pnp), tracks_(options_.tracks), stop_(options_.stop) {}

  /// Takes the frame after the last one. `predicted`: motion of the camera from reference_time() to the frame's time, if the unit knows
  /// it. Masks are in pixels of the rectified views. A frame that is rejected is no error. Errors: out_of_order, duplicate (time; nothing
  /// but a count changes); invalid_argument (camera or PnP options).
  template <SemanticMask Left = NoMask, SemanticMask Right = NoMask>
  Status add(const Frame& frame, const std::optional<Predicted>& predicted, Admitted& out, const Left& left = {}, const Right& right = {}) {
    out = Admitted{};
    out.time = frame.time;
    if (const Status s = check(camera_); !s) return s;
    if (last_time_ && !(frame.time > *last_time_)) {
      counts_.count(out.fate = FrameFate::out_of_order);
      return frame.time == *last_time_ ? failure(StatusCode::duplicate, "stereo frame of the same time as the last")
                                       : failure(StatusCode::out_of_order, "stereo frame before the last");
    }
    last_time_ = frame.time;
    const Status status = process(frame, predicted, out, left, right);
    counts_.count(out.fate);
    for (const ObservationFate fate : out.fates) counts_.count(fate);
    counts_.count(ObservationFate::capacity, frame.dropped);
    out.stands_still = stop_.up();
    counts_.still_frames += out.stands_still;
    return status;
  }

  /// The estimator gave up a landmark: its track, if it lives on, begins a fresh one.
  void end_landmark(std::uint64_t track) { tracks_.end_landmark(track); }

  /// Time of the frame that the next one is compared with, where predicted motion begins; none before the first. Frames without usable
  /// observations are passed over.
  [[nodiscard]] const std::optional<GpsTime>& reference_time() const { return reference_time_; }
  [[nodiscard]] const AdmissionCounts& counts() const { return counts_; }
  [[nodiscard]] const TrackTable<T>& tracks() const { return tracks_; }

 private:
  [[nodiscard]] static AdmissionOptions effective(AdmissionOptions o) {
    o.pnp.range = o.range;
    if (!o.use_maturity) o.tracks.n_min = 1;
    return o;
  }

  template <class Left, class Right>
  Status process(const Frame& frame, const std::optional<Predicted>& predicted, Admitted& out, const Left& left, const Right& right) {
    const auto& offered = frame.observations;
    if (offered.empty()) return reject(FrameFate::empty, out);
    for (const StereoObservation& o : offered) (void)out.fates.push_back(screen_one(o, left, right));
    refuse_duplicates(frame, out);
    const std::size_t usable = count(out, ObservationFate::maturing);
    if (usable == 0) return reject(all_masked(out) ? FrameFate::masked : FrameFate::nothing_usable, out);

    const double step_s = reference_time_ ? seconds_between(*reference_time_, frame.time) : 0;
    const bool has_previous = reference_time_ && step_s <= options_.max_gap_s;
    if (!has_previous) tracks_.clear();
    tracks_.begin_frame();
    reference_time_ = frame.time;
    for (std::size_t i = 0; i < offered.size(); ++i)
      if (out.fates[i] != ObservationFate::maturing) tracks_.break_off(offered[i].track);

    Status status = ok_status();
    if (!options_.use_motion) {
      out.fate = FrameFate::full_unchecked, out.decision = FrameDecision::full;
    } else if (!has_previous) {
      stop_.reset();
      out.fate = FrameFate::no_previous;
    } else {
      status = check_motion(frame, predicted, step_s, out);
    }
    follow_tracks(frame, out);
    admit(frame, out);
    return status;
  }

  [[nodiscard]] Status reject(FrameFate fate, Admitted& out) {
    out.fate = fate;
    stop_.reset();
    return ok_status();
  }

  /// Tests that need the observation alone; `maturing` is what passes.
  template <class Left, class Right>
  [[nodiscard]] ObservationFate screen_one(const StereoObservation& o, const Left& left, const Right& right) const {
    if (!o.finite()) return ObservationFate::not_finite;
    if (options_.use_geometric) {
      if (o.score < options_.min_score) return ObservationFate::low_score;
      if (std::abs(o.v_difference_px) > options_.max_v_difference_px) return ObservationFate::vertical_disparity;
      if (!camera_.inside(o.pixel_px)) return ObservationFate::outside_image;
    }
    const RangeFault fault = range_fault(camera_, o.pixel_px, options_.range);
    if (fault == RangeFault::no_disparity) return ObservationFate::no_disparity;
    if (options_.use_geometric && fault == RangeFault::too_near) return ObservationFate::too_near;
    if (options_.use_geometric && fault == RangeFault::too_far) return ObservationFate::too_far;
    return options_.use_semantic ? screen_class(o, left, right) : ObservationFate::maturing;
  }

  template <class Left, class Right>
  [[nodiscard]] ObservationFate screen_class(const StereoObservation& o, const Left& left, const Right& right) const {
    const SemanticRules& rules = options_.semantic;
    if (rules.rejects(o.semantic_class)) return ObservationFate::semantic_class;
    if (o.near_rejected_class) return ObservationFate::semantic_boundary;
    const SemanticVerdict in_left = screen(rules, left, o.pixel_px[0], o.pixel_px[2], camera_.width_px);
    const SemanticVerdict in_right = screen(rules, right, o.pixel_px[1], o.pixel_px[2], camera_.width_px);
    if (in_left == SemanticVerdict::rejected_class || in_right == SemanticVerdict::rejected_class) return ObservationFate::semantic_class;
    if (in_left != SemanticVerdict::clear || in_right != SemanticVerdict::clear) return ObservationFate::semantic_boundary;
    return ObservationFate::maturing;
  }

  /// Every observation of a track that occurs more than once is refused, whatever else it is.
  void refuse_duplicates(const Frame& frame, Admitted& out) {
    order_.clear();
    for (std::size_t i = 0; i < frame.observations.size(); ++i) (void)order_.push_back(i);
    const auto id = [&](std::size_t k) { return frame.observations[order_[k]].track; };
    std::sort(order_.begin(), order_.end(),
              [&](std::size_t a, std::size_t b) { return frame.observations[a].track < frame.observations[b].track; });
    for (std::size_t k = 0; k < order_.size(); ++k)
      if ((k > 0 && id(k) == id(k - 1)) || (k + 1 < order_.size() && id(k) == id(k + 1)))
        out.fates[order_[k]] = ObservationFate::duplicate_track;
  }

  [[nodiscard]] static std::size_t count(const Admitted& out, ObservationFate fate) {
    return static_cast<std::size_t>(std::count(out.fates.begin(), out.fates.end(), fate));
  }
  [[nodiscard]] static bool all_masked(const Admitted& out) {
    return count(out, ObservationFate::semantic_class) + count(out, ObservationFate::semantic_boundary) == out.fates.size();
  }

  /// PnP on what was seen in the previous frame too, `step_s` ago; marks outliers, decides on the frame.
  [[nodiscard]] Status check_motion(const Frame& frame, const std::optional<Predicted>& predicted, double step_s, Admitted& out) {
    pairs_.clear();
    order_.clear();  // observation of each pair
    for (std::size_t i = 0; i < frame.observations.size(); ++i) {
      if (out.fates[i] != ObservationFate::maturing) continue;
      const StereoObservation& o = frame.observations[i];
      const Track* const track = tracks_.find(o.track);
      if (!track || !track->has_pixel || track->last_frame + 1 != tracks_.frame()) continue;
      if (range_fault(camera_, track->pixel_px, options_.range) != RangeFault::none) continue;
      (void)pairs_.push_back({track->pixel_px, o.pixel_px});
      (void)order_.push_back(i);
    }
    const Status solved = pnp_.solve(pairs_);
    out.pnp = pnp_.statistics();
    if (!solved) {
      stop_.reset();
      out.fate = FrameFate::no_motion;
      return solved.code == StatusCode::invalid_argument ? solved : ok_status();
    }
    out.has_motion = true;
    out.motion = pnp_.motion(), out.covariance = pnp_.covariance();
    out.sigma_scale = sigma_scale(out.pnp, options_.pnp.sigma_px);
    for (std::size_t k = 0; k < pairs_.size(); ++k)
      if (!pnp_.is_inlier(k)) out.fates[order_[k]] = ObservationFate::motion_outlier;
    (void)stop_.add(out.motion, out.covariance, median_displacement_px(), out.pnp.rms_px, step_s);
    judge_motion(predicted, out);
    return ok_status();
  }

  void judge_motion(const std::optional<Predicted>& predicted, Admitted& out) const {
    if (!predicted) {
      out.fate = FrameFate::full_alone, out.decision = FrameDecision::full;
      return;
    }
    out.difference = difference(out.motion, out.covariance, *predicted, options_.consistency);
    out.decision = decide(out.difference, options_.consistency);
    out.fate = out.decision == FrameDecision::full         ? FrameFate::full
               : out.decision == FrameDecision::reuse_only ? FrameFate::reuse_only
                                                           : FrameFate::differs;
  }

  /// Median over the inliers of the displacement in the left image.
  [[nodiscard]] double median_displacement_px() {
    lengths_.clear();
    for (std::size_t k = 0; k < pairs_.size(); ++k) {
      const Eigen::Matrix<Scalar, 3, 1> way = pairs_[k].current_px - pairs_[k].previous_px;
      if (pnp_.is_inlier(k)) (void)lengths_.push_back(std::hypot(way[0], way[2]));
    }
    double* const middle = lengths_.begin() + lengths_.size() / 2;
    std::nth_element(lengths_.begin(), middle, lengths_.end());
    return *middle;
  }

  /// Continues, begins and breaks tracks. A track that was away for a frame begins anew: nothing says that it came back as the same point.
  void follow_tracks(const Frame& frame, Admitted& out) {
    for (std::size_t i = 0; i < frame.observations.size(); ++i) {
      const StereoObservation& o = frame.observations[i];
      const bool passed = out.fates[i] == ObservationFate::maturing;
      if (!passed && out.fates[i] != ObservationFate::motion_outlier) continue;
      const Track* const track = tracks_.find(o.track);
      const bool was_away = track && track->last_frame + 1 != tracks_.frame();
      if (!passed || (was_away && options_.use_motion)) {
        tracks_.break_with(o.track, o.pixel_px);
      } else if (!tracks_.observe(o.track, o.pixel_px)) {
        out.fates[i] = ObservationFate::no_room;
      }
    }
  }

  /// Mature tracks become factors, as far as the decision on the frame and the number of observations allow.
  void admit(const Frame& frame, Admitted& out) {
    order_.clear();  // observation of each candidate
    candidates_.clear();
    for (std::size_t i = 0; i < frame.observations.size(); ++i) {
      if (out.fates[i] != ObservationFate::maturing) continue;
      const StereoObservation& o = frame.observations[i];
      const Track* const track = tracks_.find(o.track);
      if (!track || track->stage != TrackStage::mature) continue;
      const bool lives_on = tracks_.continues_landmark(*track);
      if (out.decision == FrameDecision::reject) {
        out.fates[i] = ObservationFate::frame_rejected;
      } else if (!lives_on && out.decision == FrameDecision::reuse_only) {
        out.fates[i] = ObservationFate::no_new_landmark;
      } else {
        (void)candidates_.push_back({o.pixel_px[0], o.pixel_px[2], o.score, lives_on, false});
        (void)order_.push_back(i);
      }
    }
    choose_spread(candidates_, options_.max_admitted, camera_.width_px, camera_.height_px);
    for (std::size_t k = 0; k < candidates_.size(); ++k) {
      const StereoObservation& o = frame.observations[order_[k]];
      out.fates[order_[k]] = candidates_[k].chosen ? ObservationFate::admitted : ObservationFate::surplus;
      if (!candidates_[k].chosen) continue;
      const bool begins = !candidates_[k].preferred;
      (void)out.observations.push_back(
          {o.track, tracks_.claim_landmark(o.track), begins, o.pixel_px, out.sigma_scale * options_.pnp.sigma_px});
      counts_.landmarks += begins;
    }
  }

  Camera camera_;
  AdmissionOptions options_;
  StereoPnp<N> pnp_;
  TrackTable<T> tracks_;
  StopCue stop_;
  AdmissionCounts counts_;
  typename StereoPnp<N>::Pairs pairs_;
  StaticVector<std::size_t, N> order_;
  StaticVector<double, N> lengths_;
  StaticVector<SpreadCandidate, N> candidates_;
  std::optional<GpsTime> last_time_{}, reference_time_{};
};

}  // namespace searvins::vision
