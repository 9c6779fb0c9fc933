// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// What stands behind the wall of stereo_under_test.hpp; for the two files that instantiate it.
#pragma once

#include "estimator/stereo_under_test.hpp"

namespace searvins::test {

template <class Camera>
struct CameraEstimatorUnderTest<Camera>::Impl {
  estimator::Estimator<robust::LatentPivotSymmetric, StereoTestCapacity, Motion> estimator;
  explicit Impl(const Options& options) : estimator(options) {}
};

template <class Camera>
CameraEstimatorUnderTest<Camera>::CameraEstimatorUnderTest(const Options& options) : impl_(std::make_unique<Impl>(options)) {}
template <class Camera>
CameraEstimatorUnderTest<Camera>::~CameraEstimatorUnderTest() = default;

template <class Camera>
Status CameraEstimatorUnderTest<Camera>::add_ephemeris(const gnss::Ephemeris& e) { return impl_->estimator.add_ephemeris(e); }
template <class Camera>
void CameraEstimatorUnderTest<Camera>::set_ionosphere(const gnss::KlobucharCoefficients& k) { impl_->estimator.set_ionosphere(k); }
template <class Camera>
Status CameraEstimatorUnderTest<Camera>::set_base_position(const Eigen::Vector3d& position_e_m) { return impl_->estimator.set_base_position(position_e_m); }
template <class Camera>
Status CameraEstimatorUnderTest<Camera>::add_imu(const imu::ImuSample& sample) { return impl_->estimator.add_imu(sample); }
template <class Camera>
Status CameraEstimatorUnderTest<Camera>::add_base(const gnss::ObservationEpoch& epoch) { return impl_->estimator.add_base(epoch); }
template <class Camera>
Status CameraEstimatorUnderTest<Camera>::add_rover(const gnss::ObservationEpoch& epoch) { return impl_->estimator.add_rover(epoch); }
template <class Camera>
Status CameraEstimatorUnderTest<Camera>::add_stereo(const Frame& frame) { return impl_->estimator.add_stereo(frame); }
template <class Camera>
void CameraEstimatorUnderTest<Camera>::finish() { impl_->estimator.finish(); }
template <class Camera>
Result<estimator::RtkSolution> CameraEstimatorUnderTest<Camera>::next() { return impl_->estimator.next(); }
template <class Camera>
int CameraEstimatorUnderTest<Camera>::alignments() const { return impl_->estimator.alignments(); }
template <class Camera>
long CameraEstimatorUnderTest<Camera>::refused_frames() const { return impl_->estimator.refused_frames(); }
template <class Camera>
const typename CameraEstimatorUnderTest<Camera>::Motion& CameraEstimatorUnderTest<Camera>::motion() const { return impl_->estimator.inertial().motion(); }

}  // namespace searvins::test
