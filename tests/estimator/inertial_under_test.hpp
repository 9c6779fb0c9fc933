// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The estimator with an inertial unit behind a compiled wall: its template is instantiated once for all tests of this folder
/// (inertial_under_test.cpp), with the symmetric latent form and the capacities of rtk_under_test.hpp.
#pragma once

#include <memory>

#include <searvins/estimator/estimator.hpp>
#include <searvins/gnss/ephemeris.hpp>
#include <searvins/gnss/observation.hpp>

#include "estimator/rtk_under_test.hpp"

namespace searvins::test {

/// estimator::Estimator<robust::LatentPivotSymmetric, TestCapacity>; its functions by their names.
class InertialUnderTest {
 public:
  explicit InertialUnderTest(const estimator::EstimatorOptions& options);
  ~InertialUnderTest();
  /// A copy goes on by itself: so one run serves for many outages.
  InertialUnderTest(const InertialUnderTest& other);
  InertialUnderTest(InertialUnderTest&&) noexcept;
  InertialUnderTest& operator=(const InertialUnderTest&) = delete;
  InertialUnderTest& operator=(InertialUnderTest&&) noexcept;

  Status add_ephemeris(const gnss::Ephemeris& e);
  void set_ionosphere(const gnss::KlobucharCoefficients& k);
  Status set_base_position(const Eigen::Vector3d& position_e_m);
  Status set_heading(double heading_rad, double sigma_rad);
  void set_centrelines(imu::Centrelines lines);
  Status add_imu(const imu::ImuSample& sample);
  Status add_base(const gnss::ObservationEpoch& epoch);
  Status add_rover(const gnss::ObservationEpoch& epoch);
  Status add_position(const imu::PositionFix& fix);
  void finish();
  Result<estimator::RtkSolution> next();
  [[nodiscard]] Result<estimator::RtkSolution> predict(GpsTime time) const;
  [[nodiscard]] bool is_aligned() const;
  [[nodiscard]] imu::AlignmentState alignment_state() const;
  [[nodiscard]] const char* waiting_text() const;
  [[nodiscard]] int alignments() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace searvins::test
