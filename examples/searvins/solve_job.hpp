// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// One run of `searvins solve`: what was asked for, what the files hold, what came out. `demo` uses the same.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <searvins/estimator/rtk_options.hpp>
#include <searvins/gnss/ephemeris.hpp>
#include <searvins/imu/centreline.hpp>
#include <searvins/imu/imu_sample.hpp>
#include <searvins/imu/position_fix.hpp>
#include <searvins/io/file_result.hpp>
#include <searvins/io/rinex_info.hpp>
#include <searvins/io/trajectory.hpp>

#include "examples/searvins/image_frames.hpp"
#include "examples/searvins/solver_run.hpp"
#include "examples/support/counts.hpp"
#include "examples/support/evaluation.hpp"
#include "examples/support/rig.hpp"
#include "examples/support/run_report.hpp"
#include "examples/support/strip_picture.hpp"
#include "examples/support/truth.hpp"

namespace searvins::examples {

/// The sigmas that `--sigma-profile` falls back to: the estimator's own.
inline constexpr const char* kDefaultSigmaProfile = "general";

/// Parts that `--without` switches off: of the screening of tracks, and the robust weights of GNSS.
inline constexpr std::array kScreeningParts{"semantic", "geometric", "motion", "maturity", "stereo"};
inline constexpr const char* kRobustPart = "robust";
/// Policies that `--with` switches on.
inline constexpr std::array kPolicies{"wheels", "cn0", "code-gate", "batch-size", "predicted-motion"};

/// What was asked for.
struct SolveRequest {
  std::string rover, base;  ///< RINEX observation files; no base: single points
  std::vector<std::string> nav;
  std::string rig, truth;
  std::optional<Eigen::Vector3d> truth_point_e_m, base_position_e_m;
  std::optional<double> start_sow, end_sow;
  std::string formulation{kDefaultFormulation};
  std::string sigma_profile{kDefaultSigmaProfile};
  std::string imu{};                       ///< log of an inertial unit; empty: GNSS only
  std::string positions{};                 ///< another program's positions, instead of rover, base and nav: loosely coupled
  std::string tracks{};                    ///< stereo tracks of a frontend, with an inertial unit
  std::string images{};                    ///< folder of stereo pictures, instead of tracks: the reference frontend makes them
  std::vector<std::string> without{};      ///< parts that are switched off: of the screening of tracks, or kRobustPart
  std::vector<std::string> with{};         ///< policies that are off by default: kPolicies
  std::string map{};                       ///< centre lines of lanes, with an inertial unit
  bool calibrate_camera{false};            ///< time offset and boresight of the camera are estimated
  std::optional<double> heading_deg{};     ///< at the beginning, from elsewhere
  double heading_sigma_deg{5};
  bool at_imu_rate{false};                 ///< rows between the solutions, one a reading
  bool at_camera_rate{false};              ///< rows of the frames
  std::vector<gnss::SignalCode> signals{};  ///< empty: the rig's, else the best of every common carrier
  std::optional<double> mask_deg, min_cn0_dbhz;
  estimator::RtkOptions options{};  ///< what neither rig nor profile sets
  std::string command{};            ///< the command line, for the report
  std::string label{"solve"};       ///< of the progress line

  [[nodiscard]] bool has_camera() const { return !tracks.empty() || !images.empty(); }
  [[nodiscard]] bool is_with(std::string_view policy) const { return std::find(with.begin(), with.end(), policy) != with.end(); }
  [[nodiscard]] bool is_without(std::string_view part) const { return std::find(without.begin(), without.end(), part) != without.end(); }
};

/// The files, read and checked against each other.
struct SolveInputs {
  std::vector<imu::PositionFix> positions;   ///< of the time to solve; then there is neither rover nor base
  double interval_s{0};                      ///< between rover epochs, or positions
  io::ObservationFileInfo rover;
  std::optional<io::ObservationFileInfo> base;
  std::vector<gnss::Ephemeris> ephemerides;  ///< those of the rover's time
  gnss::KlobucharCoefficients ionosphere{};
  GpsTime start{}, end{};  ///< rover tags (or times of positions) to solve, inclusive
  Eigen::Vector3d base_position_e_m{Eigen::Vector3d::Zero()};
  std::string base_position_source{};
  std::optional<TruthTrack> truth;
  estimator::RtkOptions options{};
  std::optional<estimator::StereoInertialOptions> inertial{};
  std::vector<imu::ImuSample> imu{};  ///< readings of the time to solve, in body axes
  double imu_interval_s{0};
  std::vector<imu::CentrelinePoint> lanes{};  ///< of request.map
  ImageFrameOptions image_options{};  ///< of request.images
  std::vector<std::string> notes;  ///< what a user should know
};

/// Something that happened to the alignment of the inertial unit.
struct AlignmentEvent {
  GpsTime time{};
  bool aligned{false};  ///< else: lost
  double after_s{0};    ///< since the run's beginning, or since it was lost
};

/// What came out.
struct SolveOutcome {
  std::vector<io::TrajectoryRow> rows, lagged_rows;
  std::vector<io::TrajectoryRow> predicted_rows;  ///< between them, at the rate of the inertial unit
  std::vector<ReportEpoch> epochs;  ///< as many as rows
  std::vector<ReportSatellite> satellites;
  std::vector<std::string> rejection_reasons, fix_outcomes;
  std::vector<double> ratios, ages_s;  ///< as many as rows
  long rover_epochs{0};                ///< offered, between start and end; or positions
  long answered_epochs{0};             ///< with a solution
  std::vector<AlignmentEvent> alignment;
  std::vector<Count> alignment_waits;  ///< rows that were not aligned, by what was waited for
  std::vector<Outage> outages;
  std::vector<StripPicture> strip;      ///< frames with what became of their observations, where there are images
  std::optional<StereoReport> stereo;   ///< when there were frames
  long frames{0};                      ///< offered
  std::vector<Count> skipped;          ///< rover epochs without a solution, by reason
  std::vector<Count> incidents;        ///< epochs with a solution that something happened to
  long restarts{0}, released_integers{0};
  bool solved_at_end{false};  ///< there is a solution at the end of the recording that rests on GNSS or on an aligned inertial unit
  std::optional<Evaluation> evaluation;
  double wall_s{0};
};

/// Reads and checks everything but the observations themselves.
[[nodiscard]] io::FileResult<SolveInputs> prepare(const SolveRequest& request);
/// Runs the estimator over the recording.
[[nodiscard]] io::FileResult<SolveOutcome> solve(const SolveRequest& request, const SolveInputs& inputs);

/// The table for the terminal.
[[nodiscard]] std::string summary_text(const SolveRequest& request, const SolveInputs& inputs, const SolveOutcome& outcome);
/// Writes all output files into a folder, which is made; an empty string on success, else what went wrong.
[[nodiscard]] std::string write_outputs(const std::string& folder, const SolveRequest& request, const SolveInputs& inputs,
                                        const SolveOutcome& outcome);

}  // namespace searvins::examples
