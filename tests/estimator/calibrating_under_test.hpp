// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The estimator that calibrates its camera behind a compiled wall (calibrating_under_test.cpp), with the capacities of stereo_under_test.hpp.
#pragma once

#include <memory>

#include <searvins/vision/camera_correction.hpp>

#include "estimator/stereo_under_test.hpp"

namespace searvins::test {

/// As StereoUnderTest, with estimator::CalibratedCamera; its functions by their names.
class CalibratingUnderTest {
 public:
  using Options = StereoUnderTest::Options;
  using Frame = StereoUnderTest::Frame;

  explicit CalibratingUnderTest(const Options& options);
  ~CalibratingUnderTest();

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
  [[nodiscard]] const vision::CameraCorrectionEstimate& correction() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace searvins::test
