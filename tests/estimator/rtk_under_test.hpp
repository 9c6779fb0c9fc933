// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The RTK estimator behind a compiled wall: its template is instantiated once for all tests of this folder (rtk_under_test.cpp), with the
/// symmetric latent form and the capacities below.
#pragma once

#include <cstddef>
#include <memory>

#include <searvins/estimator/rtk_options.hpp>
#include <searvins/estimator/rtk_solution.hpp>
#include <searvins/gnss/base_buffer.hpp>
#include <searvins/gnss/differenced_epoch.hpp>
#include <searvins/gnss/ephemeris.hpp>

namespace searvins::test {

/// 24 states and 64 phases: 1 Hz recordings fit, and a fast recording overflows it on purpose.
struct TestCapacity {
  static constexpr int states = 24;
  static constexpr int phases_per_epoch = 64;
  static constexpr int candidates = 24;
  static constexpr int doppler_candidates = 48;
  static constexpr int batches = 240;
  static constexpr int ambiguities = 1536;
  static constexpr int fixes = 1024;
  static constexpr int max_front_dimension = 300;
  static constexpr int member_capacity = 8192;
  static constexpr std::size_t arena_scalars = 1'200'000;
  static constexpr std::size_t ephemerides = 1024;
  static constexpr std::size_t base_epochs = 32;
};

/// estimator::RtkEstimator<RtkConfig<robust::LatentPivotSymmetric, TestCapacity>>.
class RtkUnderTest {
 public:
  explicit RtkUnderTest(const estimator::RtkOptions& options = {});
  ~RtkUnderTest();
  RtkUnderTest(RtkUnderTest&&) noexcept;
  RtkUnderTest& operator=(RtkUnderTest&&) noexcept;

  Status add_ephemeris(const gnss::Ephemeris& e);
  void set_ionosphere(const gnss::KlobucharCoefficients& k);
  Status set_base_position(const Eigen::Vector3d& position_e_m);
  Status add_base(const gnss::ObservationEpoch& epoch);
  Result<estimator::RtkSolution> update(const gnss::ObservationEpoch& rover);
  [[nodiscard]] const gnss::DifferencedEpoch& differenced() const;
  /// Position of the oldest epoch of the window; nothing while none runs.
  [[nodiscard]] Result<Eigen::Vector3d> oldest_e_m() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace searvins::test
