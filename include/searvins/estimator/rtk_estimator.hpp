// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// RTK from two receivers: the estimator that a GNSS-only user touches.
///
/// One rover epoch goes this way:
///
///     track       single point and Doppler: receiver clock offset, hence the time of the state, and a coarse position
///     difference  screened, base-corrected single differences in groups with a pivot            (gnss/double_difference.hpp)
///     start       robust position of the epoch by graduated non-convexity                         (estimator/snapshot.hpp)
///     extend      a state, its motion factor, code, phase and Doppler batches, ambiguities by hybrid continuation
///     float       optimise with every integer constraint switched off; marginalise what is older than the lag
///     resolve     LAMBDA on the joint marginal of that very float, gates                          (ambiguity/resolution.hpp)
///     fix         integer constraints on, optimise again; contradicted ones are taken back
///
/// The covariance of a solution that rests on integers allows for their being wrong (law of total variance). They are right with a probability q, the
/// success rate times the share of the offered ambiguities that agreed; else the float is what is known:
///
///     C = q C_fixed + (1 - q) C_float
///
/// Without a base (none given, none of late, too few satellites in common) and with an inertial unit, codes of the rover alone take the place of the
/// differences, labelled spp, and the window goes on (gnss/undifferenced_epoch.hpp).
///
/// A wrong fix cannot confirm itself: float and covariance that integers are judged by, and the prior that leaves the window, never contain an earlier
/// integer. Integers held in the window only shape the solution that is output between fixes.
///
/// The object is some tens of megabytes with HostedCapacity and never allocates: create it once, static or on the heap, never as a local.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

#include <searvins/ambiguity/continuation.hpp>
#include <searvins/ambiguity/resolution.hpp>
#include <searvins/estimator/rtk_options.hpp>
#include <searvins/estimator/rtk_problem.hpp>
#include <searvins/estimator/rtk_solution.hpp>
#include <searvins/estimator/snapshot.hpp>
#include <searvins/geodesy/local_frame.hpp>
#include <searvins/gnss/base_buffer.hpp>
#include <searvins/gnss/double_difference.hpp>
#include <searvins/gnss/ephemeris.hpp>
#include <searvins/gnss/single_point_tracker.hpp>
#include <searvins/gnss/undifferenced_epoch.hpp>
#include <searvins/math/deferred.hpp>

namespace searvins::estimator {

/// See the file comment. `Config` is an RtkConfig, or a struct with the same members.
template <class Config>
class RtkEstimator {
 public:
  using Cap = typename Config::Capacity;
  using Problem = RtkProblem<Config>;
  using Smoother = smoother::FixedLagSmoother<Problem>;
  using CodePhaseForm = typename Config::CodePhaseForm;
  using DopplerForm = typename Config::DopplerForm;
  using Motion = typename Config::Motion;
  using State = typename Motion::State;
  using StateCovariance = typename Motion::Covariance;
  using Scalar = typename Problem::Scalar;
  using Vector3 = Eigen::Matrix<Scalar, 3, 1>;
  using Matrix3 = Eigen::Matrix<Scalar, 3, 3>;
  using LocalFrame = math::Deferred<geodesy::LocalFrame, Config>;

  /// Settings of the robust policies are those of the forms themselves (their `loss`).
  explicit RtkEstimator(const RtkOptions& options = {}, const CodePhaseForm& code_phase = {}, const DopplerForm& doppler = {},
                        const typename Motion::Options& motion = {});

  /// Broadcast records. Errors: capacity_exceeded.
  Status add_ephemeris(const gnss::Ephemeris& e);
  void set_ionosphere(const gnss::KlobucharCoefficients& k) { ephemerides_.ionosphere = k; }
  /// Base antenna, ECEF metres. Errors: non_finite, invalid_argument.
  Status set_base_position(const Eigen::Vector3d& position_e_m);
  /// A base epoch, in time order. Errors: duplicate, out_of_order.
  Status add_base(const gnss::ObservationEpoch& epoch);

  /// One rover epoch. A refused epoch (out_of_order, duplicate; no position at all yet: the tracker's status) leaves the estimator as it was; otherwise
  /// there is a solution, labelled with what it rests on.
  Result<RtkSolution> update(const gnss::ObservationEpoch& rover);

  /// A state without GNSS observations at a time after the last one, where the motion policy carries the window on. Errors: no_data (it does not, or
  /// there is no state yet), out_of_order, and those of the motion (IMU coverage); nothing was changed then.
  Result<RtkSolution> advance(GpsTime time);
  /// The same with a position from elsewhere (a type that the motion policy takes) at its time. Loose coupling; the status is the fix's.
  template <class Fix>
  Result<RtkSolution> advance_to(const Fix& fix) {
    return advance_with(fix.time, SolutionSource::position, [&](smoother::Key<State> state, RtkSolution& out) {
      const Status s = motion_.add_position(smoother_, state, fix, antenna_);
      if (s.ok()) out.status = status_of_quality(fix.quality), out.satellites = std::max(0, fix.satellites);
      return s;
    });
  }
  /// A state at a stereo frame. A frame of about the newest state's time (options: shared_state_s) goes to that state, says so by no_data ("the frame
  /// joined the newest state"), and counts from the next update on. Integers are not looked for. Errors besides: those of advance().
  template <class Frame>
  Result<RtkSolution> see(const Frame& frame) {
    if (window_running() && std::abs(seconds_between(last_time_, frame.time)) <= options_.shared_state_s) {
      const Status s = motion_.add_frame(smoother_, nodes_.back().state, last_time_, frame, stationary_);
      return s.ok() ? failure(StatusCode::no_data, kJoined) : s;
    }
    if (!window_running() && frame.time <= last_time_) return failure(StatusCode::no_data, "the frame is from before the window");
    return advance_with(frame.time, SolutionSource::camera, [&](smoother::Key<State> state, RtkSolution& out) {
      return motion_.add_frame(smoother_, state, out.time, frame, out.stationary);
    });
  }
  static constexpr const char* kJoined = "the frame joined the newest state";

  /// RTKLIB's quality numbers.
  [[nodiscard]] static SolutionStatus status_of_quality(int quality) {
    return quality == 1 ? SolutionStatus::fix : quality == 2 ? SolutionStatus::float_ : quality == 3 || quality == 4 ? SolutionStatus::dgnss : SolutionStatus::spp;
  }

  /// Starts from a known state (an alignment) in a frame; a window that is running is dropped.
  void begin_at(const State& state, const StateCovariance& covariance, GpsTime time, const LocalFrame& frame);
  /// The antenna at the end of a motion that begins at the newest state; nothing is changed. Errors: no_data.
  template <class Integrated>
  [[nodiscard]] Result<RtkSolution> predict_by(const Integrated& motion) const {
    if (!has_state_) return failure(StatusCode::no_data, "there is no state yet");
    RtkSolution out;
    out.tag = out.time = motion.end;
    const auto [x, P] = motion_.predict_by(last_state_, last_covariance_, motion);
    describe(x, P, motion_.antenna_at(motion.end), out);
    return out;
  }
  [[nodiscard]] Motion& motion() { return motion_; }
  [[nodiscard]] const Motion& motion() const { return motion_; }
  /// Whether there is a state to go on from, and it: the newest estimate.
  [[nodiscard]] bool has_state() const { return has_state_; }
  [[nodiscard]] const State& state() const { return last_state_; }
  [[nodiscard]] GpsTime state_time() const { return last_time_; }

  /// The differenced epoch of the last update, for reports.
  [[nodiscard]] const gnss::DifferencedEpoch& differenced() const { return epoch_; }
  /// Single-point solution rows of the last update, for reports (empty when it coasted, or found no position).
  [[nodiscard]] const gnss::SinglePointSolution& single_point() const { return tracked_.single_point; }
  [[nodiscard]] const Smoother& smoother() const { return smoother_; }
  [[nodiscard]] const RtkOptions& options() const { return options_; }
  /// The local frame of the window: East-North-Up where it was started.
  [[nodiscard]] const LocalFrame& frame() const { return frame_; }

  /// The smoothed estimate of the oldest epoch of the window: what is known `lag_s` later. Errors: no_data while there is
  /// no window.
  struct LaggedState {
    GpsTime time{};
    Vector3 position_e_m{Vector3::Zero()};
    SolutionStatus status{SolutionStatus::dr};
  };
  [[nodiscard]] Result<LaggedState> oldest() const;

 private:
  using AmbiguityKey = smoother::Key<gnss::Ambiguity>;
  static constexpr int kPhases = Cap::phases_per_epoch;
  static constexpr std::size_t at(int i) { return static_cast<std::size_t>(i); }

  /// A state of the window.
  struct Node {
    smoother::Key<State> state{};
    GpsTime time{};
    typename Motion::Antenna antenna{};
    SolutionStatus status{SolutionStatus::dr};
  };
  /// A double-difference ambiguity of the present epoch: a, minus b when states are single differences.
  struct Difference {
    AmbiguityKey a{}, b{};
    ambiguity::ArcId arc{};
  };
  /// The epoch that the differencer remembers, and where the antenna was then.
  struct Compared {
    GpsTime time{};
    Vector3 position_e_m{Vector3::Zero()};
    bool is_estimated{false};
  };
  /// An integer constraint in the window.
  struct Held {
    smoother::Key<gnss::IntegerFix> factor{};
    Difference difference{};
    std::int64_t integer{0};
  };

  [[nodiscard]] bool window_running() const { return !nodes_.empty(); }

  template <class AddMeasurement>
  Result<RtkSolution> advance_with(GpsTime time, SolutionSource source, AddMeasurement add_measurement) {
    if (!goes_on_without_gnss()) return failure(StatusCode::no_data, "nothing carries the window on without GNSS");
    if (time <= last_time_) return failure(StatusCode::out_of_order, "a state not after the last one");
    if (const auto x = motion_.predict(last_state_, last_time_, time); !x.ok()) return x.status();
    RtkSolution out;
    out.time = time, out.tag = time.plus_seconds(clock_offset_s_);
    out.clock_offset_s = clock_offset_s_;
    out.source = source;
    tracked_.clear();
    predict(nullptr, out);
    drop_differences(), epoch_.doppler.clear(), epoch_.doppler_pivot = -1, is_undifferenced_ = false;
    const bool is_frame = source == SolutionSource::camera;
    if (!is_frame) continuation_.skip_epoch();
    if (extend(out, !is_frame)) {
      out.smoother_status = add_measurement(nodes_.back().state, out);
      const SolutionStatus measured = out.status;
      is_frame ? estimate_frame(out) : estimate(out);
      if (out.status == SolutionStatus::dr) out.status = nodes_.empty() ? SolutionStatus::dr : measured;
    } else {
      without_differences(nullptr, out);
    }
    return out;
  }

  // ---- begin: time and prediction --------------------------------------------------------------------------------------------------------

  /// Here and below, `tracked` is nullptr where the tracker found no position.
  [[nodiscard]] RtkSolution begin(const gnss::ObservationEpoch& rover, const gnss::TrackedPosition* tracked) {
    RtkSolution out;
    out.tag = rover.tag;
    if (tracked) clock_offset_s_ = seconds_between(tracked->time, rover.tag);
    out.clock_offset_s = clock_offset_s_;
    out.time = tracked ? tracked->time : rover.tag.plus_seconds(-clock_offset_s_);
    if (window_running() && !Motion::is_inertial && since_last(out) > options_.max_gap_s) restart();
    return out;
  }

  [[nodiscard]] double since_last(const RtkSolution& out) const { return seconds_between(last_time_, out.time); }
  [[nodiscard]] bool goes_on_without_gnss() const { return Motion::is_inertial && has_state_; }
  void settle(const State& state, const StateCovariance& covariance, GpsTime time, bool is_float) {
    last_state_ = state, last_covariance_ = covariance, last_time_ = time, has_state_ = true;
    motion_.settle(state, covariance, time, is_float);
  }

  /// The window's prediction is worth starting from when it is not older than this.
  static constexpr double kTrustedPredictionS = 2.5;

  /// Where the epoch probably is, before its differences are looked at, with a sigma.
  void predict(const gnss::TrackedPosition* tracked, const RtkSolution& out) {
    const bool trusted = Motion::is_inertial || (window_running() && since_last(out) <= kTrustedPredictionS) || !tracked;
    is_predicted_ = false;
    if (has_state_ && trusted && since_last(out) > 0) {
      if (const auto x = motion_.predict(last_state_, last_time_, out.time); x.ok()) {
        const auto antenna = motion_.antenna_at(out.time);
        predicted_ = *x, is_predicted_ = true;
        predicted_covariance_ = motion_.predicted_covariance(last_state_, last_covariance_, last_time_, out.time);
        const auto P = Motion::antenna_covariance(predicted_, predicted_covariance_, antenna);
        predicted_e_m_ = frame_.to_ecef(antenna.position_w_m(predicted_));
        predicted_v_e_mps_ = frame_.R_ew * antenna.velocity_w_mps(predicted_);
        predicted_position_m2_ = P.template topLeftCorner<3, 3>();
        predicted_sigma_m_ = std::sqrt(std::max(1e-4, predicted_position_m2_.trace()));
        return;
      }
    }
    if (!tracked) return;  // the last prediction stands
    predicted_e_m_ = tracked->position_e_m;
    predicted_v_e_mps_ = tracked->velocity_e_mps;
    const Matrix3& covariance_m2 = tracked->position_covariance_m2;
    predicted_sigma_m_ = std::max(2.0, 2 * std::sqrt(covariance_m2.trace()));
  }

  // ---- difference ------------------------------------------------------------------------------------------------------------------------

  Status difference(const gnss::ObservationEpoch& rover, const gnss::TrackedPosition* tracked, RtkSolution& out) {
    predict(tracked, out);
    const Status s = differencer_.difference(rover, base_, ephemerides_, predicted_e_m_, options_.differencing, epoch_, moved_since_compared(out));
    if (!s.ok()) return s;
    if (epoch_.base_status.ok()) out.base_age_s = epoch_.base_age_s;
    return epoch_.base_status;
  }

  /// The antenna's displacement since the epoch that the next one's phases are compared with, where readings predict it and the slip tests ask for it
  /// (CycleSlipOptions::predicted_motion). Over seconds its error is that of the velocity times the time.
  [[nodiscard]] std::optional<gnss::PredictedDisplacement> moved_since_compared(const RtkSolution& out) const {
    if (!options_.differencing.slips.predicted_motion) return std::nullopt;
    if (!Motion::is_inertial || !is_predicted_ || !compared_.is_estimated) return std::nullopt;
    const double dt_s = seconds_between(compared_.time, out.time);
    const auto P = Motion::antenna_covariance(predicted_, predicted_covariance_, motion_.antenna_at(out.time));
    const Matrix3 velocity_covariance_e = frame_.R_ew * P.template bottomRightCorner<3, 3>() * frame_.R_ew.transpose();
    return gnss::PredictedDisplacement{predicted_e_m_ - compared_.position_e_m, dt_s * dt_s * velocity_covariance_e};
  }

  /// What is left of the epoch are its Doppler shifts, which need no base.
  void drop_differences() {
    epoch_.signals.clear(), epoch_.groups.clear();
    epoch_.satellites = 0;
  }

  /// Codes of the rover alone where there is something to carry them; else only its Doppler shifts are left.
  void without_base(const gnss::ObservationEpoch& rover) {
    drop_differences();
    if (!options_.use_undifferenced) return;
    gnss::undifference(rover, ephemerides_, predicted_e_m_, options_.tracker.single_point, undifferenced_codes_, epoch_);
    is_undifferenced_ = !epoch_.groups.empty();
  }

  /// Without double differences: the better of prediction and single point, said so.
  void without_differences(const gnss::TrackedPosition* tracked, RtkSolution& out) {
    out.satellites = tracked ? tracked->single_point.used : 0;
    out.status = SolutionStatus::dr;
    if (tracked) {
      if (tracked->status != gnss::TrackStatus::coasted) out.status = SolutionStatus::spp;
      set_from_tracker(*tracked, out);
    } else {
      out.position_e_m = predicted_e_m_, out.velocity_e_mps = predicted_v_e_mps_;
      out.covariance_enu_m2 = Matrix3::Identity() * predicted_sigma_m_ * predicted_sigma_m_;
      out.velocity_covariance_enu = Matrix3::Identity() * std::max(1.0, predicted_sigma_m_ * predicted_sigma_m_ / 100);
    }
  }
  static void set_from_tracker(const gnss::TrackedPosition& t, RtkSolution& out) {
    const Matrix3 R_ew = geodesy::ecef_from_enu(geodesy::geodetic_from_ecef(t.position_e_m));
    out.position_e_m = t.position_e_m, out.velocity_e_mps = t.velocity_e_mps;
    out.covariance_enu_m2 = R_ew.transpose() * t.position_covariance_m2 * R_ew;
    out.velocity_covariance_enu = R_ew.transpose() * t.velocity_covariance_m2ps2 * R_ew;
  }

  // ---- extend: state, factors, ambiguities -----------------------------------------------------------------------------------------------

  /// False when the state was refused (smoother_status says why): the window is as it was.
  [[nodiscard]] bool extend(RtkSolution& out, bool is_epoch = true) {
    out.satellites = epoch_.satellites;
    antenna_ = motion_.antenna_at(out.time);
    if (is_epoch) continuation_.begin_epoch();
    select_phases();
    const Vector3 start_e_m = snapshot_position();
    if (!window_running()) {
      if (!Motion::is_inertial) frame_ = LocalFrame::at(start_e_m);
      out.restarted = true;
    }
    const State start = motion_.placed(is_predicted_ ? predicted_ : State{}, antenna_, frame_.to_local(start_e_m), frame_.R_ew.transpose() * predicted_v_e_mps_);
    if (is_instantaneous() && !Motion::is_inertial) restart();  // an epoch stands for itself: nothing of earlier codes reaches it through the motion
    while (nodes_.full()) marginalise_oldest();
    const auto state = smoother_.add_variable(start, out.time);
    if (!state.ok()) {
      out.smoother_status = state.status();
      return false;
    }
    const Status linked = window_running() ? motion_.add_link(smoother_, nodes_.back().state, *state, nodes_.back().time, out.time, out)
                                           : motion_.add_start(smoother_, *state, start, start_covariance());
    if (!linked.ok()) {
      out.smoother_status = linked;
      (void)smoother_.remove_variable(*state);
      return false;
    }
    (void)nodes_.push_back({*state, out.time, antenna_, SolutionStatus::dr});
    stationary_ = out.stationary;
    code_keys_.clear(), phase_keys_.clear(), differences_.clear();
    code_variance_factor_ = is_undifferenced_ ? 1 : code_noise_.variance_factor(), phase_variance_factor_ = phase_noise_.variance_factor();
    code_information_share_ = 1 / correlation_factor(out);
    for (int g = 0; g < static_cast<int>(epoch_.groups.size()); ++g) add_group(g, *state, start_e_m, out);
    if (options_.use_doppler) add_doppler(*state, out);
    if (!code_keys_.empty()) last_epoch_time_ = out.time, has_epoch_ = true;
    return true;
  }

  /// What a new window starts from: the prediction, widened where the last window was given up.
  [[nodiscard]] StateCovariance start_covariance() {
    StateCovariance P = is_predicted_ ? predicted_covariance_ : StateCovariance::Identity();
    if (doubt_m_ > 0) P = Motion::widened(P, doubt_m_);
    doubt_m_ = 0;
    return P;
  }

  [[nodiscard]] bool is_instantaneous() const { return options_.continuity == ambiguity::ContinuityMode::instantaneous; }

  /// n epochs within the correlation time of code errors are worth one, so each counts for 1/n.
  [[nodiscard]] double correlation_factor(const RtkSolution& out) const {
    if (is_instantaneous()) return 1;
    const double interval_s = has_epoch_ ? seconds_between(last_epoch_time_, out.time) : 1.0;
    const double speed_mps = std::max(1e-3, predicted_v_e_mps_.norm());
    double correlation_s = std::min(options_.code_correlation_s, options_.code_correlation_m / speed_mps);
    if (is_undifferenced_) correlation_s = options_.undifferenced_correlation_s;
    return std::max(1.0, correlation_s / std::max(0.05, interval_s));
  }

  /// Learns the code noise of the receivers from the codes of this epoch: they determine the position and each batch's latent pivot error.
  void learn_code_noise() {
    code_noise_.begin();
    code_noise_.add_parameters(3);
    add_residuals(code_keys_, code_noise_);
    code_noise_.finish(options_.code_noise);
  }

  /// Learns the phase noise from the phases of a fixed epoch: those without an integer determine their ambiguity and nothing else.
  void learn_phase_noise(const RtkSolution& out) {
    phase_noise_.begin();
    phase_noise_.add_parameters(3 + out.phases - out.fixed_phases);
    add_residuals(phase_keys_, phase_noise_);
    phase_noise_.finish(options_.phase_noise);
  }

  template <class Keys, class Noise>
  void add_residuals(const Keys& keys, Noise& noise) {
    for (const auto& key : keys) {
      const double* e = smoother_.whitened_rows(key);
      if (!e) continue;
      const auto* f = smoother_.find_factor(key);
      for (int i = 0; i < f->rows(); ++i) noise.add(e[i]);
      noise.add_parameters(f->rows() - f->size());
    }
  }

  template <class F>
  smoother::Key<F> add(const F& factor, RtkSolution& out) {
    const auto key = smoother_.add_factor(factor);
    if (!key.ok()) {
      out.smoother_status = key.status();
      return {};
    }
    return *key;
  }

  /// Which signals bring their phase: all, or the highest when there are more than an epoch may hold.
  void select_phases() {
    phase_usable_.clear();
    StaticVector<double, gnss::kMaxCorrectedSignals> elevations;
    for (const gnss::CorrectedSignal& s : epoch_.signals)
      if (options_.use_phase && std::isfinite(s.phase_m)) (void)elevations.push_back(s.elevation_rad);
    double lowest = -10;
    if (elevations.size() > at(kPhases)) {
      std::nth_element(elevations.begin(), elevations.end() - kPhases, elevations.end());
      lowest = elevations[elevations.size() - at(kPhases)];
    }
    int taken = 0;
    for (const gnss::CorrectedSignal& s : epoch_.signals) {
      const bool use = options_.use_phase && std::isfinite(s.phase_m) && s.elevation_rad >= lowest && taken < kPhases;
      taken += use ? 1 : 0;
      (void)phase_usable_.push_back(use);
    }
  }

  [[nodiscard]] static ambiguity::ArcId arc_of(const gnss::CorrectedSignal& s) { return {s.satellite, s.rover_signal, s.base_signal}; }

  /// Pivot of a group's phases: the group's own, or the highest satellite with a phase when that has none. -1: fewer than two phases.
  [[nodiscard]] int phase_pivot(const gnss::SignalGroup& group) const {
    int best = -1, count = 0;
    const auto consider = [&](int i) {
      if (!phase_usable_[at(i)]) return;
      ++count;
      if (best < 0 || epoch_.signals[at(i)].elevation_rad > epoch_.signals[at(best)].elevation_rad) best = i;
    };
    consider(group.pivot);
    if (count == 1) {
      for (std::uint16_t c : group.candidates) count += phase_usable_[c] ? 1 : 0;
      return count >= 2 ? group.pivot : -1;
    }
    for (std::uint16_t c : group.candidates) consider(c);
    return count >= 2 ? best : -1;
  }

  /// The state that a continued or walked phase would use, or an invalid key.
  [[nodiscard]] AmbiguityKey past_state(const gnss::CorrectedSignal& s, gnss::SatelliteId pivot) const {
    const auto* arc = continuation_.find(arc_of(s));
    if (!arc || continuation_.decide(arc_of(s), s.continuity == gnss::Continuity::verified, pivot) == ambiguity::Transition::fresh) return {};
    return smoother_.find(arc->handle) ? arc->handle : AmbiguityKey{};
  }
  [[nodiscard]] gnss::SatelliteId pivot_id(int pivot) const {
    return options_.handover == PivotHandover::exact ? gnss::SatelliteId{} : epoch_.signals[at(pivot)].satellite;
  }

  /// Codes and continued phases of the epoch, for the start of Gauss-Newton.
  [[nodiscard]] Vector3 snapshot_position() {
    snapshot_.rows.clear();
    snapshot_.predicted_e_m = predicted_e_m_;
    snapshot_.predicted_sigma_m = predicted_sigma_m_;
    std::uint16_t group_number = 0;
    for (const gnss::SignalGroup& group : epoch_.groups) {
      const auto each = [&](auto&& fn) {
        fn(group.pivot);
        for (std::uint16_t c : group.candidates) fn(static_cast<int>(c));
      };
      each([&](int i) {
        const gnss::CorrectedSignal& s = epoch_.signals[at(i)];
        (void)snapshot_.rows.push_back({s.satellite_e_m, s.code_m, s.code_variance_m2, group_number});
      });
      ++group_number;
      const int pivot = phase_pivot(group);
      if (pivot >= 0)
        each([&](int i) {
          if (!phase_usable_[at(i)]) return;
          const gnss::CorrectedSignal& s = epoch_.signals[at(i)];
          const bool is_zero = options_.handover == PivotHandover::restart && i == pivot;  // the pivot's double difference with itself
          const AmbiguityKey past = is_zero ? AmbiguityKey{} : past_state(s, pivot_id(pivot));
          if (!is_zero && !past.valid()) return;
          const double n = is_zero ? 0.0 : smoother_.find(past)->value;
          (void)snapshot_.rows.push_back({s.satellite_e_m, s.phase_m - s.wavelength_m * n, s.phase_variance_m2, group_number});
        });
      ++group_number;
    }
    return snapshot_.solve();
  }

  /// Code innovation against the prediction: r = z_s - z_p - (rho_s - rho_p) with variance (u_s - u_p)' P (u_s - u_p) + sigma_s^2 + sigma_p^2.
  [[nodiscard]] bool passes_gate(int i, int pivot) const {
    const gnss::CorrectedSignal &s = epoch_.signals[at(i)], &p = epoch_.signals[at(pivot)];
    const Vector3 to_s = predicted_e_m_ - s.satellite_e_m, to_p = predicted_e_m_ - p.satellite_e_m;
    const double r = s.code_m - p.code_m - (gnss::range_m(predicted_e_m_, s.satellite_e_m) - gnss::range_m(predicted_e_m_, p.satellite_e_m));
    const Vector3 j_w = frame_.R_ew.transpose() * (to_s / to_s.norm() - to_p / to_p.norm());
    const double variance = j_w.dot(predicted_position_m2_ * j_w) + s.code_variance_m2 + p.code_variance_m2;
    return r * r <= options_.code_gate_sigmas * options_.code_gate_sigmas * variance;
  }
  /// Fills code_usable_ for a group; phases of codes that fail the gate are left out. When most fail, the pivot is what is wrong, and none is judged by it.
  void gate_codes(const gnss::SignalGroup& group) {
    code_usable_.clear();
    const bool is_on = options_.code_gate_sigmas > 0 && is_predicted_;
    int failing = 0;
    for (std::uint16_t c : group.candidates) {
      (void)code_usable_.push_back(!is_on || passes_gate(c, group.pivot));
      failing += code_usable_.back() ? 0 : 1;
    }
    if (2 * failing > static_cast<int>(group.candidates.size())) {
      for (bool& usable : code_usable_) usable = true;
      return;
    }
    for (std::size_t k = 0; k < group.candidates.size(); ++k)
      if (!code_usable_[k]) phase_usable_[group.candidates[k]] = false;
  }

  void add_group(int g, smoother::Key<State> state, const Vector3& start_e_m, RtkSolution& out) {
    const gnss::SignalGroup& group = epoch_.groups[at(g)];
    typename Problem::CodeFactor code;
    begin_batch(code, state, group.pivot);
    const auto is_room = [](const auto& f) { return !f.candidates.full(); };
    std::array<double, static_cast<std::size_t>(Cap::candidates)> variances{};
    gate_codes(group);
    for (std::size_t k = 0; k < group.candidates.size(); ++k)
      if (const std::uint16_t c = group.candidates[k]; is_room(code) && code_usable_[k]) {
        variances[code.candidates.size()] = epoch_.signals[c].code_variance_m2 * code_variance_factor_;
        (void)code.candidates.push_back({epoch_.signals[c].satellite_e_m, epoch_.signals[c].code_m});
      }
    code.information_share = code_information_share_;
    code.pivot.z = epoch_.signals[at(group.pivot)].code_m;
    finish_batch(code, variances.data(), epoch_.signals[at(group.pivot)].code_variance_m2 * code_variance_factor_, code_phase_form_, out, code_keys_);

    const int pivot = phase_pivot(group);
    if (pivot < 0) return;
    typename Problem::PhaseFactor phase;
    begin_batch(phase, state, pivot);
    phase.wavelength_m = group.wavelength_m;
    phase.pivot.z = epoch_.signals[at(pivot)].phase_m;
    const bool exact = options_.handover == PivotHandover::exact;
    const double reference_m = phase_reference(group, pivot, start_e_m);
    if (exact) phase.pivot_ambiguity = ambiguity_state(pivot, pivot, reference_m, start_e_m, out);
    if (exact && !phase.pivot_ambiguity.valid()) return;
    const auto add_candidate = [&](int i) {
      if (i == pivot || !phase_usable_[at(i)] || !is_room(phase)) return;
      const gnss::CorrectedSignal& s = epoch_.signals[at(i)];
      const AmbiguityKey key = ambiguity_state(i, pivot, reference_m, start_e_m, out);
      if (!key.valid()) return;
      variances[phase.candidates.size()] = s.phase_variance_m2 * phase_variance_factor_;
      (void)phase.candidates.push_back({s.satellite_e_m, s.phase_m});
      (void)phase.ambiguities.push_back(key);
      (void)differences_.push_back({key, phase.pivot_ambiguity, arc_of(s)});
    };
    add_candidate(group.pivot);
    for (std::uint16_t c : group.candidates) add_candidate(c);
    out.phases += phase.size();
    finish_batch(phase, variances.data(), epoch_.signals[at(pivot)].phase_variance_m2 * phase_variance_factor_, code_phase_form_, out, phase_keys_);
  }

  template <class F>
  void begin_batch(F& factor, smoother::Key<State> state, int pivot) const {
    factor.state = state;
    factor.frame = frame_;
    factor.antenna = antenna_;
    factor.pivot.satellite_e_m = epoch_.signals[at(pivot)].satellite_e_m;
  }

  /// Covariance, form, latent start; then into the window.
  template <class F, class Form, class Keys>
  void finish_batch(F& factor, const double* variances, double pivot_variance, const Form& form, RtkSolution& out, Keys& keys) {
    if (factor.candidates.empty()) return;
    const auto covariance = robust::SharedPivot<double, static_cast<int>(decltype(factor.candidates)::capacity())>::from(variances, factor.size(), pivot_variance);
    if (!covariance.ok()) {
      out.smoother_status = covariance.status();
      return;
    }
    factor.covariance = *covariance;
    factor.formulation = form;
    if constexpr (Form::has_latent) {
      const typename Smoother::WindowType::Values values = smoother_.window().values(smoother::Which::estimate);
      gnss::PivotError start;
      start.value = factor.initial_latent(values);
      const auto latent = smoother_.add_variable(start, out.time);
      if (!latent.ok()) {
        out.smoother_status = latent.status();
        return;
      }
      factor.latent = *latent;
    }
    const auto key = add(factor, out);
    if (key.valid()) (void)keys.push_back(key);
    out.double_differences += factor.size();
  }

  /// Level, in metres, from which the fresh ambiguities of a group are counted, so that their phases agree with the start position:
  /// lambda N_i = phase_i - range_i - level. From a state that goes on, else from the pivot's code.
  [[nodiscard]] double phase_reference(const gnss::SignalGroup& group, int pivot, const Vector3& start_e_m) const {
    const auto level = [&](int i, double n_cycles) {
      const gnss::CorrectedSignal& s = epoch_.signals[at(i)];
      return s.phase_m - gnss::range_m(start_e_m, s.satellite_e_m) - s.wavelength_m * n_cycles;
    };
    if (options_.handover == PivotHandover::restart) return level(pivot, 0);
    double sum = 0;
    int count = 0;
    const auto consider = [&](int i) {
      if (!phase_usable_[at(i)]) return;
      const AmbiguityKey past = past_state(epoch_.signals[at(i)], {});
      if (past.valid()) sum += level(i, smoother_.find(past)->value), ++count;
    };
    consider(group.pivot);
    for (std::uint16_t c : group.candidates) consider(c);
    if (count > 0) return sum / count;
    const gnss::CorrectedSignal& s = epoch_.signals[at(pivot)];
    return s.code_m - gnss::range_m(start_e_m, s.satellite_e_m);
  }

  /// The ambiguity state of a signal at this epoch: continued, walked or fresh.
  [[nodiscard]] AmbiguityKey ambiguity_state(int i, int pivot, double reference_m, const Vector3& start_e_m, RtkSolution& out) {
    const gnss::CorrectedSignal& s = epoch_.signals[at(i)];
    const ambiguity::ArcId id = arc_of(s);
    ambiguity::Transition transition = continuation_.decide(id, s.continuity == gnss::Continuity::verified, pivot_id(pivot));
    const AmbiguityKey past = past_state(s, pivot_id(pivot));
    if (!past.valid()) transition = ambiguity::Transition::fresh;
    if (transition == ambiguity::Transition::continued) {
      (void)continuation_.record(id, transition, past, pivot_id(pivot));
      return past;
    }
    gnss::Ambiguity start;
    start.value = transition == ambiguity::Transition::walked ? smoother_.find(past)->value
                                                              : (s.phase_m - gnss::range_m(start_e_m, s.satellite_e_m) - reference_m) / s.wavelength_m;
    const auto key = smoother_.add_variable(start, out.time);
    if (!key.ok()) {
      out.smoother_status = key.status();
      return {};
    }
    if (transition == ambiguity::Transition::walked)
      add(gnss::AmbiguityWalk{*key, past, 0, options_.walk_sigma_cycles}, out);
    else
      add(gnss::AmbiguityDatum{*key, {}, start.value, options_.datum_sigma_cycles}, out);
    if (!continuation_.record(id, transition, *key, pivot_id(pivot))) out.smoother_status = failure(StatusCode::capacity_exceeded, "more ambiguity arcs than the table holds");
    return *key;
  }

  void add_doppler(smoother::Key<State> state, RtkSolution& out) {
    if (epoch_.doppler_pivot < 0 || epoch_.doppler.size() < 2) return;
    typename Problem::DopplerFactor factor;
    factor.state = state;
    factor.frame = frame_;
    factor.antenna = antenna_;
    std::array<double, static_cast<std::size_t>(Cap::doppler_candidates)> variances{};
    for (std::size_t i = 0; i < epoch_.doppler.size(); ++i) {
      const gnss::DopplerMeasurement& d = epoch_.doppler[i];
      if (static_cast<int>(i) == epoch_.doppler_pivot) {
        factor.pivot = {d.unit_e, d.rate_mps};
      } else if (!factor.candidates.full()) {
        variances[factor.candidates.size()] = d.variance_m2ps2;
        (void)factor.candidates.push_back({d.unit_e, d.rate_mps});
      }
    }
    const int before = out.double_differences;
    StaticVector<smoother::Key<typename Problem::DopplerFactor>, 1> keys;
    finish_batch(factor, variances.data(), epoch_.doppler[at(epoch_.doppler_pivot)].variance_m2ps2, doppler_form_, out, keys);
    out.double_differences = before;
  }

  // ---- estimate: float, marginalise, resolve, fix ------------------------------------------------------------------------------------------

  void estimate(RtkSolution& out) {
    smoother_.template set_enabled<gnss::IntegerFix>(false);
    if (!optimise(out)) return recover(out);
    out.status = status_of_rows(out);
    const bool have_float = collect_float(out);
    if (!have_float) float_.Q_pp = held_.empty() ? Matrix3::Zero() : position_covariance();
    while (is_window_long(out)) marginalise_oldest();
    if (nodes_.empty()) return recover(out);
    forget_gone_integers();
    release_contradicted(out);
    StaticVector<smoother::Key<gnss::IntegerFix>, kPhasesSize> fresh;
    if (have_float) resolve(out, fresh);
    if (!held_.empty()) {
      smoother_.template set_enabled<gnss::IntegerFix>(true);
      if (!optimise(out)) return recover(out);
      if (!fresh.empty()) learn_phase_noise(out);
      if (!fresh.empty() && is_suspect()) take_back(fresh, out);
    }
    if (out.verdict == ambiguity::ResolutionVerdict::accepted) {
      out.status = SolutionStatus::fix;
      integer_trust_ = out.success_rate * outcome_.count / std::max(1, outcome_.tried);
    }
    write(out);
    if (options_.fix_memory == FixMemory::epoch) release_all();
    out.held_integers = static_cast<int>(held_.size());
    out.code_scale = std::sqrt(code_noise_.variance_factor()), out.phase_scale = std::sqrt(phase_noise_.variance_factor());
    if (!is_undifferenced_) learn_code_noise();
    watch_divergence(out);
  }
  static constexpr std::size_t kPhasesSize = static_cast<std::size_t>(kPhases);

  /// What an epoch is before its integers are looked at.
  [[nodiscard]] SolutionStatus status_of_rows(const RtkSolution& out) const {
    if (out.phases > 0) return SolutionStatus::float_;
    if (out.double_differences == 0) return SolutionStatus::dr;
    return is_undifferenced_ ? SolutionStatus::spp : SolutionStatus::dgnss;
  }

  /// A state without GNSS: what leaves the window leaves it without integers, as ever, and those that are held go on shaping the rest.
  void estimate_frame(RtkSolution& out) {
    out.status = SolutionStatus::dr;
    if (is_window_long(out)) {
      smoother_.template set_enabled<gnss::IntegerFix>(false);
      while (is_window_long(out)) marginalise_oldest();
      forget_gone_integers();
    }
    if (!held_.empty()) smoother_.template set_enabled<gnss::IntegerFix>(true);
    if (nodes_.empty() || !optimise(out, options_.frame_iterations)) return recover(out);
    write(out);
    out.held_integers = static_cast<int>(held_.size());
  }

  bool optimise(RtkSolution& out) { return optimise(out, options_.solver.max_iterations); }
  bool optimise(RtkSolution& out, int max_iterations) {
    auto solver = options_.solver;
    solver.max_iterations = max_iterations;
    const auto report = smoother_.optimise(solver);
    out.iterations += report.iterations;
    out.smoother_status = report.status;
    return report.status.ok() || report.status.code == StatusCode::not_converged;
  }

  /// The window could not be solved: it is dropped, the epoch answers from its own start.
  void recover(RtkSolution& out) {
    out.phases = 0;
    out.status = status_of_rows(out);
    set_antenna(nodes_.empty() ? predicted_ : *smoother_.find(nodes_.back().state), antenna_, out);
    const double sigma_m = std::max(5.0, predicted_sigma_m_);
    out.covariance_enu_m2 = Matrix3::Identity() * sigma_m * sigma_m;
    out.velocity_covariance_enu = Matrix3::Identity();
    out.verdict = ambiguity::ResolutionVerdict::ill_conditioned;
    restart();
    doubt_m_ = sigma_m;
  }

  [[nodiscard]] bool is_window_long(const RtkSolution& out) const {
    return static_cast<int>(nodes_.size()) > options_.arc_epochs + 1 && seconds_between(nodes_.front().time, out.time) > options_.lag_s;
  }

  void marginalise_oldest() {
    motion_.before_marginalising(smoother_, nodes_.front().state);
    const auto report = smoother_.marginalise_oldest(options_.solver);
    if (report.status.ok())
      nodes_.erase(0);
    else
      restart();
  }

  /// Covariance of the antenna's position in w, from the window as it was last optimised.
  [[nodiscard]] Matrix3 position_covariance() {
    const auto covariance = smoother_.covariance(nodes_.back().state);
    const StateCovariance P = covariance.ok() ? *covariance : start_covariance();
    return Motion::antenna_covariance(*smoother_.find(nodes_.back().state), P, antenna_).template topLeftCorner<3, 3>();
  }

  /// The float double differences of this epoch with their joint covariance with the position. False when there is nothing to resolve.
  [[nodiscard]] bool collect_float(RtkSolution& out) {
    out.verdict = options_.resolution.mode == ambiguity::ResolutionMode::off ? ambiguity::ResolutionVerdict::off : ambiguity::ResolutionVerdict::too_few;
    float_.n = 0;
    if (differences_.empty() || options_.resolution.mode == ambiguity::ResolutionMode::off) return false;
    keys_.clear();
    (void)keys_.push_back(Smoother::WindowType::any(nodes_.back().state));
    for (std::size_t k = 0; k < differences_.size(); ++k) {
      a_column_[k] = column_of(differences_[k].a);
      b_column_[k] = differences_[k].b.valid() ? column_of(differences_[k].b) : -1;
    }
    const int n = State::dof + static_cast<int>(keys_.size()) - 1;
    const auto size = smoother_.joint_covariance(keys_.data(), static_cast<int>(keys_.size()), joint_.data(), n);
    if (!size.ok()) return false;
    const auto cov = [&](int i, int j) { return j < 0 || i < 0 ? 0.0 : joint_[at(j) * at(n) + at(i)]; };
    float_.n = static_cast<int>(differences_.size());
    // Rotation from the window's axes to East-North-Up at the position is below 1e-5 over 60 m, and gates want no more.
    Eigen::Matrix<Scalar, 3, State::dof> J;  // of the antenna's position by the state
    (void)antenna_.position_w_m(*smoother_.find(nodes_.back().state), &J);
    StateCovariance P;
    for (int a = 0; a < State::dof; ++a)
      for (int b = 0; b < State::dof; ++b) P(a, b) = cov(a, b);
    const Eigen::Matrix<Scalar, 3, State::dof> JP = J.lazyProduct(P);
    float_.Q_pp = JP.lazyProduct(J.transpose());
    for (int i = 0; i < float_.n; ++i) {
      const int ai = a_column_[at(i)], bi = b_column_[at(i)];
      const Difference& d = differences_[at(i)];
      float_.a_cycles[at(i)] = smoother_.find(d.a)->value - (d.b.valid() ? smoother_.find(d.b)->value : 0.0);
      Eigen::Matrix<Scalar, State::dof, 1> c;
      for (int axis = 0; axis < State::dof; ++axis) c[axis] = cov(axis, ai) - cov(axis, bi);
      float_.Q_pa[at(i)] = J.lazyProduct(c);
      for (int j = 0; j <= i; ++j) {
        const int aj = a_column_[at(j)], bj = b_column_[at(j)];
        const double q = cov(ai, aj) - cov(ai, bj) - cov(bi, aj) + cov(bi, bj);
        float_.Q_aa[at(i) * kPhasesSize + at(j)] = float_.Q_aa[at(j) * kPhasesSize + at(i)] = q;
      }
    }
    return true;
  }

  /// Column of an ambiguity in the joint covariance; it is added to the keys when it is new.
  [[nodiscard]] int column_of(const AmbiguityKey& key) {
    const smoother::AnyKey any = Smoother::WindowType::any(key);
    for (std::size_t k = 1; k < keys_.size(); ++k)
      if (keys_[k] == any) return State::dof - 1 + static_cast<int>(k);
    (void)keys_.push_back(any);
    return State::dof - 1 + static_cast<int>(keys_.size()) - 1;
  }

  void resolve(RtkSolution& out, StaticVector<smoother::Key<gnss::IntegerFix>, kPhasesSize>& fresh) {
    resolver_.resolve(float_, options_.resolution, outcome_);
    out.verdict = outcome_.verdict, out.success_rate = outcome_.success_rate, out.ratio = outcome_.ratio, out.innovation_enu_m = outcome_.innovation_m;
    if (!outcome_.accepted()) return;
    if (!agrees_with_prediction()) {  // new or held integers are wrong: neither are believed
      out.verdict = ambiguity::ResolutionVerdict::innovation;
      out.released_integers += static_cast<int>(held_.size());
      release_all();
      return;
    }
    for (int i = 0; i < float_.n; ++i) {
      if (!outcome_.fixed[at(i)]) continue;
      const Difference& d = differences_[at(i)];
      release_if([&](const Held& h) { return h.difference.a == d.a; }, out, false);  // one constraint a state
      const auto key = add(gnss::IntegerFix{d.a, d.b, static_cast<double>(outcome_.integers[at(i)]), options_.fix_sigma_cycles}, out);
      if (!key.valid()) continue;
      (void)held_.push_back({key, d, outcome_.integers[at(i)]});
      (void)fresh.push_back(key);
      ++out.fixed_phases;
    }
  }

  [[nodiscard]] bool agrees_with_prediction() const {
    if (!is_predicted_) return true;
    const State& x = *smoother_.find(nodes_.back().state);
    const auto P = Motion::antenna_covariance(predicted_, predicted_covariance_, antenna_);
    return motion_.agrees(antenna_.position_w_m(x) + outcome_.innovation_m, outcome_.covariance_m2, antenna_.position_w_m(predicted_),
                          P.template topLeftCorner<3, 3>());
  }

  /// Takes out integers of earlier epochs that the float without them contradicts.
  void release_contradicted(RtkSolution& out) {
    for (std::size_t i = 0; i < held_.size();) {
      const Held h = held_[i];
      bool contradicted = false;
      for (int k = 0; k < float_.n; ++k) {
        const Difference& d = differences_[at(k)];
        if (!(d.a == h.difference.a) || !(d.b == h.difference.b)) continue;
        const double sigma = std::sqrt(std::max(1e-6, float_.Q_aa[at(k) * kPhasesSize + at(k)]));
        contradicted = std::abs(float_.a_cycles[at(k)] - static_cast<double>(h.integer)) > options_.release_sigmas * sigma;
      }
      if (!contradicted) {
        ++i;
        continue;
      }
      (void)smoother_.remove_factor(h.factor);
      continuation_.forget(h.difference.arc);
      held_.erase(i);
      ++out.released_integers;
    }
  }

  template <class Predicate>
  void release_if(Predicate gone, RtkSolution& out, bool count) {
    held_.erase_if([&](const Held& h) {
      if (!gone(h)) return false;
      (void)smoother_.remove_factor(h.factor);
      out.released_integers += count ? 1 : 0;
      return true;
    });
  }
  void release_all() {
    for (const Held& h : held_) (void)smoother_.remove_factor(h.factor);
    held_.clear();
  }
  void forget_gone_integers() {
    held_.erase_if([this](const Held& h) { return smoother_.find_factor(h.factor) == nullptr; });
  }

  /// Whether the re-optimised window fights the integers: too many phases of this epoch would lose their weight even if phases were as noisy as the
  /// adaptation allows.
  [[nodiscard]] bool is_suspect() {
    const double used = std::sqrt(phase_variance_factor_), noisiest = options_.phase_noise.on ? std::max(used, options_.phase_noise.max_scale) : used;
    int low = 0, all = 0;
    for (const auto& key : phase_keys_) {
      const double* e = smoother_.whitened_rows(key);
      if (!e) continue;
      const auto* f = smoother_.find_factor(key);
      std::array<double, static_cast<std::size_t>(Problem::PhaseFactor::max_rows)> rows{}, w{};
      for (int i = 0; i < f->rows(); ++i) rows[at(i)] = e[i] * used / noisiest;
      (void)f->weigh(rows.data(), w.data());
      for (int i = 0; i < f->size(); ++i) ++all, low += w[at(i)] < 0.5 ? 1 : 0;
    }
    return all > 0 && low > options_.max_suspect_share * all;
  }

  void take_back(const StaticVector<smoother::Key<gnss::IntegerFix>, kPhasesSize>& fresh, RtkSolution& out) {
    release_if([&](const Held& h) { return std::find(fresh.begin(), fresh.end(), h.factor) != fresh.end(); }, out, true);
    out.verdict = ambiguity::ResolutionVerdict::contradiction;
    out.fixed_phases = 0;
    (void)optimise(out);
  }

  void set_antenna(const State& x, const typename Motion::Antenna& antenna, RtkSolution& out) const {
    out.position_e_m = frame_.to_ecef(antenna.position_w_m(x));
    out.velocity_e_mps = frame_.R_ew * antenna.velocity_w_mps(x);
  }

  /// Axes of w to East-North-Up at a position.
  [[nodiscard]] Matrix3 enu_from_local(const Vector3& position_e_m) const {
    return geodesy::ecef_from_enu(geodesy::geodetic_from_ecef(position_e_m)).transpose() * frame_.R_ew;
  }

  /// Antenna, covariances and attitude of a state.
  void describe(const State& x, const StateCovariance& P, const typename Motion::Antenna& antenna, RtkSolution& out) const {
    set_antenna(x, antenna, out);
    const Matrix3 R = enu_from_local(out.position_e_m);
    const auto C = Motion::antenna_covariance(x, P, antenna);
    out.covariance_enu_m2 = R * C.template topLeftCorner<3, 3>() * R.transpose();
    out.velocity_covariance_enu = R * C.template bottomRightCorner<3, 3>() * R.transpose();
    motion_.describe(x, P, R, out);
  }

  void write(RtkSolution& out) {
    const State& x = *smoother_.find(nodes_.back().state);
    const auto covariance = smoother_.covariance(nodes_.back().state);
    const StateCovariance P = covariance.ok() ? *covariance : start_covariance();
    describe(x, P, antenna_, out);
    if constexpr (Motion::has_camera) out.tracks = motion_.frame_report().admitted, motion_.remember(smoother_);
    if (!held_.empty()) doubt_integers(out);
    settle(x, P, nodes_.back().time, held_.empty());
    nodes_.back().status = out.status;
    out.code_weight = mean_weight(code_keys_);
    out.phase_weight = mean_weight(phase_keys_);
  }

  /// See the file comment. The float is that of this epoch, with the integers switched off; frames go on with the last epoch's.
  void doubt_integers(RtkSolution& out) {
    const Matrix3 R = enu_from_local(out.position_e_m);
    if (out.source != SolutionSource::camera) doubt_enu_m2_ = (1 - integer_trust_) * (R * float_.Q_pp * R.transpose() - out.covariance_enu_m2);
    out.covariance_enu_m2 += doubt_enu_m2_;
  }

  template <class Keys>
  [[nodiscard]] double mean_weight(const Keys& keys) {
    double sum = 0;
    int n = 0;
    for (const auto& key : keys) {
      const double* w = smoother_.weights(key);
      const auto* f = smoother_.find_factor(key);
      for (int i = 0; w && i < f->size(); ++i) sum += w[i] / f->information_share, ++n;
    }
    return n > 0 ? sum / n : 0;
  }

  /// A window whose codes mostly disagree with it, epoch after epoch, has drifted away: the next epoch starts anew.
  void watch_divergence(RtkSolution& out) {
    suspect_epochs_ = out.code_weight < 0.3 && !code_keys_.empty() ? suspect_epochs_ + 1 : 0;
    if (suspect_epochs_ < options_.min_suspect_epochs) return;
    restart();
    doubt_m_ = 30;
  }

  /// Drops the window. Ephemerides, base and slip detection stay.
  void restart() {
    smoother_.clear();
    nodes_.clear(), held_.clear(), code_keys_.clear(), phase_keys_.clear(), differences_.clear();
    continuation_.clear();
    suspect_epochs_ = 0, has_epoch_ = false;
    if (!Motion::is_inertial) has_state_ = false;
  }

  RtkOptions options_;
  CodePhaseForm code_phase_form_;
  DopplerForm doppler_form_;
  Motion motion_;
  math::Deferred<gnss::SinglePointTracker, Config> tracker_;
  gnss::EphemerisStore<Cap::ephemerides> ephemerides_{};
  gnss::BaseBuffer<Cap::base_epochs> base_{};
  gnss::Differencer differencer_{};
  gnss::DifferencedEpoch epoch_{};
  gnss::TrackedPosition tracked_{};  ///< of the epoch at hand
  gnss::SinglePointSolution undifferenced_codes_{};  ///< room to work in
  Smoother smoother_{};
  ambiguity::Continuation<AmbiguityKey, 2 * kPhasesSize> continuation_{};
  ambiguity::Resolver<kPhases> resolver_{};
  ambiguity::FloatAmbiguities<kPhases> float_{};
  ambiguity::ResolutionOutcome<kPhases> outcome_{};
  LocalFrame frame_{};
  StaticVector<Node, static_cast<std::size_t>(Cap::states)> nodes_{};
  StaticVector<Held, static_cast<std::size_t>(Cap::fixes)> held_{};
  StaticVector<Difference, kPhasesSize> differences_{};
  StaticVector<bool, gnss::kMaxCorrectedSignals> phase_usable_{};  ///< by signal
  StaticVector<bool, gnss::kMaxCorrectedSignals> code_usable_{};   ///< by candidate of the group at hand
  StaticVector<smoother::Key<typename Problem::CodeFactor>, gnss::kMaxSignalGroups> code_keys_{};
  StaticVector<smoother::Key<typename Problem::PhaseFactor>, gnss::kMaxSignalGroups> phase_keys_{};
  StaticVector<smoother::AnyKey, 2 * kPhasesSize + 1> keys_{};
  std::array<int, kPhasesSize> a_column_{}, b_column_{};
  std::array<double, (2 * kPhasesSize + State::dof) * (2 * kPhasesSize + State::dof)> joint_{};
  Snapshot<2 * gnss::kMaxCorrectedSignals> snapshot_{};
  Vector3 predicted_e_m_{Vector3::Zero()}, predicted_v_e_mps_{Vector3::Zero()};
  double predicted_sigma_m_{100}, clock_offset_s_{0};
  Matrix3 predicted_position_m2_{Matrix3::Identity()};  ///< of the predicted antenna, in w
  Compared compared_{};
  State predicted_{}, last_state_{};  ///< of the epoch at hand by the motion alone; the newest estimate
  StateCovariance predicted_covariance_{StateCovariance::Identity()}, last_covariance_{StateCovariance::Identity()};
  typename Motion::Antenna antenna_{};  ///< at the epoch at hand
  GpsTime last_time_{};
  bool is_predicted_{false}, has_state_{false};
  bool is_undifferenced_{false};  ///< the codes of the epoch at hand are the rover's alone
  double integer_trust_{1};  ///< probability that the integers accepted last are right
  Matrix3 doubt_enu_m2_{Matrix3::Zero()};  ///< what that adds to the covariance of the position
  GpsTime last_epoch_time_{};  ///< of the last state with codes in this window
  bool has_epoch_{false}, stationary_{false};
  double doubt_m_{0};  ///< sigma that the next window's start is widened by
  GpsTime last_tag_{};
  bool started_{false};
  int suspect_epochs_{0};
  NoiseScale<2 * gnss::kMaxCorrectedSignals> code_noise_{}, phase_noise_{};
  double code_variance_factor_{1}, phase_variance_factor_{1};  ///< of the epoch that is being added
  double code_information_share_{1};
};

// ---- the interface: outside the class, so that a file that sees it declared `extern template` does not instantiate it and all below it -------------------

template <class Config>
RtkEstimator<Config>::RtkEstimator(const RtkOptions& options, const CodePhaseForm& code_phase, const DopplerForm& doppler, const typename Motion::Options& motion)
    : options_(options), code_phase_form_(code_phase), doppler_form_(doppler), motion_(options, motion), tracker_(options.tracker) {
  continuation_.mode = options.continuity;
  continuation_.max_arc_epochs = options.arc_epochs;
  if (is_instantaneous()) return;
  options_.code_noise.min_scale = std::max(1.0, options.code_noise.min_scale);
  options_.phase_noise.min_scale = std::max(1.0, options.phase_noise.min_scale);
}

template <class Config>
Status RtkEstimator<Config>::add_ephemeris(const gnss::Ephemeris& e) {
  return ephemerides_.insert(e) ? ok_status() : failure(StatusCode::capacity_exceeded, "the ephemeris store is full: raise Capacity::ephemerides");
}

template <class Config>
Status RtkEstimator<Config>::set_base_position(const Eigen::Vector3d& position_e_m) { return base_.set_position(position_e_m); }

template <class Config>
Status RtkEstimator<Config>::add_base(const gnss::ObservationEpoch& epoch) { return base_.push(epoch); }

template <class Config>
Result<RtkSolution> RtkEstimator<Config>::update(const gnss::ObservationEpoch& rover) {
  if (started_ && rover.tag <= last_tag_)
    return failure(rover.tag == last_tag_ ? StatusCode::duplicate : StatusCode::out_of_order, "rover epoch not after the last one", -1, -1, seconds_between(last_tag_, rover.tag));
  const Status found = tracker_.update(rover, ephemerides_, tracked_);
  if (!found.ok() && !has_state_) return found;
  const gnss::TrackedPosition* const tracked = found.ok() ? &tracked_ : nullptr;
  RtkSolution out = begin(rover, tracked);
  started_ = true, last_tag_ = rover.tag;
  const Status differenced = difference(rover, tracked, out);
  const bool is_differenced = differenced.ok() && epoch_.satellites >= options_.min_satellites;
  is_undifferenced_ = false;
  if (!is_differenced) continuation_.skip_epoch();
  if (!is_differenced && goes_on_without_gnss()) without_base(rover);
  const bool is_extended = (is_differenced || goes_on_without_gnss()) && extend(out);
  if (is_extended)
    estimate(out);
  else
    without_differences(tracked, out);
  if (differenced.ok()) compared_ = Compared{out.time, out.position_e_m, is_extended};
  return out;
}

template <class Config>
Result<RtkSolution> RtkEstimator<Config>::advance(GpsTime time) {
  return advance_with(time, SolutionSource::readings, [](smoother::Key<State>, RtkSolution&) { return ok_status(); });
}

template <class Config>
void RtkEstimator<Config>::begin_at(const State& state, const StateCovariance& covariance, GpsTime time, const LocalFrame& frame) {
  restart();
  frame_ = frame;
  motion_.set_frame(frame);
  settle(state, covariance, time, true);
}

template <class Config>
auto RtkEstimator<Config>::oldest() const -> Result<LaggedState> {
  if (!window_running()) return failure(StatusCode::no_data, "no window is running");
  const Node& n = nodes_.front();
  return LaggedState{n.time, frame_.to_ecef(n.antenna.position_w_m(*smoother_.find(n.state))), n.status};
}

}  // namespace searvins::estimator
