// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// SolverRun of one formulation. Included by the four solve_*.cpp only: instantiating it is what takes the compiler's time.
#pragma once

#include <Eigen/Core>

#include <memory>
#include <optional>

#include <searvins/estimator/rtk_estimator.hpp>

#include "examples/searvins/solver_run.hpp"

namespace searvins::examples {

/// An RtkEstimator behind the interface. Tens of megabytes: lives on the heap.
template <template <class> class Form>
class RtkRun final : public SolverRun {
 public:
  explicit RtkRun(const estimator::RtkOptions& options) : estimator_(options) {}

  Status add_ephemeris(const gnss::Ephemeris& ephemeris) override { return estimator_.add_ephemeris(ephemeris); }
  void set_ionosphere(const gnss::KlobucharCoefficients& coefficients) override { estimator_.set_ionosphere(coefficients); }
  Status set_base_position(const Eigen::Vector3d& position_e_m) override { return estimator_.set_base_position(position_e_m); }
  Status add_base(const gnss::ObservationEpoch& epoch) override { return estimator_.add_base(epoch); }
  Result<estimator::RtkSolution> update(const gnss::ObservationEpoch& rover) override { return estimator_.update(rover); }

  [[nodiscard]] const gnss::DifferencedEpoch* differenced() const override { return &estimator_.differenced(); }
  [[nodiscard]] const gnss::SinglePointSolution& single_point() const override { return estimator_.single_point(); }
  [[nodiscard]] std::optional<LaggedEstimate> oldest() const override {
    const auto state = estimator_.oldest();
    if (!state.ok()) return std::nullopt;
    return LaggedEstimate{state->time, state->position_e_m, state->status};
  }

 private:
  estimator::RtkEstimator<estimator::RtkConfig<Form>> estimator_;
};

}  // namespace searvins::examples
