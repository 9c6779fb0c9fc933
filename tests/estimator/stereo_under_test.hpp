// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The estimator with an inertial unit and a stereo camera behind a compiled wall: instantiated once for the tests (stereo_under_test.cpp,
/// calibrating_under_test.cpp), with the symmetric latent form and the capacities below.
#pragma once

#include <cstddef>
#include <memory>

#include <searvins/estimator/camera_calibration.hpp>
#include <searvins/estimator/estimator.hpp>
#include <searvins/estimator/stereo_inertial_motion.hpp>

#include "estimator/rtk_under_test.hpp"

namespace searvins::test {

/// 7 s of ten frames and an epoch a second.
struct StereoTestCapacity : TestCapacity {
  using WithoutCamera = TestCapacity;
  static constexpr int states = 76;
  static constexpr int landmarks = 768;
  static constexpr int stereo_observations = 6144;
  static constexpr int max_front_dimension = 560;
  static constexpr int member_capacity = 16384;
  static constexpr std::size_t arena_scalars = 9'000'000;
};

/// estimator::Estimator<robust::LatentPivotSymmetric, StereoTestCapacity, Motion>; its functions and those of its motion by their names.
template <class Camera>
class CameraEstimatorUnderTest {
 public:
  using Motion = estimator::StereoInertialMotion<imu::RotatingEarth, 128, 768, Camera>;
  using Options = estimator::BasicEstimatorOptions<estimator::StereoInertialOptions>;
  using Frame = typename Motion::Frame;

  explicit CameraEstimatorUnderTest(const Options& options);
  ~CameraEstimatorUnderTest();

  Status add_ephemeris(const gnss::Ephemeris& e);
  void set_ionosphere(const gnss::KlobucharCoefficients& k);
  Status set_base_position(const Eigen::Vector3d& position_e_m);
  Status add_imu(const imu::ImuSample& sample);
  Status add_base(const gnss::ObservationEpoch& epoch);
  Status add_rover(const gnss::ObservationEpoch& epoch);
  Status add_stereo(const Frame& frame);
  void finish();
  Result<estimator::RtkSolution> next();
  [[nodiscard]] int alignments() const;
  [[nodiscard]] long refused_frames() const;
  [[nodiscard]] const Motion& motion() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

using StereoUnderTest = CameraEstimatorUnderTest<estimator::KnownCamera>;
using CalibratingUnderTest = CameraEstimatorUnderTest<estimator::CalibratedCamera>;
extern template class CameraEstimatorUnderTest<estimator::KnownCamera>;
extern template class CameraEstimatorUnderTest<estimator::CalibratedCamera>;

}  // namespace searvins::test
