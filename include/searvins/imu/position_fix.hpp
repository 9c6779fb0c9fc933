// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// A position that another program or receiver computed, with its covariance: the measurement of the loosely coupled mode.
#pragma once

#include <Eigen/Core>

#include <limits>

#include <searvins/core/time.hpp>

namespace searvins::imu {

/// The antenna's position, and its velocity where the source has one.
struct PositionFix {
  GpsTime time{};
  Eigen::Vector3d position_e_m{Eigen::Vector3d::Zero()};        ///< antenna phase centre, ECEF
  Eigen::Matrix3d covariance_e_m2{Eigen::Matrix3d::Identity()};  ///< of the position, ECEF
  int quality{0};     ///< RTKLIB's number: 1 fix, 2 float, 3 sbas, 4 dgps, 5 single, 6 ppp, 7 dead reckoning
  int satellites{-1};  ///< -1: not known
  bool covariance_assumed{false};  ///< the source gave none: the covariance is a guess from the quality
  Eigen::Vector3d velocity_e_mps{Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN())};  ///< ECEF; NaN: none
  double sigma_velocity_mps{0};                                                                           ///< of each axis

  [[nodiscard]] bool has_velocity() const { return velocity_e_mps.allFinite() && sigma_velocity_mps > 0; }
};

}  // namespace searvins::imu
