// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// What `searvins solve` needs of an estimator, whatever its robust formulation. The formulations are template arguments of the
/// library, and one instantiation takes a compiler about a minute: each has a source file of its own (solve_*.cpp), and the
/// command sees this interface alone.
#pragma once

#include <Eigen/Core>

#include <memory>
#include <optional>
#include <string_view>

#include <searvins/core/status.hpp>
#include <searvins/core/time.hpp>
#include <searvins/estimator/rtk_options.hpp>
#include <searvins/estimator/rtk_solution.hpp>
#include <searvins/gnss/differenced_epoch.hpp>
#include <searvins/gnss/ephemeris.hpp>
#include <searvins/gnss/observation.hpp>
#include <searvins/gnss/single_point_solution.hpp>

namespace searvins::examples {

/// The robust formulation that `--robust` falls back to.
inline constexpr const char* kDefaultFormulation = "symmetric";

/// An estimate that later epochs have improved.
struct LaggedEstimate {
  GpsTime time{};
  Eigen::Vector3d position_e_m{Eigen::Vector3d::Zero()};
  estimator::SolutionStatus status{estimator::SolutionStatus::dr};
};

/// One estimator at work. The calls are those of estimator::RtkEstimator.
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
  virtual Result<estimator::RtkSolution> update(const gnss::ObservationEpoch& rover) = 0;

  /// The differenced epoch of the last update; nullptr for an estimator that forms no differences.
  [[nodiscard]] virtual const gnss::DifferencedEpoch* differenced() const = 0;
  /// Single-point rows of the last update, empty when it had none.
  [[nodiscard]] virtual const gnss::SinglePointSolution& single_point() const = 0;
  /// The oldest state of the window, nothing while there is none.
  [[nodiscard]] virtual std::optional<LaggedEstimate> oldest() const = 0;
};

std::unique_ptr<SolverRun> make_batch_run(const estimator::RtkOptions& options);
std::unique_ptr<SolverRun> make_scalar_run(const estimator::RtkOptions& options);
std::unique_ptr<SolverRun> make_latent_run(const estimator::RtkOptions& options);
std::unique_ptr<SolverRun> make_symmetric_run(const estimator::RtkOptions& options);
/// Without a base: robust single points and Doppler, filtered.
std::unique_ptr<SolverRun> make_single_point_run(const estimator::RtkOptions& options);

/// The estimator of a formulation by its word on the command line; empty for any other word.
[[nodiscard]] inline std::unique_ptr<SolverRun> make_run(std::string_view formulation, const estimator::RtkOptions& options) {
  if (formulation == "batch") return make_batch_run(options);
  if (formulation == "scalar") return make_scalar_run(options);
  if (formulation == "latent") return make_latent_run(options);
  if (formulation == "symmetric") return make_symmetric_run(options);
  return nullptr;
}

}  // namespace searvins::examples
