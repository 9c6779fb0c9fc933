// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// What `searvins solve` needs of an estimator, whatever its robust formulation. The formulations are template arguments of the
/// library, and one instantiation takes a compiler minutes: each has a source file of its own (solve_*.cpp), and the
/// command sees this interface alone.
#pragma once

#include <Eigen/Core>

#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include <searvins/core/status.hpp>
#include <searvins/core/time.hpp>
#include <searvins/estimator/rtk_options.hpp>
#include <searvins/estimator/rtk_solution.hpp>
#include <searvins/estimator/stereo_inertial_motion.hpp>
#include <searvins/gnss/differenced_epoch.hpp>
#include <searvins/gnss/ephemeris.hpp>
#include <searvins/gnss/observation.hpp>
#include <searvins/gnss/single_point_solution.hpp>
#include <searvins/imu/centreline.hpp>
#include <searvins/imu/imu_sample.hpp>
#include <searvins/imu/position_fix.hpp>
#include <searvins/vision/camera_correction.hpp>

namespace searvins::examples {

/// The robust formulation that `--robust` falls back to.
inline constexpr const char* kDefaultFormulation = "symmetric";
/// The one formulation that a camera can be calibrated under.
inline constexpr const char* kCalibratingFormulation = "symmetric";

/// An estimate that later epochs have improved.
struct LaggedEstimate {
  GpsTime time{};
  Eigen::Vector3d position_e_m{Eigen::Vector3d::Zero()};
  estimator::SolutionStatus status{estimator::SolutionStatus::dr};
};

/// How a run with an inertial unit stands with its alignment.
struct AlignmentReport {
  bool aligned{false};
  int alignments{0};          ///< so far
  const char* waits_for{""};  ///< in words
};

/// A frame of stereo tracks as the runs take it.
using TrackFrame = estimator::StereoInertialMotion<>::Frame;

/// How a run with a camera treated its frames.
struct StereoReport {
  vision::AdmissionCounts counts{};
  long dropped_landmarks{0};  ///< found to be no fixed points when they left the window
  long refused_frames{0};
  const char* refusal{""};  ///< of the last of them
  std::optional<vision::CameraCorrectionEstimate> correction{};  ///< of a run that calibrates its camera
};

/// The frame that a run has screened last. `fates` are of the observations that it came with, in their order; none when the frame had none
/// or was out of order. They live in the run, until its next call of next().
struct ScreenedFrame {
  GpsTime time{};
  std::span<const vision::ObservationFate> fates{};
  vision::FrameFate fate{vision::FrameFate::empty};
};

/// One estimator at work. Inputs come in the order of time; solutions are taken with next() until none is due.
class SolverRun {
 public:
  virtual ~SolverRun() = default;
  SolverRun() = default;
  SolverRun(const SolverRun&) = delete;
  SolverRun& operator=(const SolverRun&) = delete;

  virtual Status add_ephemeris(const gnss::Ephemeris& ephemeris) = 0;
  virtual void set_ionosphere(const gnss::KlobucharCoefficients& coefficients) = 0;
  virtual Status set_base_position(const Eigen::Vector3d& position_e_m) = 0;
  virtual Status add_base(const gnss::ObservationEpoch& epoch) = 0;
  virtual Status add_rover(const gnss::ObservationEpoch& epoch) = 0;
  virtual Status add_imu(const imu::ImuSample&) { return failure(StatusCode::unsupported, "this run has no inertial unit"); }
  virtual Status add_position(const imu::PositionFix&) { return failure(StatusCode::unsupported, "this run has no inertial unit"); }
  virtual Status add_stereo(const TrackFrame&) { return failure(StatusCode::unsupported, "this run has no inertial unit"); }
  virtual Status set_heading(double, double) { return failure(StatusCode::unsupported, "this run has no inertial unit"); }
  /// No more input will come.
  virtual void finish() {}

  /// As estimator::Estimator::next(): estimator::is_nothing_due() of its status says that nothing is due.
  virtual Result<estimator::RtkSolution> next() = 0;
  /// The antenna at a time that readings reach, from the newest solution and the readings since.
  [[nodiscard]] virtual Result<estimator::RtkSolution> predict(GpsTime) const {
    return failure(StatusCode::unsupported, "this run has no inertial unit");
  }

  /// The differenced epoch of the last solution; nullptr for an estimator that forms no differences.
  [[nodiscard]] virtual const gnss::DifferencedEpoch* differenced() const = 0;
  /// Single-point rows of the last solution, empty when it had none.
  [[nodiscard]] virtual const gnss::SinglePointSolution& single_point() const = 0;
  /// The oldest state of the window, nothing while there is none.
  [[nodiscard]] virtual std::optional<LaggedEstimate> oldest() const = 0;
  /// Nothing without an inertial unit.
  [[nodiscard]] virtual std::optional<AlignmentReport> alignment() const { return std::nullopt; }
  /// Nothing without an inertial unit.
  [[nodiscard]] virtual std::optional<StereoReport> stereo() const { return std::nullopt; }
  /// The newest of the frames that next() has screened; nothing while there is none.
  [[nodiscard]] virtual std::optional<ScreenedFrame> screened() const { return std::nullopt; }
};

/// A run whose estimator answers each rover epoch at once.
class EpochRun : public SolverRun {
 public:
  Status add_rover(const gnss::ObservationEpoch& epoch) final {
    epoch_ = epoch, has_epoch_ = true;
    return ok_status();
  }
  Result<estimator::RtkSolution> next() final {
    if (!has_epoch_) return failure(StatusCode::no_data, estimator::kNothingDue);
    has_epoch_ = false;
    return update(epoch_);
  }

 private:
  virtual Result<estimator::RtkSolution> update(const gnss::ObservationEpoch& rover) = 0;

  gnss::ObservationEpoch epoch_{};
  bool has_epoch_{false};
};

/// Settings of a run: those of the inertial part are there when it has an inertial unit.
struct RunOptions {
  estimator::RtkOptions rtk{};
  std::optional<estimator::StereoInertialOptions> inertial;
  bool robust{true};          ///< false: every observation of code, phase and Doppler has weight one
  bool batch_by_size{false};  ///< the batch form looks at |e|^2 / m instead of |e|^2
  imu::Centrelines lanes{};      ///< map for an inertial estimator, in memory that outlives the run
  bool calibrate_camera{false};  ///< estimates time offset and boresight of the camera; with kCalibratingFormulation and an inertial unit
};

std::unique_ptr<SolverRun> make_batch_run(const RunOptions& options);
std::unique_ptr<SolverRun> make_scalar_run(const RunOptions& options);
std::unique_ptr<SolverRun> make_latent_run(const RunOptions& options);
std::unique_ptr<SolverRun> make_symmetric_run(const RunOptions& options);
std::unique_ptr<SolverRun> make_calibrating_run(const RunOptions& options);
/// Without a base: robust single points and Doppler, filtered.
std::unique_ptr<SolverRun> make_single_point_run(const estimator::RtkOptions& options);

/// The estimator of a formulation by its word on the command line; empty for any other word.
[[nodiscard]] inline std::unique_ptr<SolverRun> make_run(std::string_view formulation, const RunOptions& options) {
  if (options.calibrate_camera) return formulation == kCalibratingFormulation ? make_calibrating_run(options) : nullptr;
  if (formulation == "batch") return make_batch_run(options);
  if (formulation == "scalar") return make_scalar_run(options);
  if (formulation == "latent") return make_latent_run(options);
  if (formulation == "symmetric") return make_symmetric_run(options);
  return nullptr;
}

}  // namespace searvins::examples
