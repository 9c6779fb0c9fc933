// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// A position that another program or receiver computed, with its covariance: the measurement of the loosely coupled mode.
#pragma once

#include <Eigen/Core>

#include <limits>

#include <searvins/core/time.hpp>

namespace searvins::imu {

/// The antenna's position, and its velocity where the source has one. Scalar: double or wider.
template <class Scalar>
struct BasicPositionFix {
  using Vector3 = Eigen::Matrix<Scalar, 3, 1>;
  using Matrix3 = Eigen::Matrix<Scalar, 3, 3>;

  GpsTime time{};
  Vector3 position_e_m{Vector3::Zero()};         ///< antenna phase centre, ECEF
  Matrix3 covariance_e_m2{Matrix3::Identity()};  ///< of the position, ECEF
  int quality{0};     ///< RTKLIB's number: 1 fix, 2 float, 3 sbas, 4 dgps, 5 single, 6 ppp, 7 dead reckoning
  int satellites{-1};  ///< -1: not known
  bool covariance_assumed{false};  ///< the source gave none: the covariance is a guess from the quality
  Vector3 velocity_e_mps{Vector3::Constant(std::numeric_limits<Scalar>::quiet_NaN())};  ///< ECEF; NaN: none
  Scalar sigma_velocity_mps{0};                                                         ///< of each axis

  [[nodiscard]] bool has_velocity() const { return velocity_e_mps.allFinite() && sigma_velocity_mps > 0; }
};
using PositionFix = BasicPositionFix<double>;  ///< in double precision

}  // namespace searvins::imu
