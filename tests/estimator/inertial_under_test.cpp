// SPDX-License-Identifier: BSD-3-Clause
#include "inertial_under_test.hpp"

#include <searvins/estimator/estimator.hpp>

namespace searvins::test {

struct InertialUnderTest::Impl {
  estimator::Estimator<robust::LatentPivotSymmetric, TestCapacity> estimator;
  explicit Impl(const estimator::EstimatorOptions& options) : estimator(options) {}
};

InertialUnderTest::InertialUnderTest(const estimator::EstimatorOptions& options) : impl_(std::make_unique<Impl>(options)) {}
InertialUnderTest::~InertialUnderTest() = default;
InertialUnderTest::InertialUnderTest(const InertialUnderTest& other) : impl_(std::make_unique<Impl>(*other.impl_)) {}
InertialUnderTest::InertialUnderTest(InertialUnderTest&&) noexcept = default;
InertialUnderTest& InertialUnderTest::operator=(InertialUnderTest&&) noexcept = default;

Status InertialUnderTest::add_ephemeris(const gnss::Ephemeris& e) { return impl_->estimator.add_ephemeris(e); }
void InertialUnderTest::set_ionosphere(const gnss::KlobucharCoefficients& k) { impl_->estimator.set_ionosphere(k); }
Status InertialUnderTest::set_base_position(const Eigen::Vector3d& position_e_m) {
  return impl_->estimator.set_base_position(position_e_m);
}
Status InertialUnderTest::set_heading(double heading_rad, double sigma_rad) { return impl_->estimator.set_heading(heading_rad, sigma_rad); }
void InertialUnderTest::set_centrelines(imu::Centrelines lines) { impl_->estimator.set_centrelines(lines); }
Status InertialUnderTest::add_imu(const imu::ImuSample& sample) { return impl_->estimator.add_imu(sample); }
Status InertialUnderTest::add_base(const gnss::ObservationEpoch& epoch) { return impl_->estimator.add_base(epoch); }
Status InertialUnderTest::add_rover(const gnss::ObservationEpoch& epoch) { return impl_->estimator.add_rover(epoch); }
Status InertialUnderTest::add_position(const imu::PositionFix& fix) { return impl_->estimator.add_position(fix); }
void InertialUnderTest::finish() { impl_->estimator.finish(); }
Result<estimator::RtkSolution> InertialUnderTest::next() { return impl_->estimator.next(); }
Result<estimator::RtkSolution> InertialUnderTest::predict(GpsTime time) const { return impl_->estimator.predict(time); }
bool InertialUnderTest::is_aligned() const { return impl_->estimator.is_aligned(); }
imu::AlignmentState InertialUnderTest::alignment_state() const { return impl_->estimator.alignment_state(); }
const char* InertialUnderTest::waiting_text() const { return impl_->estimator.waiting_text(); }
int InertialUnderTest::alignments() const { return impl_->estimator.alignments(); }

}  // namespace searvins::test
