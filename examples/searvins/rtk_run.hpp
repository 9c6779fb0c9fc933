// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// SolverRun of one formulation, with and without an inertial unit. Included by the five solve_*.cpp only: instantiating it is what takes
/// the compiler's time.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cstddef>
#include <memory>
#include <optional>

#include <searvins/estimator/estimator.hpp>
#include <searvins/estimator/rtk_estimator.hpp>
#include <searvins/estimator/stereo_inertial_motion.hpp>

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

/// The robust policies of a formulation.
template <template <class> class Form>
struct Policies {
  Form<robust::Dcs<double>> code_phase{};
  Form<robust::Huber<double>> doppler{};
};

/// Those that the options ask for. Without robustness the thresholds are where no residual comes.
template <template <class> class Form>
[[nodiscard]] Policies<Form> policies_of(const RunOptions& options) {
  Policies<Form> p;
  if (!options.robust) p.code_phase.loss.c = p.doppler.loss.k = 1e12;
  if constexpr (requires { p.code_phase.normalise_by_size; }) p.code_phase.normalise_by_size = p.doppler.normalise_by_size = options.batch_by_size;
  return p;
}

/// An RtkEstimator behind the interface. Tens of megabytes: lives on the heap.
template <template <class> class Form>
class RtkRun final : public EpochRun {
 public:
  RtkRun(const estimator::RtkOptions& options, const Policies<Form>& policies) : estimator_(options, policies.code_phase, policies.doppler) {}

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

/// The tightly coupled Estimator behind the interface, with a camera where frames come. Some hundred megabytes: lives on the heap.
template <template <class> class Form, class Motion = estimator::StereoInertialMotion<>>
class InertialRun final : public SolverRun {
 public:
  InertialRun(const RunOptions& options, const Policies<Form>& policies) : estimator_(whole(options), policies.code_phase, policies.doppler) {
    estimator_.set_centrelines(options.lanes);
  }

  Status add_ephemeris(const gnss::Ephemeris& ephemeris) override { return estimator_.add_ephemeris(ephemeris); }
  void set_ionosphere(const gnss::KlobucharCoefficients& coefficients) override { estimator_.set_ionosphere(coefficients); }
  Status set_base_position(const Eigen::Vector3d& position_e_m) override { return estimator_.set_base_position(position_e_m); }
  Status add_base(const gnss::ObservationEpoch& epoch) override { return estimator_.add_base(epoch); }
  Status add_rover(const gnss::ObservationEpoch& epoch) override { return estimator_.add_rover(epoch); }
  Status add_imu(const imu::ImuSample& sample) override { return estimator_.add_imu(sample); }
  Status add_position(const imu::PositionFix& fix) override { return estimator_.add_position(fix); }
  Status add_stereo(const TrackFrame& frame) override { return estimator_.add_stereo(frame); }
  Status set_heading(double heading_rad, double sigma_rad) override { return estimator_.set_heading(heading_rad, sigma_rad); }
  void finish() override { estimator_.finish(); }

  Result<estimator::RtkSolution> next() override { return estimator_.next(); }
  [[nodiscard]] Result<estimator::RtkSolution> predict(GpsTime time) const override { return estimator_.predict(time); }

  [[nodiscard]] const gnss::DifferencedEpoch* differenced() const override { return &estimator_.differenced(); }
  [[nodiscard]] const gnss::SinglePointSolution& single_point() const override { return estimator_.single_point(); }
  [[nodiscard]] std::optional<LaggedEstimate> oldest() const override {
    return estimator_.is_aligned() ? detail::oldest_of(estimator_.inertial()) : detail::oldest_of(estimator_.gnss_only());
  }
  [[nodiscard]] std::optional<AlignmentReport> alignment() const override {
    return AlignmentReport{estimator_.is_aligned(), estimator_.alignments(), estimator_.waiting_text()};
  }
  [[nodiscard]] std::optional<StereoReport> stereo() const override {
    const auto& motion = estimator_.inertial().motion();
    StereoReport report{motion.counts(), motion.dropped_landmarks(), estimator_.refused_frames(), estimator_.frame_status().what, std::nullopt};
    if constexpr (Motion::Camera::calibrates) report.correction = motion.camera().estimate();
    return report;
  }
  [[nodiscard]] std::optional<ScreenedFrame> screened() const override {
    const auto& motion = estimator_.inertial().motion();
    const auto& frames = motion.counts().frames;
    if (std::all_of(frames.begin(), frames.end(), [](std::size_t n) { return n == 0; })) return std::nullopt;
    const auto& frame = motion.admitted();
    return ScreenedFrame{frame.time, {frame.fates.data(), frame.fates.size()}, frame.fate};
  }

 private:
  using Whole = estimator::Estimator<Form, estimator::StereoCapacity, Motion>;

  [[nodiscard]] static typename Whole::Options whole(const RunOptions& options) {
    typename Whole::Options o;
    o.rtk = options.rtk, o.inertial = *options.inertial;
    return o;
  }

  Whole estimator_;
};

/// The run that the options ask for.
template <template <class> class Form>
[[nodiscard]] std::unique_ptr<SolverRun> make_run_of(const RunOptions& options) {
  if (options.inertial) return std::make_unique<InertialRun<Form>>(options, policies_of<Form>(options));
  return std::make_unique<RtkRun<Form>>(options.rtk, policies_of<Form>(options));
}

}  // namespace searvins::examples
