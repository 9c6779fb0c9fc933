// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// SolverRun of one formulation, with and without an inertial unit. Included by the four solve_*.cpp only: instantiating it is what takes
/// the compiler's time.
#pragma once

#include <Eigen/Core>

#include <deque>
#include <memory>
#include <optional>

#include <searvins/estimator/estimator.hpp>
#include <searvins/estimator/rtk_estimator.hpp>
#include <searvins/geodesy/wgs84.hpp>
#include <searvins/imu/prediction.hpp>
#include <searvins/imu/preintegration.hpp>

#include "examples/searvins/solver_run.hpp"

namespace searvins::examples {

namespace detail {

/// The oldest state of a window.
template <class Estimator>
[[nodiscard]] std::optional<LaggedEstimate> oldest_of(const Estimator& estimator) {
  const auto state = estimator.oldest();
  if (!state.ok()) return std::nullopt;
  return LaggedEstimate{state->time, state->position_e_m, state->status};
}

}  // namespace detail

/// An RtkEstimator behind the interface. Tens of megabytes: lives on the heap.
template <template <class> class Form>
class RtkRun final : public EpochRun {
 public:
  explicit RtkRun(const estimator::RtkOptions& options) : estimator_(options) {}

  Status add_ephemeris(const gnss::Ephemeris& ephemeris) override { return estimator_.add_ephemeris(ephemeris); }
  void set_ionosphere(const gnss::KlobucharCoefficients& coefficients) override { estimator_.set_ionosphere(coefficients); }
  Status set_base_position(const Eigen::Vector3d& position_e_m) override { return estimator_.set_base_position(position_e_m); }
  Status add_base(const gnss::ObservationEpoch& epoch) override { return estimator_.add_base(epoch); }

  [[nodiscard]] const gnss::DifferencedEpoch* differenced() const override { return &estimator_.differenced(); }
  [[nodiscard]] const gnss::SinglePointSolution& single_point() const override { return estimator_.single_point(); }
  [[nodiscard]] std::optional<LaggedEstimate> oldest() const override { return detail::oldest_of(estimator_); }

 private:
  Result<estimator::RtkSolution> update(const gnss::ObservationEpoch& rover) override { return estimator_.update(rover); }

  estimator::RtkEstimator<estimator::RtkConfig<Form>> estimator_;
};

/// The tightly coupled Estimator behind the interface. About a hundred megabytes: lives on the heap.
///
/// For rows between solutions the readings since the newest state are integrated here a second time. Their covariance is that of the
/// solution, grown by its velocity's: correlations between the two are left out, which is right to a few percent within a second.
template <template <class> class Form>
class InertialRun final : public SolverRun {
 public:
  explicit InertialRun(const RunOptions& options) : inertial_(*options.inertial), estimator_(whole(options)) {}

  Status add_ephemeris(const gnss::Ephemeris& ephemeris) override { return estimator_.add_ephemeris(ephemeris); }
  void set_ionosphere(const gnss::KlobucharCoefficients& coefficients) override { estimator_.set_ionosphere(coefficients); }
  Status set_base_position(const Eigen::Vector3d& position_e_m) override { return estimator_.set_base_position(position_e_m); }
  Status add_base(const gnss::ObservationEpoch& epoch) override { return estimator_.add_base(epoch); }
  Status add_rover(const gnss::ObservationEpoch& epoch) override { return estimator_.add_rover(epoch); }
  Status add_imu(const imu::ImuSample& sample) override {
    const Status s = estimator_.add_imu(sample);
    if (!s.ok()) return s;
    newest_ = sample;
    recent_.push_back(sample);
    while (seconds_between(recent_.front().time, sample.time) > kRecentS) recent_.pop_front();
    is_tracking_ = is_tracking_ && integration_.push(sample).ok();
    return s;
  }
  Status set_heading(double heading_rad, double sigma_rad) override { return estimator_.set_heading(heading_rad, sigma_rad); }
  void finish() override { estimator_.finish(); }

  Result<estimator::RtkSolution> next() override {
    Result<estimator::RtkSolution> solution = estimator_.next();
    if (solution.ok()) follow(*solution);
    return solution;
  }

  [[nodiscard]] Result<estimator::RtkSolution> predict() const override {
    if (!is_tracking_) return failure(StatusCode::no_data, "there is no aligned state to go on from");
    const auto motion = integration_.until(newest_.time);
    if (!motion.ok()) return motion.status();
    const auto& bound = estimator_.inertial();
    const imu::NavigationState x = imu::predict(state_, *motion, bound.motion().earth());
    const imu::LeverArm antenna{inertial_.lever_arm_b_m, newest_.gyro_b_radps, bound.motion().earth().rate_w_radps()};
    estimator::RtkSolution out = last_;
    out.tag = out.time = newest_.time;
    out.status = estimator::SolutionStatus::dr;
    out.position_e_m = bound.frame().to_ecef(antenna.position_w_m(x));
    out.velocity_e_mps = bound.frame().R_ew * antenna.velocity_w_mps(x);
    out.R_nb = geodesy::ecef_from_enu(geodesy::geodetic_from_ecef(out.position_e_m)).transpose() * bound.frame().R_ew * x.R_wb;
    const double dt_s = motion->duration_s;
    out.covariance_enu_m2 += dt_s * dt_s * last_.velocity_covariance_enu;
    out.satellites = out.double_differences = 0;
    return out;
  }

  [[nodiscard]] const gnss::DifferencedEpoch* differenced() const override { return &estimator_.differenced(); }
  [[nodiscard]] const gnss::SinglePointSolution& single_point() const override { return estimator_.single_point(); }
  [[nodiscard]] std::optional<LaggedEstimate> oldest() const override {
    return estimator_.is_aligned() ? detail::oldest_of(estimator_.inertial()) : detail::oldest_of(estimator_.gnss_only());
  }
  [[nodiscard]] std::optional<AlignmentReport> alignment() const override {
    return AlignmentReport{estimator_.is_aligned(), estimator_.alignments(), estimator_.waiting_text()};
  }

 private:
  [[nodiscard]] static estimator::EstimatorOptions whole(const RunOptions& options) {
    estimator::EstimatorOptions o;
    o.rtk = options.rtk, o.inertial = *options.inertial;
    return o;
  }

  /// Goes on from a new solution with the readings after it.
  void follow(const estimator::RtkSolution& solution) {
    if (!solution.has_attitude) return void(is_tracking_ = false);
    state_ = estimator_.inertial().state(), last_ = solution;
    while (recent_.size() > 1 && recent_[1].time <= solution.time) recent_.pop_front();
    is_tracking_ = integration_.start(solution.time, imu::bias_of(state_), inertial_.preintegration).ok();
    for (const imu::ImuSample& sample : recent_) is_tracking_ = is_tracking_ && integration_.push(sample).ok();
  }

  static constexpr double kRecentS = 5;  ///< more than a solution is ever late

  estimator::InertialOptions inertial_;
  estimator::Estimator<Form> estimator_;
  imu::Preintegration<double, 8192> integration_{};
  imu::NavigationState state_{};
  estimator::RtkSolution last_{};
  std::deque<imu::ImuSample> recent_;  ///< from the newest solution on
  imu::ImuSample newest_{};
  bool is_tracking_{false};
};

/// The run that the options ask for.
template <template <class> class Form>
[[nodiscard]] std::unique_ptr<SolverRun> make_run_of(const RunOptions& options) {
  if (options.inertial) return std::make_unique<InertialRun<Form>>(options);
  return std::make_unique<RtkRun<Form>>(options.rtk);
}

}  // namespace searvins::examples
