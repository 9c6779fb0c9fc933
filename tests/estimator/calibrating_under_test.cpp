// SPDX-License-Identifier: BSD-3-Clause
#include "calibrating_under_test.hpp"

namespace searvins::test {

struct CalibratingUnderTest::Impl {
  using Motion = estimator::StereoInertialMotion<imu::RotatingEarth, 128, 768, estimator::CalibratedCamera>;
  estimator::Estimator<robust::LatentPivotSymmetric, StereoTestCapacity, Motion> estimator;
  explicit Impl(const Options& options) : estimator(options) {}
};

CalibratingUnderTest::CalibratingUnderTest(const Options& options) : impl_(std::make_unique<Impl>(options)) {}
CalibratingUnderTest::~CalibratingUnderTest() = default;

Status CalibratingUnderTest::add_ephemeris(const gnss::Ephemeris& e) { return impl_->estimator.add_ephemeris(e); }
void CalibratingUnderTest::set_ionosphere(const gnss::KlobucharCoefficients& k) { impl_->estimator.set_ionosphere(k); }
Status CalibratingUnderTest::set_base_position(const Eigen::Vector3d& position_e_m) { return impl_->estimator.set_base_position(position_e_m); }
Status CalibratingUnderTest::add_imu(const imu::ImuSample& sample) { return impl_->estimator.add_imu(sample); }
Status CalibratingUnderTest::add_base(const gnss::ObservationEpoch& epoch) { return impl_->estimator.add_base(epoch); }
Status CalibratingUnderTest::add_rover(const gnss::ObservationEpoch& epoch) { return impl_->estimator.add_rover(epoch); }
Status CalibratingUnderTest::add_stereo(const Frame& frame) { return impl_->estimator.add_stereo(frame); }
void CalibratingUnderTest::finish() { impl_->estimator.finish(); }
Result<estimator::RtkSolution> CalibratingUnderTest::next() { return impl_->estimator.next(); }
int CalibratingUnderTest::alignments() const { return impl_->estimator.alignments(); }
const vision::CameraCorrectionEstimate& CalibratingUnderTest::correction() const { return impl_->estimator.inertial().motion().camera().estimate(); }

}  // namespace searvins::test
