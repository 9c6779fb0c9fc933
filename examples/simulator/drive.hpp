// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The drive of the simulated vehicle: legs with smooth changes of speed and heading, integrated to positions.
///
/// Within a leg speed and heading go from their old to their new value along 3 x^2 - 2 x^3, so acceleration and turn rate are continuous.
/// Position is the integral of v [sin h, cos h] by Simpson's rule on a grid of 10 ms, from the grid point before (error below 1e-9 m).
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>
#include <vector>

namespace searvins::simulator {

/// One leg of the drive.
struct Leg {
  double duration_s, end_speed_mps, turn_deg;  ///< turn to the right is positive
};

/// A drive from the origin of a local East-North-Up frame, first heading north-east; before its start the vehicle stands.
class Drive {
 public:
  explicit Drive(std::vector<Leg> legs) : legs_(std::move(legs)) {
    double total_s = 0;
    for (const Leg& leg : legs_) total_s += leg.duration_s;
    const auto steps = static_cast<std::size_t>(std::ceil((total_s + 10) / kStepS));
    grid_.assign(1, Eigen::Vector2d::Zero());
    for (std::size_t i = 0; i < steps; ++i)
      grid_.push_back(grid_.back() + advance(static_cast<double>(i) * kStepS, static_cast<double>(i + 1) * kStepS));
  }

  /// East, north, up at t, metres; the road climbs gently with its way north.
  [[nodiscard]] Eigen::Vector3d position_w_m(double t_s) const {
    const double t = std::max(t_s, 0.0);
    const std::size_t i = std::min(static_cast<std::size_t>(t / kStepS), grid_.size() - 1);
    const Eigen::Vector2d p = grid_[i] + advance(static_cast<double>(i) * kStepS, t);
    return {p.x(), p.y(), 3 * std::sin(p.y() / 200)};
  }

  /// Heading, radians clockwise from north.
  [[nodiscard]] double heading_rad(double t_s) const { return motion(t_s).heading_rad; }

 private:
  static constexpr double kStepS = 0.01;
  struct Motion {
    double speed_mps, heading_rad;
  };

  [[nodiscard]] Motion motion(double t_s) const {
    double speed = 0, heading_deg = 45, begin_s = 0;
    for (const Leg& leg : legs_) {
      const double x = std::clamp((t_s - begin_s) / leg.duration_s, 0.0, 1.0), part = x * x * (3 - 2 * x);
      speed += part * (leg.end_speed_mps - speed);
      heading_deg += part * leg.turn_deg;
      begin_s += leg.duration_s;
      if (t_s < begin_s) break;
    }
    return {speed, heading_deg * std::numbers::pi / 180};
  }

  [[nodiscard]] Eigen::Vector2d velocity(double t_s) const {
    const Motion m = motion(t_s);
    return {m.speed_mps * std::sin(m.heading_rad), m.speed_mps * std::cos(m.heading_rad)};
  }

  [[nodiscard]] Eigen::Vector2d advance(double from_s, double to_s) const {
    return (to_s - from_s) / 6 * (velocity(from_s) + 4 * velocity((from_s + to_s) / 2) + velocity(to_s));
  }

  std::vector<Leg> legs_;
  std::vector<Eigen::Vector2d> grid_;
};

}  // namespace searvins::simulator
