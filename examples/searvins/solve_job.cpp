// SPDX-License-Identifier: BSD-3-Clause
// Runs an estimator over a recording and keeps what trajectory, summary and report need.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <deque>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <searvins/estimator/camera_predictor.hpp>
#include <searvins/geodesy/wgs84.hpp>
#include <searvins/imu/attitude_angles.hpp>
#include <searvins/io/rinex_observation.hpp>
#include <searvins/io/text_fields.hpp>

#include "examples/searvins/solve_job.hpp"
#include "examples/searvins/track_frames.hpp"
#include "examples/support/angle_units.hpp"
#include "examples/support/frame_strip.hpp"
#include "examples/support/progress.hpp"

namespace searvins::examples {
namespace {

constexpr std::int64_t kBaseLeadNs = 20'000'000;  ///< base tags may lie this much after the rover's: both clocks are off by up to 10 ms
constexpr double kSkyStepS = 5;                   ///< between two points of a satellite's path in the report
constexpr double kEndS = 10;                      ///< a run whose last GNSS solution is older than this at the end has ended without one

double milliseconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

io::SolutionStatus row_status(estimator::SolutionStatus s) { return static_cast<io::SolutionStatus>(s); }
static_assert(static_cast<int>(io::SolutionStatus::spp) == static_cast<int>(estimator::SolutionStatus::spp) &&
              static_cast<int>(io::SolutionStatus::dr) == static_cast<int>(estimator::SolutionStatus::dr));

bool was_searched(ambiguity::ResolutionVerdict v) {
  using enum ambiguity::ResolutionVerdict;
  return v != off && v != too_few && v != ill_conditioned;
}

io::TrajectoryRow row_of(const estimator::RtkSolution& s, double solve_ms) {
  io::TrajectoryRow row;
  row.time = s.time;
  row.p_e_m = s.position_e_m;
  row.status = row_status(s.status);
  row.set_covariance_enu_m2(s.covariance_enu_m2);
  row.v_enu_mps = geodesy::ecef_from_enu(geodesy::geodetic_from_ecef(s.position_e_m)).transpose() * s.velocity_e_mps;
  row.n_sat = s.satellites, row.n_dd = s.double_differences;
  if (s.has_attitude) row.n_tracks = s.tracks;
  if (was_searched(s.verdict)) row.success_rate = s.success_rate;
  row.solve_ms = solve_ms;
  if (s.has_attitude) {
    const imu::AttitudeAngles a = imu::attitude_angles(s.R_nb);
    row.roll_deg = a.roll_rad * kDegPerRad, row.pitch_deg = a.pitch_rad * kDegPerRad;
    row.heading_deg = a.heading_rad * kDegPerRad + (a.heading_rad < 0 ? 360 : 0);
  }
  return row;
}

/// Velocity, attitude and biases, with sigmas. Those of roll and pitch are the sigmas of the turns about the forward and the right axis.
void take_motion(const estimator::RtkSolution& s, ReportEpoch& epoch) {
  epoch.sd_velocity_enu_mps = s.velocity_covariance_enu.diagonal().cwiseMax(0.0).cwiseSqrt();
  if (!s.has_attitude) return;
  const double heading = imu::heading_of(s.R_nb), east = std::sin(heading), north = std::cos(heading);
  const Eigen::Vector3d sd_deg = s.attitude_sigma_rad * kDegPerRad;
  epoch.sd_attitude_deg = {std::hypot(east * sd_deg.x(), north * sd_deg.y()), std::hypot(north * sd_deg.x(), east * sd_deg.y()), sd_deg.z()};
  epoch.accel_bias_mps2 = s.accel_bias_b_mps2, epoch.gyro_bias_dps = s.gyro_bias_b_radps * kDegPerRad;
}

const char* name_of(gnss::CodeFate fate) {
  constexpr const char* names[] = {"used", "no code", "low C/N0", "no ephemeris", "low elevation", "outlier"};
  return names[static_cast<std::size_t>(fate)];
}
constexpr std::size_t kCodeFates = 6;

/// Collects the diagnostics of the epochs.
class Collector {
 public:
  /// `differences`: the estimator screens signals as differencing does, be it without a base.
  Collector(SolveOutcome& out, bool with_base, bool differences) : out_(out), with_base_(with_base), differences_(differences) {
    if (differences) {
      for (std::size_t r = 0; r < gnss::kRejections; ++r)
        out.rejection_reasons.emplace_back(gnss::name_of(static_cast<gnss::Rejection>(r)));
      out.fix_outcomes.emplace_back("fixed");
      for (int v = 1; v <= static_cast<int>(ambiguity::ResolutionVerdict::contradiction); ++v)
        out.fix_outcomes.emplace_back(ambiguity::name_of(static_cast<ambiguity::ResolutionVerdict>(v)));
    } else {
      for (std::size_t f = 1; f < kCodeFates; ++f) out.rejection_reasons.emplace_back(name_of(static_cast<gnss::CodeFate>(f)));
    }
  }

  /// `satellites_seen`: -1 for a solution without a rover epoch.
  void take(const estimator::RtkSolution& s, int satellites_seen, const SolverRun& run, double solve_ms) {
    out_.rows.push_back(row_of(s, solve_ms));
    const gnss::DifferencedEpoch* differenced = run.differenced();
    if (differenced && differenced->rover_tag != s.tag) differenced = nullptr;
    ReportEpoch& epoch = out_.epochs.emplace_back();
    epoch.satellites_seen = satellites_seen, epoch.satellites_used = s.satellites;
    take_motion(s, epoch);
    epoch.rejected.assign(out_.rejection_reasons.size(), 0);
    epoch.base_age_s = s.base_age_s;
    if (differenced && differences_)
      take_differences(*differenced, s, epoch);
    else
      take_codes(run.single_point(), epoch);
    out_.ratios.push_back(epoch.ratio), out_.ages_s.push_back(epoch.base_age_s);
    out_.released_integers += s.released_integers;
    out_.restarts += s.restarted && out_.rows.size() > 1;
    if (!s.smoother_status.ok()) add_count(out_.incidents, std::string{"optimisation: "} + s.smoother_status.what);
    if (s.in_lane) add_count(out_.incidents, "held in a lane of the map");
    if (satellites_seen < 0)
      add_count(out_.incidents, "no rover epoch: carried on by the inertial unit");
    else if (with_base_)
      take_missing_differences(s, differenced);
    if (out_.rows.size() == 1 || seconds_between(last_sky_, s.tag) >= kSkyStepS) take_sky(run.single_point(), differenced, s.tag);
  }

  /// The oldest state of the window is written when it is about to be replaced: that is when it has seen the whole lag.
  void take_lagged(const std::optional<LaggedEstimate>& oldest) {
    if (pending_ && (!oldest || oldest->time != pending_->time)) {
      io::TrajectoryRow row;
      row.time = pending_->time, row.p_e_m = pending_->position_e_m, row.status = row_status(pending_->status);
      if (out_.lagged_rows.empty() || out_.lagged_rows.back().time < row.time) out_.lagged_rows.push_back(row);
    }
    pending_ = oldest;
  }

  /// Satellite paths by name, and the empty reasons dropped.
  void finish() {
    for (auto& [name, satellite] : sky_) out_.satellites.push_back(std::move(satellite));
    for (std::size_t r = out_.rejection_reasons.size(); r-- > 0;) {
      if (std::any_of(out_.epochs.begin(), out_.epochs.end(), [r](const ReportEpoch& e) { return e.rejected[r] > 0; })) continue;
      out_.rejection_reasons.erase(out_.rejection_reasons.begin() + static_cast<std::ptrdiff_t>(r));
      for (ReportEpoch& e : out_.epochs) e.rejected.erase(e.rejected.begin() + static_cast<std::ptrdiff_t>(r));
    }
  }

 private:
  /// Counts an epoch that the base said nothing of, and why.
  void take_missing_differences(const estimator::RtkSolution& s, const gnss::DifferencedEpoch* differenced) {
    if (differenced && !differenced->base_status.ok())
      add_count(out_.incidents, std::string{"no differences: "} + differenced->base_status.what);
    else if (s.status == estimator::SolutionStatus::spp || s.status == estimator::SolutionStatus::dr)
      add_count(out_.incidents, "no differences: too few satellites in common with the base");
  }
  void take_differences(const gnss::DifferencedEpoch& d, const estimator::RtkSolution& s, ReportEpoch& epoch) const {
    for (std::size_t r = 0; r < gnss::kRejections; ++r) epoch.rejected[r] = d.rejected[r];
    double sum = 0;
    int n = 0;
    for (const gnss::CorrectedSignal& c : d.signals)
      if (std::isfinite(c.cn0_dbhz)) sum += c.cn0_dbhz, ++n;
    if (n > 0) epoch.mean_cn0_dbhz = sum / n;
    if (s.double_differences > 0) epoch.weight_code = s.code_weight, epoch.weight_phase = s.phases > 0 ? s.phase_weight : io::kUnknown;
    epoch.fix_outcome = static_cast<int>(s.verdict);
    if (was_searched(s.verdict) && s.ratio > 0) epoch.ratio = s.ratio;
  }

  void take_codes(const gnss::SinglePointSolution& s, ReportEpoch& epoch) const {
    double sum = 0;
    int n = 0;
    for (const gnss::CodeRow& row : s.rows) {
      if (row.fate == gnss::CodeFate::used && std::isfinite(row.cn0_dbhz)) sum += row.cn0_dbhz, ++n;
      if (row.fate != gnss::CodeFate::used && !differences_) ++epoch.rejected[static_cast<std::size_t>(row.fate) - 1];
    }
    if (n > 0) epoch.mean_cn0_dbhz = sum / n;
  }

  /// A point of every satellite whose direction is known.
  void take_sky(const gnss::SinglePointSolution& s, const gnss::DifferencedEpoch* d, GpsTime tag) {
    last_sky_ = tag;
    for (const gnss::CodeRow& row : s.rows) {
      if (row.elevation_rad <= 0) continue;
      double rejected = row.fate == gnss::CodeFate::used ? 0 : 1, used = 1 - rejected;
      if (d) {
        const auto is_of = [&row](const auto& x) { return x.satellite == row.satellite; };
        rejected = static_cast<double>(std::count_if(d->rejections.begin(), d->rejections.end(), is_of));
        used = static_cast<double>(std::count_if(d->signals.begin(), d->signals.end(), is_of));
      }
      char name[8];
      std::snprintf(name, sizeof name, "%c%02d", gnss::letter_of(row.satellite.constellation), static_cast<int>(row.satellite.number));
      ReportSatellite& satellite = sky_[name];
      satellite.name = name;
      const double share = rejected + used > 0 ? std::min(1.0, rejected / (rejected + used)) : 1;
      satellite.points.push_back({row.azimuth_rad * kDegPerRad, row.elevation_rad * kDegPerRad, row.cn0_dbhz, share});
    }
  }

  SolveOutcome& out_;
  bool with_base_, differences_;
  std::map<std::string, ReportSatellite> sky_;
  GpsTime last_sky_{};
  std::optional<LaggedEstimate> pending_;
};

/// Hands the base epochs over up to a rover tag.
class BaseFeed {
 public:
  io::FileResult<bool> open(const std::string& path) {
    if (path.empty()) return true;
    if (!reader_.open(path)) return *reader_.error();
    more_ = reader_.next(epoch_);
    return true;
  }
  void feed(GpsTime rover_tag, SolverRun& run, SolveOutcome& out) {
    while (more_ && epoch_.tag.ns <= rover_tag.ns + kBaseLeadNs) {
      const Status s = run.add_base(epoch_);
      if (!s.ok()) add_count(out.incidents, std::string{"base epoch: "} + s.what);
      more_ = reader_.next(epoch_);
    }
  }

 private:
  io::RinexObservationReader reader_;
  gnss::ObservationEpoch epoch_;
  bool more_{false};
};

/// Follows the alignment of the inertial unit.
class AlignmentWatch {
 public:
  AlignmentWatch(GpsTime start, SolveOutcome& out) : since_(start), out_(out) {}
  void take(const SolverRun& run, GpsTime time) {
    const std::optional<AlignmentReport> now = run.alignment();
    if (!now) return;
    if (!now->aligned) add_count(out_.alignment_waits, now->waits_for);
    if (now->aligned == aligned_ && now->alignments == alignments_) return;
    aligned_ = now->aligned, alignments_ = now->alignments;
    out_.alignment.push_back({time, aligned_, seconds_between(since_, time)});
    since_ = time;
  }

 private:
  GpsTime since_;
  SolveOutcome& out_;
  bool aligned_{false};
  int alignments_{0};
};

/// Stretches without GNSS: two or more rows of dead reckoning, or a time without rows.
std::vector<Outage> outages_of(const SolveInputs& in, const std::vector<io::TrajectoryRow>& rows) {
  std::vector<Outage> outages;
  const double step_s = in.interval_s > 0 ? in.interval_s : 1;
  std::size_t last = 0;  // the last row with GNSS
  const auto has_gnss = [&rows](std::size_t i) { return rows[i].status != io::SolutionStatus::dr; };
  for (std::size_t i = 1; i < rows.size(); ++i) {
    const bool at_end = i + 1 == rows.size();
    if (!has_gnss(i) && !at_end) continue;
    if (seconds_between(rows[last].time, rows[i].time) > 2.5 * step_s) {
      Outage& outage = outages.emplace_back();
      outage.from = rows[last].time, outage.to = rows[i].time;
      const std::size_t worst = has_gnss(i) ? i - 1 : i;
      if (worst > last && !has_gnss(worst)) {
        const io::TrajectoryRow& row = rows[worst];
        outage.sigma_m = std::hypot(row.sd_enu_m.x(), row.sd_enu_m.y());
        ScoredEpoch scored;
        if (in.truth) detail::score_row(row, *in.truth, {}, scored);
        if (scored.has_error()) outage.horizontal_error_m = scored.horizontal_m();
      }
    }
    last = i;
  }
  return outages;
}

/// Scores the run over the part of the recording that was solved.
void score(const SolveRequest& request, const SolveInputs& in, SolveOutcome& out) {
  if (!in.truth || out.rows.empty()) return;
  EvaluationOptions rules;
  rules.step_s = std::max(1.0, std::round(in.interval_s));
  const GpsTime reference = in.truth->is_static ? out.rows.front().time : in.truth->points.front().time;
  const GpsTime week_start = GpsTime::from_week_sow(reference.week(), 0);
  rules.start_sow = seconds_between(week_start, in.start) - (in.truth->is_static ? 0 : 0.02);
  rules.end_sow = seconds_between(week_start, in.end) + (in.truth->is_static ? 0 : 0.02);
  io::FileResult<Evaluation> evaluation = evaluate(*in.truth, out.rows, rules);
  if (evaluation)
    out.evaluation = std::move(evaluation).value();
  else
    add_count(out.incidents, (request.truth.empty() ? "--truth-ecef" : request.truth) + ": " + evaluation.error().message);
}

/// Takes the solutions that are due, and knows which rover epochs are still without one.
class Drain {
 public:
  Drain(const SolveInputs& in, bool at_camera_rate, SolverRun& run, SolveOutcome& out)
      : in_(in), run_(run), out_(out), collector_(out, in.base.has_value(), in.base || (in.inertial && in.positions.empty())), watch_(in.start, out), at_camera_rate_(at_camera_rate) {}

  void add_rover(const gnss::ObservationEpoch& epoch) {
    ++out_.rover_epochs;
    const Status s = run_.add_rover(epoch);
    if (s.ok())
      waiting_.push_back({epoch.tag, static_cast<int>(epoch.satellites.size())});
    else
      add_count(out_.skipped, s.what);
  }

  void add_position(const imu::PositionFix& fix) {
    ++out_.rover_epochs;
    const Status s = run_.add_position(fix);
    if (s.ok())
      waiting_.push_back({fix.time, std::max(0, fix.satellites)});
    else
      add_count(out_.skipped, s.what);
  }

  /// `after` is called after every answer.
  template <class After>
  void take_due(const After& after) {
    for (;;) {
      const auto before = std::chrono::steady_clock::now();
      const Result<estimator::RtkSolution> solution = run_.next();
      const double solve_ms = milliseconds_since(before);
      after();
      if (solution.ok()) {
        take(*solution, solve_ms);
      } else {
        if (estimator::is_nothing_due(solution.status()) || waiting_.empty()) return;
        add_count(out_.skipped, solution.status().what);
        watch_.take(run_, waiting_.front().tag);
        waiting_.pop_front();
      }
      collector_.take_lagged(run_.oldest());
    }
  }

  void take_predicted(GpsTime time) {
    const Result<estimator::RtkSolution> predicted = run_.predict(time);
    if (!predicted.ok() || !predicted->position_e_m.allFinite()) return;
    out_.predicted_rows.push_back(row_of(*predicted, io::kUnknown));
    out_.predicted_rows.back().success_rate = io::kUnknown;  // that of the solution it goes on from
  }

  void finish() {
    collector_.take_lagged(std::nullopt);
    collector_.finish();
  }

  [[nodiscard]] std::string progress_note() const {
    return std::to_string(out_.rover_epochs) + " epochs, " + std::to_string(fixed_) + " fixed";
  }

 private:
  struct Waiting {
    GpsTime tag{};
    int satellites{0};
  };

  void take(const estimator::RtkSolution& s, double solve_ms) {
    int satellites_seen = -1;
    while (!waiting_.empty() && waiting_.front().tag <= s.tag) {
      if (waiting_.front().tag == s.tag) satellites_seen = waiting_.front().satellites;
      waiting_.pop_front();
    }
    if (s.source == estimator::SolutionSource::camera && !is_row_of_frame(s)) return;
    if (!s.position_e_m.allFinite() || (!out_.rows.empty() && s.time <= out_.rows.back().time)) {
      add_count(out_.skipped, s.position_e_m.allFinite() ? "time of the state does not rise" : "position is not finite");
      return;
    }
    collector_.take(s, satellites_seen, run_, solve_ms);
    watch_.take(run_, s.time);
    out_.answered_epochs += satellites_seen >= 0;
    fixed_ += s.status == estimator::SolutionStatus::fix;
    if (s.status != estimator::SolutionStatus::dr || s.has_attitude)
      out_.solved_at_end = seconds_between(s.tag, in_.end) <= std::max(kEndS, 3 * in_.interval_s);
  }

  /// Frames are rows at their own rate, or where nothing else has been for a second.
  [[nodiscard]] bool is_row_of_frame(const estimator::RtkSolution& s) const {
    constexpr double kSilenceS = 0.999;
    const double since_s = out_.rows.empty() ? 0 : seconds_between(out_.rows.back().time, s.time);
    return at_camera_rate_ ? since_s > 5e-4 : since_s > kSilenceS;
  }

  const SolveInputs& in_;
  SolverRun& run_;
  SolveOutcome& out_;
  Collector collector_;
  AlignmentWatch watch_;
  std::deque<Waiting> waiting_;
  bool at_camera_rate_;
  long fixed_{0};
};

/// Predicted rows that lie on a solution, or at its time within half a millisecond, give way to it.
void drop_predictions_at_solutions(SolveOutcome& out) {
  constexpr double kSameS = 5e-4;
  const auto is_at_solution = [&out](const io::TrajectoryRow& p) {
    const auto is_before = [](const io::TrajectoryRow& r, GpsTime t) { return r.time < t; };
    const auto at = std::lower_bound(out.rows.begin(), out.rows.end(), p.time, is_before);
    return (at != out.rows.end() && seconds_between(p.time, at->time) < kSameS) ||
           (at != out.rows.begin() && seconds_between((at - 1)->time, p.time) < kSameS);
  };
  out.predicted_rows.erase(std::remove_if(out.predicted_rows.begin(), out.predicted_rows.end(), is_at_solution), out.predicted_rows.end());
}

/// Rover epochs with the base's, or another program's positions, one after the other.
class MeasurementFeed {
 public:
  MeasurementFeed(const SolveInputs& in, SolverRun& run, SolveOutcome& out) : in_(in), run_(run), out_(out) {}

  /// Opens the files and reads the first epoch of the time to solve.
  io::FileResult<bool> open(const SolveRequest& request) {
    if (!in_.positions.empty()) return true;
    if (!rover_.open(request.rover)) return *rover_.error();
    if (const io::FileResult<bool> opened = base_.open(request.base); !opened) return opened.error();
    read_epoch();
    return true;
  }
  [[nodiscard]] bool has_more() const { return in_.positions.empty() ? has_epoch_ : position_ < in_.positions.size(); }
  [[nodiscard]] GpsTime time() const { return in_.positions.empty() ? epoch_.tag : in_.positions[position_].time; }
  /// Hands the next one over.
  void hand_over(Drain& drain) {
    if (!in_.positions.empty()) return drain.add_position(in_.positions[position_++]);
    base_.feed(epoch_.tag, run_, out_);
    drain.add_rover(epoch_);
    read_epoch();
  }

 private:
  void read_epoch() {
    do has_epoch_ = rover_.next(epoch_);
    while (has_epoch_ && epoch_.tag < in_.start);
    has_epoch_ = has_epoch_ && epoch_.tag <= in_.end;
  }

  const SolveInputs& in_;
  SolverRun& run_;
  SolveOutcome& out_;
  io::RinexObservationReader rover_;
  BaseFeed base_;
  gnss::ObservationEpoch epoch_{};
  std::size_t position_{0};
  bool has_epoch_{false};
};

/// Hands frames over, from wherever they come.
class FrameFeed {
 public:
  FrameFeed(const SolveInputs& in, SolverRun& run, SolveOutcome& out) : run_(run), out_(out), strip_(in.start, in.end) {
    if (in.inertial) predictor_.emplace(in.inertial->stereo.camera, in.inertial->lever_arm_b_m);
  }

  /// Opens tracks or pictures, if there are any.
  io::FileResult<bool> open(const SolveRequest& request, const SolveInputs& in) {
    if (!request.tracks.empty()) {
      auto tracks = TrackFrames::open(request.tracks, in.start);
      if (!tracks) return tracks.error();
      source_ = std::move(tracks).value();
    } else if (!request.images.empty()) {
      auto images = ImageFrames::open(request.images, in.image_options);
      if (!images) return images.error();
      (*images)->start_at(in.start);
      source_ = std::move(images).value();
    }
    return true;
  }
  /// Hands over the frames up to a time that readings have reached. Errors: a row that cannot be read.
  io::FileResult<bool> feed(GpsTime until) {
    while (const std::optional<GpsTime> time = source_ ? source_->time() : std::nullopt) {
      if (*time > until) break;
      const Result<estimator::RtkSolution> predicted = run_.predict(*time);
      const auto motion = predictor_->motion_to(predicted.ok() ? std::optional{*predicted} : std::nullopt);
      ++out_.frames;
      const io::FileResult<bool> taken = source_->take(motion, *frame_);
      if (!taken) return taken.error();
      if (!*taken) continue;
      strip_.offer(frame_->time, source_->picture(), *frame_);
      if (const Status s = run_.add_stereo(*frame_); !s.ok()) add_count(out_.incidents, std::string{"frame: "} + s.what);
    }
    return true;
  }
  /// Looks at what became of the last frame that was screened: after every answer of the run.
  void take_screened() {
    if (!source_) return;
    if (const auto s = run_.screened()) strip_.judge(s->time, s->fates, s->fate);
  }
  /// Pictures for the report, and what was left out.
  void finish() const {
    if (!source_) return;
    out_.strip = strip_.pictures();
    for (const auto& [what, n] : source_->left_out()) add_count(out_.incidents, what, n);
  }

 private:
  SolverRun& run_;
  SolveOutcome& out_;
  FrameStrip strip_;
  std::unique_ptr<FrameSource> source_;
  std::unique_ptr<TrackFrame> frame_{std::make_unique<TrackFrame>()};
  std::optional<estimator::CameraPredictor> predictor_;
};

/// Measurements, readings and frames in the order of time; solutions as they become due. Errors: those of the frames.
io::FileResult<bool> feed(const SolveRequest& request, const SolveInputs& in, MeasurementFeed& measurements, FrameFeed& frames, SolverRun& run,
                          SolveOutcome& out) {
  Drain drain{in, request.at_camera_rate, run, out};
  Progress progress{request.label, static_cast<std::size_t>(std::max(0.0, seconds_between(in.start, in.end) * 10)) + 1};
  const auto look = [&frames] { frames.take_screened(); };
  std::size_t k = 0;
  while (measurements.has_more() || k < in.imu.size()) {
    if (measurements.has_more() && (k == in.imu.size() || measurements.time() <= in.imu[k].time)) {
      const GpsTime time = measurements.time();
      measurements.hand_over(drain);
      drain.take_due(look);
      progress.update(static_cast<std::size_t>(seconds_between(in.start, time) * 10) + 1, drain.progress_note());
    } else {
      const GpsTime time = in.imu[k].time;
      if (const Status s = run.add_imu(in.imu[k++]); !s.ok()) add_count(out.incidents, std::string{"reading: "} + s.what);
      if (const io::FileResult<bool> fed = frames.feed(time); !fed) return fed.error();
      drain.take_due(look);
      if (request.at_imu_rate) drain.take_predicted(time);
    }
  }
  run.finish();
  drain.take_due(look);
  drain.finish();
  progress.finish();
  drop_predictions_at_solutions(out);
  frames.finish();
  return true;
}

}  // namespace

namespace {

RunOptions run_options(const SolveRequest& request, const SolveInputs& in) {
  RunOptions o{.rtk = in.options, .inertial = in.inertial, .lanes = in.lanes, .calibrate_camera = request.calibrate_camera};
  o.robust = !request.is_without(kRobustPart), o.batch_by_size = request.is_with("batch-size");
  return o;
}

}  // namespace

io::FileResult<SolveOutcome> solve(const SolveRequest& request, const SolveInputs& in) {
  SolveOutcome out;
  const std::unique_ptr<SolverRun> run =
      in.base || in.inertial ? make_run(request.formulation, run_options(request, in)) : make_single_point_run(in.options);
  if (!run)
    return io::Diagnostic{"--robust", 0, "'" + request.formulation + "' is no formulation", "use batch, scalar, latent or symmetric"};
  for (const gnss::Ephemeris& e : in.ephemerides)
    if (!run->add_ephemeris(e).ok()) add_count(out.incidents, "ephemeris left out: the store is full");
  if (in.ionosphere.present()) run->set_ionosphere(in.ionosphere);
  if (in.base)
    if (const Status s = run->set_base_position(in.base_position_e_m); !s.ok())
      return io::Diagnostic{request.base, 0, s.what, "give --base-ecef X,Y,Z"};
  if (request.heading_deg)
    if (const Status s = run->set_heading(imu::wrapped(*request.heading_deg / kDegPerRad), request.heading_sigma_deg / kDegPerRad);
        !s.ok() && s.code != StatusCode::under_determined)  // kept until the unit is levelled
      return io::Diagnostic{"--heading", 0, s.what, "give DEG or DEG,SIGMA"};

  MeasurementFeed measurements{in, *run, out};
  if (const io::FileResult<bool> opened = measurements.open(request); !opened) return opened.error();
  const auto start = std::chrono::steady_clock::now();
  FrameFeed frames{in, *run, out};
  if (const io::FileResult<bool> opened = frames.open(request, in); !opened) return opened.error();
  if (const io::FileResult<bool> fed = feed(request, in, measurements, frames, *run, out); !fed) return fed.error();
  if (request.has_camera()) out.stereo = run->stereo();
  out.wall_s = milliseconds_since(start) / 1000;
  score(request, in, out);
  out.outages = outages_of(in, out.rows);
  return out;
}

}  // namespace searvins::examples
