// SPDX-License-Identifier: BSD-3-Clause
#include "rtk_under_test.hpp"

#include <searvins/estimator/rtk_estimator.hpp>
#include <searvins/estimator/rtk_problem.hpp>

namespace searvins::test {

struct RtkUnderTest::Impl {
  estimator::RtkEstimator<estimator::RtkConfig<robust::LatentPivotSymmetric, TestCapacity>> estimator;
  explicit Impl(const estimator::RtkOptions& options) : estimator(options) {}
};

RtkUnderTest::RtkUnderTest(const estimator::RtkOptions& options) : impl_(std::make_unique<Impl>(options)) {}
RtkUnderTest::~RtkUnderTest() = default;
RtkUnderTest::RtkUnderTest(RtkUnderTest&&) noexcept = default;
RtkUnderTest& RtkUnderTest::operator=(RtkUnderTest&&) noexcept = default;

Status RtkUnderTest::add_ephemeris(const gnss::Ephemeris& e) { return impl_->estimator.add_ephemeris(e); }
void RtkUnderTest::set_ionosphere(const gnss::KlobucharCoefficients& k) { impl_->estimator.set_ionosphere(k); }
Status RtkUnderTest::set_base_position(const Eigen::Vector3d& position_e_m) { return impl_->estimator.set_base_position(position_e_m); }
Status RtkUnderTest::add_base(const gnss::ObservationEpoch& epoch) { return impl_->estimator.add_base(epoch); }
Result<estimator::RtkSolution> RtkUnderTest::update(const gnss::ObservationEpoch& rover) { return impl_->estimator.update(rover); }
const gnss::DifferencedEpoch& RtkUnderTest::differenced() const { return impl_->estimator.differenced(); }
Result<Eigen::Vector3d> RtkUnderTest::oldest_e_m() const {
  const auto state = impl_->estimator.oldest();
  if (!state.ok()) return state.status();
  return state->position_e_m;
}

}  // namespace searvins::test
