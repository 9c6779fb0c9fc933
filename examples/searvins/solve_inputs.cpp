// SPDX-License-Identifier: BSD-3-Clause
// Reading and checking what a run needs, before anything is solved: every refusal names the file and what to do.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <string>
#include <system_error>
#include <vector>

#include <searvins/geodesy/wgs84.hpp>
#include <searvins/gnss/weighting.hpp>
#include <searvins/io/centreline_file.hpp>
#include <searvins/io/imu_check.hpp>
#include <searvins/io/imu_log.hpp>
#include <searvins/io/pos_file.hpp>
#include <searvins/io/rinex_navigation.hpp>
#include <searvins/io/rinex_observation.hpp>
#include <searvins/io/text_fields.hpp>

#include "examples/searvins/solve_job.hpp"
#include "examples/support/angle_units.hpp"

namespace searvins::examples {
namespace {

constexpr double kFarthestEphemerisS = 4 * 3600.0;  ///< the longest age that the library accepts

std::string time_text(GpsTime t) {
  const CivilTime c = civil_from_gps(t);
  char buffer[96];
  std::snprintf(buffer, sizeof buffer, "%04d-%02d-%02d %02d:%02d:%02.0f (week %lld, sow %.1f)", c.year, c.month, c.day, c.hour, c.minute,
                std::floor(c.second), static_cast<long long>(t.week()), t.sow());
  return buffer;
}

std::string signal_text(const gnss::SignalCode& s) { return {gnss::letter_of(s.constellation), s.band, s.attribute}; }

/// Adds what a reader left out to the notes.
void note_skipped(const std::string& file, const io::SkipLog& log, std::vector<std::string>& notes) {
  for (const io::SkippedItem& item : log.items())
    notes.push_back(std::filesystem::path{file}.filename().string() + ": " + item.reason + ", " + std::to_string(item.count) +
                    " times, first at line " + std::to_string(item.first_line) + (item.hint.empty() ? "" : " (" + item.hint + ")"));
}

/// What an observation file holds, or why it cannot be used.
io::FileResult<io::ObservationFileInfo> scan(const std::string& path, std::vector<std::string>& notes) {
  io::RinexObservationReader reader;
  if (!reader.open(path)) return *reader.error();
  io::ObservationFileInfo info = io::scan_observations(reader);
  if (!info.summary.first) return reader.error() ? *reader.error() : io::Diagnostic{path, 0, "holds no usable epoch", {}};
  if (reader.error()) notes.push_back("reading ended early: " + io::to_string(*reader.error()));
  note_skipped(path, info.summary.skipped, notes);
  return info;
}

std::vector<gnss::SignalCode> signals_in(const io::ObservationFileInfo& info) {
  std::vector<gnss::SignalCode> found;
  for (const io::ConstellationCount& c : info.constellations)
    for (const io::SignalCount& s : c.signals) found.push_back(s.signal);
  return found;
}

std::string joined(const std::vector<gnss::SignalCode>& signals) {
  std::string text;
  for (const gnss::SignalCode& s : signals) (text += text.empty() ? "" : ",") += signal_text(s);
  return text.empty() ? "none" : text;
}

using Failure = std::optional<io::Diagnostic>;

Failure check_same_file(const SolveRequest& request) {
  std::error_code ignored;
  if (request.base.empty() || !std::filesystem::equivalent(request.rover, request.base, ignored)) return {};
  return io::Diagnostic{request.base, 0, "is given as rover and as base",
                        "give the file of the base station with --base, or leave --base out"};
}

/// The part of a recording from `first` to `last` that is asked for.
Failure take_span(const SolveRequest& request, const std::string& file, GpsTime first, GpsTime last, SolveInputs& in) {
  const auto place = [first](double sow) {  // in the week that is nearest to the recording's beginning
    const double apart_s = sow - first.sow();
    const int week = apart_s < -kSecondsPerWeek / 2 ? 1 : apart_s > kSecondsPerWeek / 2 ? -1 : 0;
    return GpsTime::from_week_sow(first.week() + week, sow);
  };
  in.start = request.start_sow ? place(*request.start_sow).plus_seconds(-0.02) : first;
  in.end = request.end_sow ? place(*request.end_sow).plus_seconds(0.02) : last;
  if (in.start > last || in.end < first)
    return io::Diagnostic{file, 0,
                          "has no epoch between --start and --end: it goes from " + time_text(first) + " to " + time_text(last),
                          "--start and --end are GPS seconds of week"};
  in.start = std::max(in.start, first), in.end = std::min(in.end, last);
  return {};
}

/// The part of the recording that is asked for, and whether rover and base share any of it.
Failure take_times(const SolveRequest& request, SolveInputs& in) {
  if (Failure f = take_span(request, request.rover, *in.rover.summary.first, *in.rover.summary.last, in)) return f;
  if (!in.base) return {};
  const GpsTime base_first = *in.base->summary.first, base_last = *in.base->summary.last;
  const double max_age_s = in.options.differencing.base.max_age_s;
  if (base_first > in.end.plus_seconds(0.02) || base_last.plus_seconds(max_age_s) < in.start)
    return io::Diagnostic{request.base, 0,
                          "does not overlap the rover in time: base from " + time_text(base_first) + " to " + time_text(base_last) +
                              ", rover from " + time_text(in.start) + " to " + time_text(in.end),
                          "get the base file of the rover's day and hour; tags must be GPS time in both"};
  if (base_first > in.start.plus_seconds(1) || base_last.plus_seconds(max_age_s) < in.end)
    in.notes.push_back("the base covers only a part of the rover's time: base from " + time_text(base_first) + " to " +
                       time_text(base_last));
  return {};
}

Failure take_signals(const SolveRequest& request, const std::optional<RigGnss>& rig, SolveInputs& in) {
  const std::vector<gnss::SignalCode>& wanted = !request.signals.empty() ? request.signals : rig ? rig->signals : request.signals;
  if (wanted.empty()) return {};
  const std::string source = !request.signals.empty() ? "--signals" : request.rig;
  if (wanted.size() > gnss::kMaxSignalGroups)
    return io::Diagnostic{source, 0, "names more than " + std::to_string(gnss::kMaxSignalGroups) + " signals", "leave some out"};
  const std::vector<gnss::SignalCode> rover = signals_in(in.rover);
  const std::vector<gnss::SignalCode> base = in.base ? signals_in(*in.base) : rover;
  std::vector<gnss::SignalCode> missing;
  for (const gnss::SignalCode& s : wanted) {
    const bool at_rover =
        std::any_of(rover.begin(), rover.end(), [&](const auto& r) { return r == s || (gnss::same_carrier(r, s) && r.attribute == ' '); });
    const bool at_base = std::any_of(base.begin(), base.end(), [&](const auto& b) { return gnss::same_carrier(b, s); });
    if (!at_rover || !at_base) missing.push_back(s);
    (void)in.options.differencing.selection.wanted.push_back(s);
  }
  if (missing.size() == wanted.size())
    return io::Diagnostic{source, 0,
                          "none of the signals " + joined(wanted) + " is in both files; the rover has " + joined(rover) +
                              (in.base ? ", the base " + joined(base) : std::string{}),
                          "name signals of the rover whose carrier the base has too"};
  if (!missing.empty()) in.notes.push_back("signals asked for that rover and base do not share: " + joined(missing));
  return {};
}

/// Sigmas: the profile (the estimator's own unless another is named), then what the rig says.
Failure take_sigmas(const SolveRequest& request, const std::optional<RigGnss>& rig, SolveInputs& in) {
  gnss::SigmaModel& sigmas = in.options.differencing.sigmas;
  if (request.sigma_profile == "urban") sigmas = gnss::urban_profile();
  if (request.sigma_profile == "geodetic") sigmas = gnss::geodetic_profile();
  if (!rig) return {};
  for (const auto& [text, pair] : rig->code_sigma_m) {
    gnss::SignalCode code;
    gnss::SignalSigma* entry = gnss::signal_from_text(text.data(), text.size(), code) ? sigmas.entry(code) : nullptr;
    if (!entry)
      return io::Diagnostic{request.rig,
                            0,
                            "gnss.code_sigma_m names more signals than the " + std::to_string(gnss::SigmaModel::kMaxSignals) + " that fit",
                            {}};
    entry->code = {pair.x(), pair.y()};
  }
  const RigGnss usual;
  if (rig->phase_sigma_m != usual.phase_sigma_m) {
    const gnss::SigmaPair phase{rig->phase_sigma_m.x(), rig->phase_sigma_m.y()};
    sigmas.other.phase = phase;
    for (gnss::SignalSigma& s : sigmas.signals) s.phase = phase;
  }
  if (rig->doppler_sigma_mps != usual.doppler_sigma_mps) sigmas.doppler_mps = rig->doppler_sigma_mps;
  return {};
}

void take_screening(const SolveRequest& request, const std::optional<RigGnss>& rig, SolveInputs& in) {
  gnss::Screening& screening = in.options.differencing.screening;
  if (rig) {
    screening.elevation_mask_rad = rig->elevation_mask_deg * kRadPerDeg;
    screening.min_cn0_dbhz = rig->min_cn0_dbhz;
    in.options.differencing.base.max_age_s = rig->max_base_age_s;
  }
  if (request.mask_deg) screening.elevation_mask_rad = *request.mask_deg * kRadPerDeg;
  if (request.min_cn0_dbhz) screening.min_cn0_dbhz = *request.min_cn0_dbhz;
}

/// --base-ecef, else the rig, else the header with the antenna's height above the marker.
Failure take_base_position(const SolveRequest& request, const Rig& rig, SolveInputs& in) {
  if (!in.base) return {};
  const io::RinexObservationHeader& header = in.base->header;
  std::string file = request.base;
  if (request.base_position_e_m) {
    in.base_position_e_m = *request.base_position_e_m, in.base_position_source = file = "--base-ecef";
  } else if (rig.base_position_e_m) {
    in.base_position_e_m = *rig.base_position_e_m, file = request.rig, in.base_position_source = "rig";
  } else if (header.approx_position_e_m) {
    const Eigen::Vector3d& hen = header.antenna_delta_hen_m;
    const Eigen::Matrix3d R_ew = geodesy::ecef_from_enu(geodesy::geodetic_from_ecef(*header.approx_position_e_m));
    in.base_position_e_m = *header.approx_position_e_m + R_ew * Eigen::Vector3d(hen.y(), hen.z(), hen.x());
    in.base_position_source = "header of the base file";
    in.notes.push_back("the base position is the one in the header of the base file: every error of it is an error of the trajectory");
  } else {
    return io::Diagnostic{request.base, 0, "the header gives no base position (APPROX POSITION XYZ is missing or zero)",
                          "give the antenna of the base with --base-ecef X,Y,Z (metres), or as base.position_ecef_m in the rig"};
  }
  const double radius_m = in.base_position_e_m.norm();
  if (!(radius_m > 6.25e6 && radius_m < 6.48e6))
    return io::Diagnostic{file, 0,
                          "the base position is not near the surface of the Earth (" + io::fixed_text(radius_m, 1) + " m from its centre)",
                          "give ECEF metres with --base-ecef X,Y,Z"};
  return {};
}

/// Ephemerides of all files, as far as they can serve the rover's time.
Failure take_ephemerides(const SolveRequest& request, SolveInputs& in) {
  std::optional<GpsTime> first, last;
  for (const std::string& path : request.nav) {
    io::Parsed<io::RinexNavigationFile> file = io::read_rinex_navigation(path);
    if (file.error && file.value.ephemerides.empty()) return *file.error;
    if (file.error) in.notes.push_back("reading ended early: " + io::to_string(*file.error));
    note_skipped(path, file.skipped, in.notes);
    if (file.value.ionosphere.present() && !in.ionosphere.present()) in.ionosphere = file.value.ionosphere;
    for (const gnss::Ephemeris& e : file.value.ephemerides) {
      first = first ? std::min(*first, e.toe) : e.toe, last = last ? std::max(*last, e.toe) : e.toe;
      if (seconds_between(e.toe, in.start) <= kFarthestEphemerisS && seconds_between(in.end, e.toe) <= kFarthestEphemerisS)
        in.ephemerides.push_back(e);
    }
  }
  if (in.ephemerides.empty() && !first)
    return io::Diagnostic{request.nav.front(), 0, "holds no usable broadcast record",
                          "give a navigation file with GPS, Galileo, BeiDou or QZSS records"};
  if (in.ephemerides.empty())
    return io::Diagnostic{request.nav.front(), 0,
                          "no record is of the rover's time: records from " + time_text(*first) + " to " + time_text(*last) +
                              ", rover from " + time_text(in.start) + " to " + time_text(in.end),
                          "get the broadcast navigation file of the rover's day"};
  return {};
}

Failure take_truth(const SolveRequest& request, SolveInputs& in) {
  if (request.truth_point_e_m) in.truth = static_truth(*request.truth_point_e_m);
  if (request.truth.empty()) return {};
  io::FileResult<TruthTrack> truth = read_truth(request.truth, in.start);
  if (!truth) return truth.error();
  in.truth = std::move(truth).value();
  return {};
}

/// The inertial part of the settings from the rig.
Failure take_unit(const SolveRequest& request, const Rig& rig, SolveInputs& in) {
  if (!rig.imu)
    return io::Diagnostic{request.rig, 0, "has no section \"imu\", which --imu needs: noise, axes and rate of the inertial unit",
                          "add it (docs/inertial.md has an example), or leave --imu out"};
  if (!rig.lever_arm_b_m)
    return io::Diagnostic{request.rig, 0, "has no antenna.lever_arm_b_m, which --imu needs: from the inertial unit to the antenna, metres, body "
                          "axes",
                          "add \"antenna\": {\"lever_arm_b_m\": [x, y, z]}; [0, 0, 0] where they sit together"};
  estimator::StereoInertialOptions& inertial = in.inertial.emplace();
  imu::ImuNoise& n = inertial.preintegration.noise;
  n.accel_noise_mps2_sqrt_hz = rig.imu->accel_noise_mps2_sqrt_hz, n.gyro_noise_radps_sqrt_hz = rig.imu->gyro_noise_radps_sqrt_hz;
  n.accel_bias_walk_mps3_sqrt_hz = rig.imu->accel_bias_walk_mps3_sqrt_hz;
  n.gyro_bias_walk_radps2_sqrt_hz = rig.imu->gyro_bias_walk_radps2_sqrt_hz;
  n.accel_bias_sigma_mps2 = rig.imu->accel_bias_sigma_mps2, n.gyro_bias_sigma_radps = rig.imu->gyro_bias_sigma_radps;
  const bool is_mean = rig.imu->sample == RigImu::Sample::mean_to_stamp;
  inertial.preintegration.kind = is_mean ? imu::SampleKind::mean_to_stamp : imu::SampleKind::instantaneous;
  inertial.lever_arm_b_m = rig.R_rfu_b * *rig.lever_arm_b_m;
  inertial.non_holonomic = request.is_with("wheels");
  if (!request.map.empty()) {
    auto lanes = io::read_centrelines(request.map);
    if (!lanes) return lanes.error();
    in.lanes = std::move(lanes).value();
  }
  return {};
}

constexpr double kCodeGateSigmas = 5;

/// Policies of --with that GNSS alone has.
void take_policies(const SolveRequest& request, SolveInputs& in) {
  if (request.is_with("predicted-motion")) in.options.differencing.slips.predicted_motion = true;
  if (request.is_with("cn0")) in.options.differencing.cn0_weighting = true;
  if (request.is_with("code-gate")) in.options.code_gate_sigmas = kCodeGateSigmas;
}

/// The rectified pair that the rig describes.
Failure take_rig_camera(const SolveRequest& request, const Rig& rig, vision::StereoCamera<double>& c) {
  if (!rig.camera || !rig.camera->rectified)
    return io::Diagnostic{request.rig, 0, "has no section camera.rectified, which --tracks needs: tracks are pixels of the rectified pair",
                          "add it (fx_px, fy_px, cx_px, cy_px, baseline_m), with size_px, R_b_c, t_b_c_m and sigma_px beside it"};
  const RigRectified& r = *rig.camera->rectified;
  c.fx_px = r.fx_px, c.fy_px = r.fy_px, c.cx_px = r.cx_px, c.cy_px = r.cy_px, c.baseline_m = r.baseline_m;
  c.width_px = static_cast<int>(rig.camera->size_px.x()), c.height_px = static_cast<int>(rig.camera->size_px.y());
  c.R_bc = rig.R_rfu_b * rig.camera->R_b_c, c.p_bc_m = rig.R_rfu_b * rig.camera->t_b_c_m;
  if (const Status s = vision::check(c); !s.ok()) return io::Diagnostic{request.rig, 0, s.what, "see section camera"};
  return {};
}

/// The rectified pair that the pictures' own calibration describes, whose T_BS is in the axes of --imu; their stamps are GPS or UTC nanoseconds,
/// whichever lies in the time to solve.
Failure take_picture_camera(const SolveRequest& request, const Rig& rig, SolveInputs& in) {
  GpsTime first{}, last{};
  for (const io::NanosecondScale scale : {io::NanosecondScale::gps, io::NanosecondScale::unix_utc}) {
    in.image_options.nanoseconds = scale;
    const auto images = ImageFrames::open(request.images, in.image_options);
    if (!images) return images.error();
    const std::vector<EurocPair>& pairs = (*images)->recording().pairs;
    first = pairs.front().time, last = pairs.back().time;
    if (first > in.end || last < in.start) continue;
    vision::StereoCamera<double>& c = in.inertial->stereo.camera;
    c = (*images)->camera();
    c.R_bc = rig.R_rfu_b * c.R_bc, c.p_bc_m = rig.R_rfu_b * c.p_bc_m;
    return {};
  }
  return io::Diagnostic{request.images, 0, "the pictures are not of the time to solve: UTC sow " + io::fixed_text(first.sow(), 1) + " .. " +
                        io::fixed_text(last.sow(), 1) + " of GPS week " + std::to_string(first.week()),
                        "stamps are nanoseconds of GPS time (since 1980) or UTC (since 1970)"};
}

/// The camera, and how what it sees is screened.
Failure take_camera(const SolveRequest& request, const Rig& rig, SolveInputs& in) {
  if (!request.has_camera()) return {};
  if (!request.tracks.empty()) {
    if (Failure f = take_rig_camera(request, rig, in.inertial->stereo.camera)) return f;
  } else if (Failure f = take_picture_camera(request, rig, in)) {
    return f;
  }
  vision::AdmissionOptions& a = in.inertial->stereo.admission;
  if (rig.camera) a.pnp.sigma_px = rig.camera->sigma_px;
  if (rig.reject_classes) {
    a.semantic.dynamic = a.semantic.unstable = vision::ClassSet{};
    for (const int k : *rig.reject_classes) a.semantic.dynamic.insert(static_cast<vision::SemanticClass>(k));
  }
  for (const std::string& part : request.without) {
    if (part == "semantic") a.use_semantic = false;
    if (part == "geometric") a.use_geometric = false;
    if (part == "motion") a.use_motion = false;
    if (part == "maturity") a.use_maturity = false;
    if (part == "stereo") in.inertial->stereo.eyes = vision::Eyes::left;
  }
  in.image_options.semantic = a.semantic;
  return {};
}

/// Whether a log with this fault cannot be used.
bool is_fatal(io::ImuFault fault) {
  using enum io::ImuFault;
  return fault == columns_exchanged || fault == gravity_missing || fault == accel_magnitude || fault == gravity_axis;
}

void note_gaps(const std::string& name, const io::ImuLog& log, std::vector<std::string>& notes) {
  if (log.gap_count == 0) return;
  const auto longest = std::max_element(log.gaps.begin(), log.gaps.end(), [](const io::ImuGap& a, const io::ImuGap& b) {
    return seconds_between(a.from, a.to) < seconds_between(b.from, b.to);
  });
  notes.push_back(name + ": " + std::to_string(log.gap_count) + (log.gap_count == 1 ? " gap" : " gaps") + " in the readings, longest " +
                  io::fixed_text(seconds_between(longest->from, longest->to), 2) + " s from sow " + io::fixed_text(longest->from.sow(), 2) +
                  "; gaps of more than " + io::fixed_text(imu::PreintegrationOptions{}.max_gap_s, 1) + " s are solved with GNSS alone");
}

/// The readings of the time to solve, in body axes; what is wrong with the log is an error or a note.
Failure take_readings(const SolveRequest& request, const Rig& rig, SolveInputs& in) {
  io::ImuLogOptions options;
  options.reference = in.start;
  io::Parsed<io::ImuLog> log = io::read_imu_log(request.imu, options);
  if (log.error) return *log.error;
  const std::string name = std::filesystem::path{request.imu}.filename().string();
  std::vector<imu::ImuSample>& samples = log.value.samples;
  note_skipped(request.imu, log.skipped, in.notes);
  for (const io::ImuFinding& finding : log.value.findings) {
    if (is_fatal(finding.fault)) return finding.text;
    in.notes.push_back(name + ": " + finding.text.message + " (" + finding.text.hint + ")");
  }
  const GpsTime first = samples.front().time, last = samples.back().time;
  if (first > in.end || last < in.start)
    return io::Diagnostic{request.imu, 0,
                          "does not overlap the rover in time: readings from " + time_text(first) + " to " + time_text(last) +
                              (in.positions.empty() ? ", rover from " : ", positions from ") + time_text(in.start) + " to " + time_text(in.end),
                          "give the log of the rover's drive; its stamps must be GPS time"};
  if (first > in.start.plus_seconds(1) || last.plus_seconds(1) < in.end)
    in.notes.push_back(name + ": the readings cover only a part of the rover's time, from " + time_text(first) + " to " + time_text(last));
  if (const auto rate = io::check_imu_rate(log.value.interval_s, rig.imu->rate_hz, name))
    in.notes.push_back(name + ": " + rate->text.message + " (" + rate->text.hint + ")");
  note_gaps(name, log.value, in.notes);
  const Eigen::Matrix3d R_rfu_raw = rig.R_rfu_b * rig.imu->R_b_raw;
  io::turn_axes(samples, R_rfu_raw);
  if (const auto axis = io::check_gravity_axis(samples, R_rfu_raw, request.imu)) return axis->text;
  in.imu_interval_s = log.value.interval_s;
  const GpsTime from = in.start.plus_seconds(-1), to = in.end.plus_seconds(0.1);  // further, nothing asks for a solution
  std::copy_if(samples.begin(), samples.end(), std::back_inserter(in.imu),
               [&](const imu::ImuSample& s) { return s.time >= from && s.time <= to; });
  return {};
}

/// Positions of another program in the place of rover and base.
Failure take_positions(const SolveRequest& request, SolveInputs& in) {
  io::Parsed<std::vector<imu::PositionFix>> file = io::read_pos_file(request.positions);
  if (file.error) return *file.error;
  note_skipped(request.positions, file.skipped, in.notes);
  const std::vector<imu::PositionFix>& all = file.value;
  if (Failure f = take_span(request, request.positions, all.front().time, all.back().time, in)) return f;
  std::vector<double> steps_s;
  for (std::size_t k = 1; k < all.size(); ++k) steps_s.push_back(seconds_between(all[k - 1].time, all[k].time));
  if (!steps_s.empty()) {
    const auto middle = steps_s.begin() + static_cast<std::ptrdiff_t>(steps_s.size() / 2);
    std::nth_element(steps_s.begin(), middle, steps_s.end());
    in.interval_s = *middle;
  }
  std::copy_if(all.begin(), all.end(), std::back_inserter(in.positions),
               [&](const imu::PositionFix& p) { return p.time >= in.start && p.time <= in.end; });
  return {};
}

}  // namespace

io::FileResult<SolveInputs> prepare(const SolveRequest& request) {
  SolveInputs in;
  in.options = request.options;
  Rig rig;
  if (!request.rig.empty()) {
    io::FileResult<Rig> read = read_rig(request.rig);
    if (!read) return read.error();
    rig = std::move(read).value();
  }
  if (!request.positions.empty()) {
    if (const Failure f = take_positions(request, in)) return *f;
    if (const Failure f = take_truth(request, in)) return *f;
    if (const Failure f = take_unit(request, rig, in)) return *f;
    if (const Failure f = take_readings(request, rig, in)) return *f;
    if (const Failure f = take_camera(request, rig, in)) return *f;
    return in;
  }
  if (const Failure f = check_same_file(request)) return *f;
  io::FileResult<io::ObservationFileInfo> rover = scan(request.rover, in.notes);
  if (!rover) return rover.error();
  in.rover = std::move(rover).value(), in.interval_s = in.rover.interval_s;
  if (!request.base.empty()) {
    io::FileResult<io::ObservationFileInfo> base = scan(request.base, in.notes);
    if (!base) return base.error();
    in.base = std::move(base).value();
  }
  take_screening(request, rig.gnss, in);
  take_policies(request, in);
  if (const Failure f = take_times(request, in)) return *f;
  if (const Failure f = take_base_position(request, rig, in)) return *f;
  if (const Failure f = take_signals(request, rig.gnss, in)) return *f;
  if (const Failure f = take_sigmas(request, rig.gnss, in)) return *f;
  if (const Failure f = take_ephemerides(request, in)) return *f;
  if (const Failure f = take_truth(request, in)) return *f;
  if (request.imu.empty()) return in;
  if (const Failure f = take_unit(request, rig, in)) return *f;
  if (const Failure f = take_readings(request, rig, in)) return *f;
  if (const Failure f = take_camera(request, rig, in)) return *f;
  return in;
}

}  // namespace searvins::examples
