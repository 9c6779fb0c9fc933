// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// One run of `searvins solve --dataset euroc`: a stereo-inertial recording without GNSS, its trajectory in a world of its own, and how far
/// that is from the truth.
///
/// World. There is no place in the recording, so one is assumed: East-North-Up at a nominal point (kNominalPlace), where the body is at the
/// beginning. Gravity is that of the point; a place elsewhere on the Earth changes it by up to 0.3 %, which the accelerometer's bias takes
/// up. North is where the recording begins to look: the body's level axis nearest to the camera's has the heading 0 there. The Earth turns
/// about an axis that is then known up to the true heading only: at most 2 x 15 degrees an hour in the wrong direction, which the
/// gyroscope's bias takes up.
///
/// Beginning. The estimator needs up, a heading and a position to begin. It gets the heading 0 and positions at the origin until it is
/// aligned, none after that. Up comes from the rest that most recordings begin with, played before the recording (euroc_start.hpp), so that
/// no frame is lost to the alignment. Without such a rest up comes from the first seconds on the move, roughly.
///
/// Results are turned back into the axes of the dataset's own body.
///
/// Stamps are taken and written as they stand, nanoseconds of whatever scale.
#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <searvins/core/time.hpp>
#include <searvins/geodesy/wgs84.hpp>
#include <searvins/io/file_result.hpp>

#include "examples/searvins/solver_run.hpp"
#include "examples/support/counts.hpp"
#include "examples/support/strip_picture.hpp"
#include "examples/support/trajectory_alignment.hpp"

namespace searvins::examples {

/// Where the world is put: see the file comment.
inline constexpr geodesy::Geodetic kNominalPlace{47.4 * std::numbers::pi / 180, 8.5 * std::numbers::pi / 180, 450};

/// What was asked for.
struct EurocRequest {
  std::string folder;
  std::string truth{};                 ///< another truth than the recording's; empty: its own, if there is one
  bool truth_is_left_camera{false};    ///< the poses of that file are those of the left camera, not of the body
  std::string tracks{};                ///< stereo tracks of another frontend instead of the pictures
  std::vector<std::string> without{};  ///< parts of the screening of tracks that are switched off
  std::vector<int>
      reject{};  ///< classes of labels whose points are refused; empty: those of Cityscapes that move or look different each day
  std::optional<double> duration_s{};  ///< of the recording, from its first frame
  double lag_s{6};
  int max_arc{10};             ///< frames that share a landmark
  std::string command{};       ///< the command line, for the report
  std::string label{"solve"};  ///< of the progress line
};

/// One frame.
struct EurocFrame {
  GpsTime time{};
  std::size_t offered{0}, admitted{0};  ///< observations
  double frontend_ms{0}, solve_ms{0};
  bool is_at_rest{false};
  bool has_state{false};  ///< then the pose counts
  TimedPose pose{};       ///< of the dataset's body in the world
  Eigen::Vector3d v_w_mps{Eigen::Vector3d::Zero()};
  Eigen::Vector3d sigma_m{Eigen::Vector3d::Zero()};  ///< of the position, east, north, up
};

/// How the run compares with a truth.
struct EurocErrors {
  std::vector<PosePair> pairs;
  double way_m{0};              ///< of the truth, while it is compared
  AbsoluteError yaw{}, pose{};  ///< after alignment with 4 and with 6 degrees of freedom
  std::vector<RelativeError> over_distance, over_time;
};

/// What came out.
struct EurocOutcome {
  std::string folder;  ///< the one that holds cam0
  std::vector<EurocFrame> frames;
  double frame_period_s{0}, imu_interval_s{0};
  std::size_t readings{0};
  double rest_s{0};                                 ///< at the beginning, played before it; 0: there is none
  std::vector<std::pair<GpsTime, bool>> alignment;  ///< when it was reached (true) and lost
  std::string waits_for;                            ///< of an alignment that was never reached
  Eigen::Vector3d accel_bias_mps2{Eigen::Vector3d::Zero()}, gyro_bias_radps{Eigen::Vector3d::Zero()};  ///< at the end, dataset's axes
  double way_m{0};                                                                                     ///< of the trajectory
  std::optional<StereoReport> stereo;
  std::string truth_source;  ///< empty: none
  std::optional<EurocErrors> errors;
  std::vector<StripPicture> strip;
  std::vector<Count> incidents;
  std::vector<std::string> notes;
  double wall_s{0};

  /// The poses of the frames that have one.
  [[nodiscard]] std::vector<TimedPose> trajectory() const;
  [[nodiscard]] bool is_solved_at_end() const { return !frames.empty() && frames.back().has_state; }
};

/// Runs the estimator over a recording. Errors: what cannot be read, with file and line.
[[nodiscard]] io::FileResult<EurocOutcome> solve_euroc(const EurocRequest& request);

/// The table for the terminal.
[[nodiscard]] std::string summary_text(const EurocRequest& request, const EurocOutcome& outcome);
/// Writes all output files into a folder, which is made; an empty string on success, else what went wrong.
[[nodiscard]] std::string write_outputs(const std::string& folder, const EurocRequest& request, const EurocOutcome& outcome);

}  // namespace searvins::examples
