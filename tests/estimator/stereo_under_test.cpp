// SPDX-License-Identifier: BSD-3-Clause
#include "stereo_under_test.hpp"

namespace searvins::test {

struct StereoUnderTest::Impl {
  estimator::Estimator<robust::LatentPivotSymmetric, StereoTestCapacity, StereoTestMotion> estimator;
  explicit Impl(const Options& options) : estimator(options) {}
};

StereoUnderTest::StereoUnderTest(const Options& options) : impl_(std::make_unique<Impl>(options)) {}
StereoUnderTest::~StereoUnderTest() = default;

Status StereoUnderTest::add_ephemeris(const gnss::Ephemeris& e) { return impl_->estimator.add_ephemeris(e); }
void StereoUnderTest::set_ionosphere(const gnss::KlobucharCoefficients& k) { impl_->estimator.set_ionosphere(k); }
Status StereoUnderTest::set_base_position(const Eigen::Vector3d& position_e_m) { return impl_->estimator.set_base_position(position_e_m); }
Status StereoUnderTest::add_imu(const imu::ImuSample& sample) { return impl_->estimator.add_imu(sample); }
Status StereoUnderTest::add_base(const gnss::ObservationEpoch& epoch) { return impl_->estimator.add_base(epoch); }
Status StereoUnderTest::add_rover(const gnss::ObservationEpoch& epoch) { return impl_->estimator.add_rover(epoch); }
Status StereoUnderTest::add_stereo(const Frame& frame) { return impl_->estimator.add_stereo(frame); }
void StereoUnderTest::finish() { impl_->estimator.finish(); }
Result<estimator::RtkSolution> StereoUnderTest::next() { return impl_->estimator.next(); }
int StereoUnderTest::alignments() const { return impl_->estimator.alignments(); }
long StereoUnderTest::refused_frames() const { return impl_->estimator.refused_frames(); }
const vision::AdmissionCounts& StereoUnderTest::counts() const { return impl_->estimator.inertial().motion().counts(); }
long StereoUnderTest::dropped_landmarks() const { return impl_->estimator.inertial().motion().dropped_landmarks(); }

}  // namespace searvins::test
