// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// What report.html shows about a run, as plain data: a command fills a RunReport and hands it to write_report() (report.hpp).
#pragma once

#include <Eigen/Core>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <searvins/imu/centreline.hpp>
#include <searvins/core/time.hpp>
#include <searvins/io/trajectory.hpp>

#include "examples/support/evaluation.hpp"
#include "examples/support/strip_picture.hpp"
#include "examples/support/truth.hpp"

namespace searvins::examples {

/// Diagnostics of one row. Unknown: NaN, or -1 for counts.
struct ReportEpoch {
  int satellites_seen{-1}, satellites_used{-1};
  double mean_cn0_dbhz{io::kUnknown};                            ///< of the signals in use
  std::vector<int> rejected{};                                   ///< signals rejected, by RunReport::rejection_reasons; may be shorter
  double weight_code{io::kUnknown}, weight_phase{io::kUnknown};  ///< mean robust weight, 0..1
  int fix_outcome{-1};                                           ///< index into RunReport::fix_outcomes
  double ratio{io::kUnknown};                                    ///< second best over best integer vector
  double base_age_s{io::kUnknown};
  Eigen::Vector3d sd_velocity_enu_mps{Eigen::Vector3d::Constant(io::kUnknown)};
  Eigen::Vector3d sd_attitude_deg{Eigen::Vector3d::Constant(io::kUnknown)};  ///< of roll, pitch and heading
  Eigen::Vector3d accel_bias_mps2{Eigen::Vector3d::Constant(io::kUnknown)};  ///< right, forward, up
  Eigen::Vector3d gyro_bias_dps{Eigen::Vector3d::Constant(io::kUnknown)};
};

/// A stretch of time without GNSS in the solution.
struct Outage {
  GpsTime from{}, to{};                  ///< the last solution with GNSS before it, the first after it (or the last row of the run)
  double horizontal_error_m{io::kUnknown};  ///< of the last row without GNSS, where the truth knows
  double sigma_m{io::kUnknown};          ///< horizontal, as reported there

  [[nodiscard]] double length_s() const { return seconds_between(from, to); }
};

/// One satellite on the sky at one time.
struct ReportSkyPoint {
  double azimuth_deg{0}, elevation_deg{0};
  double cn0_dbhz{io::kUnknown};
  double rejected_share{0};  ///< of its signals, 0..1
};

/// The path of one satellite.
struct ReportSatellite {
  std::string name;  ///< as in RINEX: G05
  std::vector<ReportSkyPoint> points;
};

/// A label and a text.
using ReportEntry = std::pair<std::string, std::string>;

/// Everything the page shows. Only `rows` must be filled.
struct RunReport {
  std::string title{"searvins run"};
  std::string subtitle{};  ///< a sentence below the title
  std::string command{};   ///< the command line that made it
  std::vector<io::TrajectoryRow> rows{};
  std::vector<ReportEpoch> epochs{};  ///< as many as rows, or none
  std::vector<std::string> rejection_reasons{};
  std::vector<std::string> fix_outcomes{};    ///< the first one is "fixed": it is drawn in the colour of a fix
  std::optional<double> success_rate_gate{};  ///< drawn into the success-rate chart
  std::vector<ReportSatellite> satellites{};
  std::optional<TruthTrack> truth{};
  std::vector<imu::CentrelinePoint> streets{};  ///< drawn below the track
  std::optional<Evaluation> evaluation{};  ///< scores for tiles, table and error distribution
  std::vector<Outage> outages{};           ///< shaded in the charts over time
  std::vector<StripPicture> strip{};       ///< frames of the camera, in the order of time
  std::vector<ReportEntry> figures{};      ///< further lines of the table of figures
  std::vector<ReportEntry> settings{};
  std::vector<std::string> notes{};  ///< what was skipped and why
};

}  // namespace searvins::examples
