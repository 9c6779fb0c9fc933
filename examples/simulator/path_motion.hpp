// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Motion along a way, seen from above: what a route of the simulator gives for a time.
#pragma once

#include <Eigen/Core>

namespace searvins::simulator {

/// Place and motion in the horizontal plane (east, north); the heading also holds while standing.
struct PathMotion {
  Eigen::Vector2d p_m{Eigen::Vector2d::Zero()}, v_mps{Eigen::Vector2d::Zero()}, a_mps2{Eigen::Vector2d::Zero()};
  double heading_rad{0};  ///< clockwise from north
};

}  // namespace searvins::simulator
