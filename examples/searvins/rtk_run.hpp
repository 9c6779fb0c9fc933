// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// SolverRun of one formulation, with and without an inertial unit. Included by the four solve_*.cpp only: instantiating it is what takes
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

/// The tightly coupled Estimator behind the interface, with a camera where frames come. Some hundred megabytes: lives on the heap.
template <template <class> class Form>
class InertialRun final : public SolverRun {
 public:
  explicit InertialRun(const RunOptions& options) : estimator_(whole(options)) {}

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
    return StereoReport{motion.counts(), motion.dropped_landmarks(), estimator_.refused_frames(), estimator_.frame_status().what};
  }
  [[nodiscard]] std::optional<ScreenedFrame> screened() const override {
    const auto& motion = estimator_.inertial().motion();
    const auto& frames = motion.counts().frames;
    if (std::all_of(frames.begin(), frames.end(), [](std::size_t n) { return n == 0; })) return std::nullopt;
    const auto& frame = motion.admitted();
    return ScreenedFrame{frame.time, {frame.fates.data(), frame.fates.size()}, frame.fate};
  }

 private:
  using Whole = estimator::Estimator<Form, estimator::StereoCapacity, estimator::StereoInertialMotion<>>;

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
  if (options.inertial) return std::make_unique<InertialRun<Form>>(options);
  return std::make_unique<RtkRun<Form>>(options.rtk);
}

}  // namespace searvins::examples
