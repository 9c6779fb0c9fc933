// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// A drive along given positions: a uniform B-spline of degree five whose control points are the positions, every half second.
///
/// Such a spline smooths: it passes near its control points, not through them, and its fourth derivative is continuous. On the i-th
/// interval, u in [0, 1), with the weights w^d of degree d
///
///     p = sum_j w^5_j(u) c_(i+j)      dp/dt = sum_j w^4_j(u) (c_(i+j+1) - c_(i+j)) / h      and again for the second derivative
///     w^d_j = ((u + d - j) w^(d-1)_(j-1) + (j + 1 - u) w^(d-1)_j) / d                        w^0_0 = 1
///
/// The heading is that of the motion, held where the vehicle stands, as a spline of its own.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include "path_motion.hpp"

namespace searvins::simulator {

/// A given position: seconds since the start, east, north, up.
struct GivenPoint {
  double t_s{0};
  Eigen::Vector3d p_w_m{Eigen::Vector3d::Zero()};
};

/// The weights of degree D at u.
template <std::size_t D>
[[nodiscard]] std::array<double, D + 1> spline_weights(double u) {
  std::array<double, D + 1> w{1};
  for (std::size_t d = 1; d <= D; ++d)
    for (std::size_t j = d + 1; j-- > 0;) {
      const double before = j > 0 ? w[j - 1] : 0, same = j < d ? w[j] : 0, degree = static_cast<double>(d), at = static_cast<double>(j);
      w[j] = ((u + degree - at) * before + (at + 1 - u) * same) / degree;
    }
  return w;
}

/// Value and two derivatives at a time.
struct SplineValue {
  Eigen::Vector3d value, rate, acceleration;
};

/// A uniform spline of degree five; before its first and after its last control point it is constant.
class Spline {
 public:
  Spline() = default;
  Spline(std::vector<Eigen::Vector3d> points, double step_s) : step_s_(step_s), points_(std::move(points)) {}

  [[nodiscard]] SplineValue at(double t_s) const {
    const double scaled = std::clamp(t_s / step_s_, -10.0, static_cast<double>(points_.size()) + 10), floor = std::floor(scaled);
    const auto w5 = spline_weights<5>(scaled - floor);
    const auto w4 = spline_weights<4>(scaled - floor);
    const auto w3 = spline_weights<3>(scaled - floor);
    const long first = static_cast<long>(floor) - 2;
    SplineValue s{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
    for (long j = 0; j < 6; ++j) s.value += w5[static_cast<std::size_t>(j)] * point(first + j);
    for (long j = 0; j < 5; ++j) s.rate += w4[static_cast<std::size_t>(j)] / step_s_ * (point(first + j + 1) - point(first + j));
    for (long j = 0; j < 4; ++j)
      s.acceleration +=
          w3[static_cast<std::size_t>(j)] / (step_s_ * step_s_) * (point(first + j + 2) - 2 * point(first + j + 1) + point(first + j));
    return s;
  }

 private:
  [[nodiscard]] const Eigen::Vector3d& point(long i) const {
    return points_[static_cast<std::size_t>(std::clamp<long>(i, 0, static_cast<long>(points_.size()) - 1))];
  }
  double step_s_{1};
  std::vector<Eigen::Vector3d> points_;
};

/// A drive along given points, rising in time; at least two.
class SplineRoute {
 public:
  explicit SplineRoute(const std::vector<GivenPoint>& given) {
    std::vector<Eigen::Vector3d> points;
    std::size_t next = 1;
    for (double t = given.front().t_s; t <= given.back().t_s; t += kStepS) {
      while (next + 1 < given.size() && given[next].t_s < t) ++next;
      const GivenPoint &a = given[next - 1], &b = given[next];
      points.emplace_back(a.p_w_m + (t - a.t_s) / (b.t_s - a.t_s) * (b.p_w_m - a.p_w_m));
    }
    begin_s_ = given.front().t_s, end_s_ = given.back().t_s;
    headings_ = Spline{headings_along(points), kStepS};
    places_ = Spline{std::move(points), kStepS};
  }

  [[nodiscard]] PathMotion at(double t_s) const {
    const SplineValue s = places_.at(t_s - begin_s_);
    return {s.value.head<2>(), s.rate.head<2>(), s.acceleration.head<2>(), headings_.at(t_s - begin_s_).value.x()};
  }
  /// Height with its two derivatives.
  [[nodiscard]] Eigen::Vector3d height_at(double t_s) const {
    const SplineValue s = places_.at(t_s - begin_s_);
    return {s.value.z(), s.rate.z(), s.acceleration.z()};
  }
  [[nodiscard]] double end_s() const { return end_s_; }

 private:
  static constexpr double kStepS = 0.5, kCourseFromM = 0.75;  // a course is taken from moves of this size in a step

  /// Headings without jumps of a turn; where the vehicle stands the one before holds, at the start the first that is known.
  [[nodiscard]] static std::vector<Eigen::Vector3d> headings_along(const std::vector<Eigen::Vector3d>& points) {
    std::vector<Eigen::Vector3d> headings(points.size(), Eigen::Vector3d::Zero());
    double heading = 0;
    std::size_t known = points.size();
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Eigen::Vector3d move = points[std::min(i + 1, points.size() - 1)] - points[i > 0 ? i - 1 : 0];
      if (move.head<2>().norm() > 2 * kCourseFromM) {
        const double course = std::atan2(move.x(), move.y());
        heading = known == points.size() ? course : heading + std::remainder(course - heading, 2 * std::numbers::pi);
        known = std::min(known, i);
      }
      headings[i].x() = heading;
    }
    for (std::size_t i = 0; i < known && known < points.size(); ++i) headings[i] = headings[known];
    return headings;
  }

  double begin_s_{0}, end_s_{0};
  Spline places_, headings_;
};

}  // namespace searvins::simulator
