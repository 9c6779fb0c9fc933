// SPDX-License-Identifier: BSD-3-Clause
// Runs the estimator over a stereo-inertial recording without GNSS.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <searvins/geodesy/local_frame.hpp>
#include <searvins/imu/attitude_angles.hpp>
#include <searvins/imu/position_fix.hpp>

#include "examples/searvins/euroc_job.hpp"
#include "examples/searvins/euroc_start.hpp"
#include "examples/searvins/image_frames.hpp"
#include "examples/searvins/track_frames.hpp"
#include "examples/support/frame_strip.hpp"
#include "examples/support/progress.hpp"

namespace searvins::examples {
namespace {

constexpr double kAheadS = 0.25;  ///< readings after a frame when it is solved: more than the estimator's latency
constexpr double kBeforeS = 4.5;  ///< of rest played before the recording: the alignment needs some 3.2 s
constexpr double kLeastRestS = 0.9;
constexpr double kFixStepS = 0.1;  ///< between positions before the alignment
constexpr double kFixSigmaM = 1e-3;
constexpr double kHeadingSigmaRad = 1e-3;
constexpr double kAccelBiasSigmaMps2 = 0.1, kGyroBiasSigmaRadps = 0.03;  ///< at the beginning: cheap units are this far off

double milliseconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

imu::ImuNoise noise_of(const EurocRecording& recording) {
  imu::ImuNoise noise;
  if (const auto& n = recording.imu_noise) {
    noise.accel_noise_mps2_sqrt_hz = n->accel_noise_mps2_sqrt_hz, noise.gyro_noise_radps_sqrt_hz = n->gyro_noise_radps_sqrt_hz;
    noise.accel_bias_walk_mps3_sqrt_hz = n->accel_bias_walk_mps3_sqrt_hz,
    noise.gyro_bias_walk_radps2_sqrt_hz = n->gyro_bias_walk_radps2_sqrt_hz;
  }
  noise.accel_bias_sigma_mps2 = kAccelBiasSigmaMps2, noise.gyro_bias_sigma_radps = kGyroBiasSigmaRadps;
  return noise;
}

std::vector<imu::ImuSample> turned(const std::vector<imu::ImuSample>& readings, const Eigen::Matrix3d& R) {
  std::vector<imu::ImuSample> out = readings;
  for (imu::ImuSample& s : out) s.gyro_b_radps = R * s.gyro_b_radps, s.accel_b_mps2 = R * s.accel_b_mps2;
  return out;
}

/// A body's pose from a solution, in the frame w.
TimedPose pose_of(const estimator::RtkSolution& s, const geodesy::LocalFrame& w) {
  const Eigen::Matrix3d R_en = geodesy::ecef_from_enu(geodesy::geodetic_from_ecef(s.position_e_m));
  return {s.time, w.to_local(s.position_e_m), w.R_ew.transpose() * R_en * s.R_nb};
}

vision::CameraMotion motion_of(const vision::StereoCamera<double>& camera, const TimedPose& from, const TimedPose& to) {
  const Eigen::Matrix3d R_wc = from.R_wb * camera.R_bc;
  const Eigen::Vector3d way_w_m = (to.p_w_m + to.R_wb * camera.p_bc_m) - (from.p_w_m + from.R_wb * camera.p_bc_m);
  return {R_wc.transpose() * to.R_wb * camera.R_bc, R_wc.transpose() * way_w_m};
}

/// The files of a run, read and turned into the library's axes.
struct Inputs {
  EurocRecording recording;
  std::unique_ptr<FrameSource> frames;
  const ImageFrames* images{nullptr};  ///< the same, when it has pictures
  imu::ImuNoise noise{};
  vision::StereoCamera<double> camera{};
  Eigen::Matrix3d R_pd{Eigen::Matrix3d::Identity()};  ///< library's axes from the dataset's
  std::vector<imu::ImuSample> before, readings;
  GpsTime end{};
};

io::Diagnostic no_readings(const EurocRecording& recording) {
  return {(std::filesystem::path{recording.folder} / "imu0" / "data.csv").string(), 0, "the recording has no readings of an inertial unit",
          "the run is stereo-inertial: copy imu0 with data.csv and sensor.yaml into the folder"};
}

/// How long the pictures stand still, at most up to a time: until then the tracks of each frame are, in the middle, where they were in an
/// earlier one.
io::FileResult<GpsTime> still_until(FrameSource& frames, GpsTime until) {
  constexpr double kStillPx = 2;
  constexpr double kMarginS = 0.2;  // slow at first
  constexpr std::size_t kLeastTracks = 15;
  std::map<std::uint64_t, Eigen::Vector2d> reference;
  const auto frame = std::make_unique<TrackFrame>();
  while (frames.time() && *frames.time() <= until) {
    const GpsTime time = *frames.time();
    const io::FileResult<bool> taken = frames.take(std::nullopt, *frame);
    if (!taken) return taken.error();
    std::vector<double> moved_px;
    std::map<std::uint64_t, Eigen::Vector2d> now;
    for (const vision::StereoObservation& o : frame->observations) {
      now[o.track] = {o.pixel_px[0], o.pixel_px[2]};
      if (const auto at = reference.find(o.track); at != reference.end()) moved_px.push_back((now[o.track] - at->second).norm());
    }
    if (moved_px.size() < kLeastTracks) {
      reference = std::move(now);
      continue;
    }
    const auto middle = moved_px.begin() + static_cast<std::ptrdiff_t>(moved_px.size() / 2);
    std::nth_element(moved_px.begin(), middle, moved_px.end());
    if (*middle > kStillPx) return time.plus_seconds(-kMarginS);
  }
  return until;
}

vision::SemanticRules semantic_rules(const EurocRequest& request) {
  vision::SemanticRules rules;
  if (request.reject.empty()) return rules;
  rules.dynamic = rules.unstable = vision::ClassSet{};
  for (const int k : request.reject) rules.dynamic.insert(static_cast<vision::SemanticClass>(k));
  return rules;
}

/// Opens pictures or tracks.
io::FileResult<bool> open_frames(const EurocRequest& request, Inputs& in, EurocOutcome& out) {
  ImageFrameOptions options;
  options.nanoseconds = io::NanosecondScale::gps;  // as they stand
  options.orb.min_depth_m = 0.3;
  options.semantic = semantic_rules(request);
  auto images = ImageFrames::open(request.folder, options);
  if (!images) return images.error();
  in.recording = (*images)->recording();
  in.camera = (*images)->camera();
  if (in.recording.imu.samples.size() < 100) return no_readings(in.recording);
  const GpsTime first = in.recording.imu.samples.front().time;
  const auto early =
      std::count_if(in.recording.pairs.begin(), in.recording.pairs.end(), [&](const EurocPair& p) { return p.time < first; });
  if (early > 0) add_count(out.incidents, "frame from before the first reading: left out", early);
  if (request.tracks.empty()) {
    (*images)->start_at(first);
    in.images = images->get(), in.frames = std::move(*images);
    return true;
  }
  auto tracks = TrackFrames::open(request.tracks, first);
  if (!tracks) return tracks.error();
  in.frames = std::move(*tracks);
  return true;
}

/// The truth, as poses of the body.
io::FileResult<std::vector<TimedPose>> read_truth_of(const EurocRequest& request, const EurocRecording& recording, EurocOutcome& out) {
  std::vector<EurocPose> rows = recording.truth;
  if (!rows.empty()) out.truth_source = "the recording's";
  if (!request.truth.empty()) {
    auto read = read_euroc_truth(request.truth, io::NanosecondScale::gps);
    if (read.error) return *read.error;
    rows = std::move(read.value), out.truth_source = request.truth;
    for (const io::SkippedItem& item : read.skipped.items())
      add_count(out.incidents, "truth: " + item.reason, static_cast<long>(item.count));
  }
  const SensorPose& camera = recording.left.pose;
  std::vector<TimedPose> poses;
  for (const EurocPose& row : rows) {
    TimedPose x{row.time, row.p_w_m, row.q_wb.toRotationMatrix()};
    if (!request.truth.empty() && request.truth_is_left_camera) {
      x.R_wb = x.R_wb * camera.R_bs.transpose();
      x.p_w_m -= x.R_wb * camera.t_bs_m;
    }
    poses.push_back(x);
  }
  return poses;
}

/// Axes, rest and end of the run. Errors: a file that cannot be read.
io::FileResult<bool> prepare_readings(const EurocRequest& request, Inputs& in, EurocOutcome& out) {
  const std::vector<imu::ImuSample>& raw = in.recording.imu.samples;
  Eigen::Vector3d sum_d = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < 100; ++i) sum_d += raw[i].accel_b_mps2;
  in.R_pd = library_axes(sum_d / 100, in.camera.R_bc.col(2));
  in.camera.R_bc = in.R_pd * in.camera.R_bc, in.camera.p_bc_m = in.R_pd * in.camera.p_bc_m;
  in.readings = turned(raw, in.R_pd);
  std::size_t calm = calm_beginning(in.readings);
  if (calm > 0) {
    Inputs ahead;  // a frontend of its own: the run's must see its first frame first
    EurocOutcome unused;
    if (const io::FileResult<bool> opened = open_frames(request, ahead, unused); !opened) return opened.error();
    const io::FileResult<GpsTime> still = still_until(*ahead.frames, in.readings[calm - 1].time);
    if (!still) return still.error();
    while (calm > 1 && in.readings[calm - 1].time > *still) --calm;
    out.rest_s = seconds_between(in.readings[0].time, in.readings[calm - 1].time);
  }
  if (out.rest_s >= kLeastRestS)
    in.before = rest_before(in.readings, calm, kBeforeS);
  else
    out.rest_s = 0,
    out.notes.push_back("the recording does not begin with a rest: up is learned on the move, and the first ten seconds have no pose");
  const GpsTime first = *in.frames->time(), last = in.recording.pairs.back().time;
  in.end = request.duration_s ? std::min(last, first.plus_seconds(*request.duration_s)) : last;
  out.readings = raw.size(), out.imu_interval_s = in.recording.imu.interval_s, out.frame_period_s = in.recording.period_s;
  if (!in.recording.imu_noise) out.notes.push_back("there is no imu0/sensor.yaml: the noise of a common MEMS unit is assumed");
  return true;
}

estimator::StereoInertialOptions inertial_options(const EurocRequest& request, const Inputs& in) {
  estimator::StereoInertialOptions o;
  o.preintegration.noise = in.noise;
  o.stereo.camera = in.camera;
  vision::AdmissionOptions& a = o.stereo.admission;
  a.tracks.max_arc = request.max_arc;
  a.semantic = semantic_rules(request);
  a.range.min_depth_m = a.pnp.range.min_depth_m = std::clamp(4 * in.camera.baseline_m, 0.3, 1.0);
  for (const std::string& part : request.without) {
    if (part == "semantic") a.use_semantic = false;
    if (part == "geometric") a.use_geometric = false;
    if (part == "motion") a.use_motion = false;
    if (part == "maturity") a.use_maturity = false;
  }
  return o;
}

/// The estimator fed in the order of time.
class Loop {
 public:
  Loop(Inputs& in, SolverRun& run, EurocOutcome& out)
      : in_(in),
        run_(run),
        out_(out),
        w_(geodesy::LocalFrame::at(geodesy::ecef_from_geodetic(kNominalPlace))),
        anchor_e_m_(w_.origin_e_m),
        strip_(*in.frames->time(), in.end) {}

  /// Errors: a file that cannot be read.
  io::FileResult<bool> run_all(const std::string& label) {
    give_heading(0);
    begin();
    Progress progress{label, in_.recording.pairs.size()};
    while (in_.frames->time() && *in_.frames->time() <= in_.end) {
      if (const io::FileResult<bool> stepped = step(*in_.frames->time()); !stepped) return stepped.error();
      progress.update(out_.frames.size(),
                      std::to_string(out_.frames.size()) + " frames, " + std::to_string(out_.frames.back().admitted) + " points");
    }
    run_.finish();
    drain();
    progress.finish();
    out_.strip = strip_.pictures();
    return true;
  }

 private:
  void give_heading(double heading_rad) { (void)run_.set_heading(heading_rad, kHeadingSigmaRad); }  // kept until up is known

  void add_reading(const imu::ImuSample& s) {
    if (const Status added = run_.add_imu(s); !added.ok()) add_count(out_.incidents, std::string{"reading: "} + added.what);
    newest_ = s.time;
  }
  /// Readings up to a time and the one that reaches past it.
  void feed(GpsTime until) {
    while (next_reading_ < in_.readings.size() && newest_ < until) add_reading(in_.readings[next_reading_++]);
  }

  /// A position where the body is thought to be: an alignment needs one.
  void give_position(GpsTime t) {
    imu::PositionFix fix;
    fix.time = t, fix.position_e_m = anchor_e_m_, fix.quality = 1;
    fix.covariance_e_m2 = kFixSigmaM * kFixSigmaM * Eigen::Matrix3d::Identity();
    (void)run_.add_position(fix);
  }

  /// Plays the rest before the recording, with positions until the unit is aligned.
  void begin() {
    GpsTime due = in_.before.empty() ? GpsTime{} : in_.before.front().time.plus_seconds(1);
    for (const imu::ImuSample& s : in_.before) {
      if (!is_aligned_ && s.time >= due) give_position(s.time), due = s.time.plus_seconds(kFixStepS);
      add_reading(s);
      drain();
    }
  }

  io::FileResult<bool> step(GpsTime t) {
    feed(t);
    drain();
    EurocFrame& frame = out_.frames.emplace_back();
    frame.time = t;
    const auto before = std::chrono::steady_clock::now();
    const io::FileResult<bool> taken = in_.frames->take(predicted_motion(t), *tracks_);
    if (!taken) return taken.error();
    frame.frontend_ms = milliseconds_since(before);
    last_taken_ = t;
    if (!is_aligned_) give_position(t);
    if (*taken) {
      frame.offered = tracks_->observations.size();
      if (in_.images) strip_.offer(t, in_.images->picture(), *tracks_);
      if (const Status s = run_.add_stereo(*tracks_); !s.ok()) add_count(out_.incidents, std::string{"frame: "} + s.what);
    }
    feed(t.plus_seconds(kAheadS));
    drain();
    return true;
  }

  /// The camera's motion since the frame taken before, where that has a state.
  [[nodiscard]] std::optional<vision::CameraMotion> predicted_motion(GpsTime t) const {
    if (!is_aligned_ || !last_pose_ || last_pose_->time != last_taken_) return std::nullopt;
    const Result<estimator::RtkSolution> now = run_.predict(t);
    if (!now.ok()) return std::nullopt;
    return motion_of(in_.camera, *last_pose_, pose_of(*now, w_));
  }

  void drain() {
    for (;;) {
      const auto before = std::chrono::steady_clock::now();
      const Result<estimator::RtkSolution> s = run_.next();
      if (s.ok())
        take(*s, milliseconds_since(before));
      else if (estimator::is_nothing_due(s.status()))
        break;
      else
        add_count(out_.incidents, s.status().what);
      watch();
    }
  }

  void take(const estimator::RtkSolution& s, double solve_ms) {
    if (!s.has_attitude || !s.position_e_m.allFinite()) return;
    anchor_e_m_ = s.position_e_m, heading_rad_ = imu::heading_of(s.R_nb);
    if (s.restarted && s.source == estimator::SolutionSource::camera && has_state_)
      add_count(out_.incidents, "window given up and begun anew");
    if (!s.smoother_status.ok() && s.smoother_status.code != StatusCode::not_converged)
      add_count(out_.incidents, std::string{"optimisation: "} + s.smoother_status.what);
    if (s.source != estimator::SolutionSource::camera || out_.frames.empty() || out_.frames.back().time != s.time) return;
    if (const auto seen = run_.screened(); seen && seen->time == s.time) strip_.judge(seen->time, seen->fates, seen->fate);
    last_pose_ = pose_of(s, w_), has_state_ = true;
    EurocFrame& frame = out_.frames.back();
    frame.has_state = true, frame.solve_ms = solve_ms, frame.is_at_rest = s.stationary;
    frame.pose = {s.time, last_pose_->p_w_m, last_pose_->R_wb * in_.R_pd};
    frame.v_w_mps = w_.R_ew.transpose() * s.velocity_e_mps;
    frame.sigma_m = s.covariance_enu_m2.diagonal().cwiseMax(0.0).cwiseSqrt();
    out_.accel_bias_mps2 = in_.R_pd.transpose() * s.accel_bias_b_mps2, out_.gyro_bias_radps = in_.R_pd.transpose() * s.gyro_bias_b_radps;
    if (const auto report = run_.stereo()) {
      const std::size_t admitted = report->counts.of(vision::ObservationFate::admitted);
      frame.admitted = admitted - admitted_, admitted_ = admitted;
    }
  }

  /// Follows the alignment. A lost one is made anew where and as the body was last.
  void watch() {
    const std::optional<AlignmentReport> now = run_.alignment();
    if (!now) return;
    if (!now->aligned && out_.alignment.empty()) out_.waits_for = now->waits_for;
    if (now->aligned == is_aligned_) return;
    is_aligned_ = now->aligned;
    out_.alignment.emplace_back(newest_, is_aligned_);
    if (!is_aligned_) give_heading(heading_rad_);
  }

  Inputs& in_;
  SolverRun& run_;
  EurocOutcome& out_;
  geodesy::LocalFrame w_;
  Eigen::Vector3d anchor_e_m_;
  FrameStrip strip_;
  std::unique_ptr<TrackFrame> tracks_{std::make_unique<TrackFrame>()};
  std::size_t next_reading_{0}, admitted_{0};
  GpsTime newest_{}, last_taken_{};
  std::optional<TimedPose> last_pose_;  ///< of the newest frame, library's axes
  double heading_rad_{0};
  bool is_aligned_{false}, has_state_{false};
};

/// Compares with the truth.
void compare(const std::vector<TimedPose>& truth, EurocOutcome& out) {
  if (truth.empty())
    return void(out.notes.push_back("there is no truth in the recording: the trajectory is not compared; --truth FILE gives one"));
  EurocErrors errors;
  errors.pairs = paired(out.trajectory(), truth);
  const auto yaw = absolute_error(errors.pairs, AlignmentFreedom::yaw_and_position),
             pose = absolute_error(errors.pairs, AlignmentFreedom::pose);
  if (!yaw.ok() || !pose.ok()) return void(out.notes.push_back("the truth is of another time than the trajectory: not compared"));
  errors.yaw = *yaw, errors.pose = *pose;
  for (std::size_t i = 1; i < errors.pairs.size(); ++i)
    errors.way_m += (errors.pairs[i].truth.p_w_m - errors.pairs[i - 1].truth.p_w_m).norm();
  for (const double length_m : {1.0, 5.0, 10.0, 50.0, 100.0})
    if (const RelativeError e = relative_error_over_distance(errors.pairs, length_m); e.translation_m.count > 0)
      errors.over_distance.push_back(e);
  for (const double time_s : {1.0, 10.0})
    if (const RelativeError e = relative_error_over_time(errors.pairs, time_s); e.translation_m.count > 0) errors.over_time.push_back(e);
  out.errors = std::move(errors);
}

}  // namespace

std::vector<TimedPose> EurocOutcome::trajectory() const {
  std::vector<TimedPose> poses;
  for (const EurocFrame& frame : frames)
    if (frame.has_state) poses.push_back(frame.pose);
  return poses;
}

io::FileResult<EurocOutcome> solve_euroc(const EurocRequest& request) {
  EurocOutcome out;
  Inputs in;
  if (const io::FileResult<bool> opened = open_frames(request, in, out); !opened) return opened.error();
  if (!in.frames->time())
    return io::Diagnostic{in.recording.folder, 0, "no frame is later than the first reading", "are cam0 and imu0 of the same recording?"};
  out.folder = in.recording.folder;
  const io::FileResult<std::vector<TimedPose>> truth = read_truth_of(request, in.recording, out);
  if (!truth) return truth.error();
  in.noise = noise_of(in.recording);
  if (const io::FileResult<bool> prepared = prepare_readings(request, in, out); !prepared) return prepared.error();

  RunOptions options;
  options.rtk.lag_s = request.lag_s;
  // With GNSS its epochs are optimised to the end, and frames between them a little. Here there is nothing but frames.
  options.rtk.frame_iterations = 4;
  options.rtk.solver.relinearise_threshold = 1e-3, options.rtk.solver.step_tolerance = 1e-4;
  options.inertial = inertial_options(request, in);
  const std::unique_ptr<SolverRun> run = make_symmetric_run(options);  // formulations differ in GNSS alone
  const auto start = std::chrono::steady_clock::now();
  if (const io::FileResult<bool> done = Loop{in, *run, out}.run_all(request.label); !done) return done.error();
  out.wall_s = milliseconds_since(start) / 1000;
  out.stereo = run->stereo();
  out.way_m = way_length_m(out.trajectory());
  for (const auto& [what, n] : in.frames->left_out()) add_count(out.incidents, what, n);
  if (out.stereo && out.stereo->refused_frames > 0)
    add_count(out.incidents, std::string{"frame refused: "} + out.stereo->refusal, out.stereo->refused_frames);
  compare(*truth, out);
  return out;
}

}  // namespace searvins::examples
