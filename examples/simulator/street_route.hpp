// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// A generated drive on a grid of streets: straight blocks, quarter turns, stops at lights.
///
/// With the smooth step w(x) = 10 x^3 - 15 x^4 + 6 x^5 (w' and w'' vanish at both ends, w' <= 1.875):
///
///     turn of angle D over the length L      heading = heading_0 + D w(s / L)              curvature <= 1.875 D / L
///     change of speed by dv during T         v = v_0 + dv w(t / T)                          acceleration <= 1.875 dv / T
///                                            s = v_0 t + dv T (2.5 x^4 - 3 x^5 + x^6)       over the whole: (v_0 + v_1) T / 2
///
/// so place, velocity and acceleration are closed forms of time but for the place inside a turn, an integral by Simpson's rule. The
/// acceleration is continuously differentiable. A quarter turn is symmetric: it leaves the first street as far before the crossing as it
/// enters the other after it.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <numbers>
#include <set>
#include <utility>
#include <vector>

#include "path_motion.hpp"
#include "random.hpp"

namespace searvins::simulator {

/// What the drive keeps to.
struct DriveLimits {
  double max_speed_mps{14}, min_cruise_mps{8};
  double accelerate_mps2{1.8}, brake_mps2{2.2}, lateral_mps2{2.3}, min_ramp_s{1.2};
  double turn_length_m{27}, stop_share{0.28}, min_wait_s{5}, max_wait_s{30};
  double first_wait_s{20};  ///< standing at the start
};

namespace detail {

[[nodiscard]] inline double smooth_step(double x) { return x * x * x * (10 + x * (-15 + 6 * x)); }
[[nodiscard]] inline double smooth_slope(double x) { return 30 * x * x * (1 - x) * (1 - x); }

/// Integral of f from 0 to `to` by Simpson's rule.
template <class F>
[[nodiscard]] Eigen::Vector2d simpson(double to, const F& f) {
  constexpr int kIntervals = 32;
  const double step = to / kIntervals;
  Eigen::Vector2d sum = f(0.0) + f(to);
  for (int i = 1; i < kIntervals; ++i) sum += (i % 2 == 1 ? 4 : 2) * f(i * step);
  return step / 3 * sum;
}

}  // namespace detail

/// A stretch of the way with a smooth change of heading (none: straight).
struct WayPiece {
  double begin_m{0}, length_m{0}, heading_rad{0}, turn_rad{0};
  Eigen::Vector2d p_m{Eigen::Vector2d::Zero()};

  [[nodiscard]] double heading_at(double s_m) const { return heading_rad + turn_rad * detail::smooth_step(s_m / length_m); }
  [[nodiscard]] double curvature_at(double s_m) const { return turn_rad / length_m * detail::smooth_slope(s_m / length_m); }
  [[nodiscard]] Eigen::Vector2d place_at(double s_m) const {
    if (turn_rad == 0) return p_m + s_m * Eigen::Vector2d{std::sin(heading_rad), std::cos(heading_rad)};
    return p_m + detail::simpson(s_m, [this](double s) { return Eigen::Vector2d{std::sin(heading_at(s)), std::cos(heading_at(s))}; });
  }
};

/// A stretch of time with a smooth change of speed (none: cruising or standing).
struct SpeedPiece {
  double begin_s{0}, duration_s{0}, begin_m{0}, speed_mps{0}, change_mps{0};

  [[nodiscard]] double way_at(double t_s) const {
    const double x = t_s / duration_s;
    return begin_m + speed_mps * t_s + change_mps * duration_s * x * x * x * x * (2.5 + x * (x - 3));
  }
  [[nodiscard]] double speed_at(double t_s) const { return speed_mps + change_mps * detail::smooth_step(t_s / duration_s); }
  [[nodiscard]] double acceleration_at(double t_s) const { return change_mps / duration_s * detail::smooth_slope(t_s / duration_s); }
};

/// A drive of at least a given duration; before its start and after its end the vehicle stands.
class StreetRoute {
 public:
  StreetRoute(double duration_s, Random& random, const DriveLimits& limits = {}) : limits_(limits) {
    lay_streets(random);
    turn_offset_m_ = quarter_turn_offset_m(limits_.turn_length_m);
    turn_speed_mps_ = std::sqrt(limits_.lateral_mps2 * limits_.turn_length_m / (1.875 * std::numbers::pi / 2));
    wait(limits_.first_wait_s);
    while (ways_.empty() || time_s_ < duration_s) drive_block(random);  // a first wait may fill a short drive
    approach(way_m_, 0);
  }

  [[nodiscard]] PathMotion at(double t_s) const {
    const SpeedPiece& now = piece(speeds_, t_s, &SpeedPiece::begin_s);
    const double dt_s = std::clamp(t_s - now.begin_s, 0.0, now.duration_s);
    const double s_m = now.way_at(dt_s), v = now.speed_at(dt_s), a = now.acceleration_at(dt_s);
    const WayPiece& here = piece(ways_, s_m, &WayPiece::begin_m);
    const double ds_m = std::clamp(s_m - here.begin_m, 0.0, here.length_m);
    const double heading = here.heading_at(ds_m);
    const Eigen::Vector2d forward{std::sin(heading), std::cos(heading)}, right{std::cos(heading), -std::sin(heading)};
    return {here.place_at(ds_m), v * forward, a * forward + v * v * here.curvature_at(ds_m) * right, heading};
  }

  [[nodiscard]] double end_s() const { return time_s_; }

 private:
  static constexpr int kStreets = 15;  // in each direction

  template <class Piece>
  [[nodiscard]] static const Piece& piece(const std::vector<Piece>& all, double at, double Piece::*begin) {
    const auto after = std::upper_bound(all.begin(), all.end(), at, [begin](double x, const Piece& p) { return x < p.*begin; });
    return after == all.begin() ? all.front() : *(after - 1);
  }

  /// How far from the crossing a quarter turn begins and ends, metres.
  [[nodiscard]] static double quarter_turn_offset_m(double length_m) {
    return WayPiece{0, length_m, 0, std::numbers::pi / 2, Eigen::Vector2d::Zero()}.place_at(length_m).y();
  }

  void lay_streets(Random& random) {
    for (auto* streets : {&east_m_, &north_m_}) {
      double at = 0;
      for (double& street : *streets) street = at, at += random.uniform(80, 140);
      const double middle = (*streets)[kStreets / 2];
      for (double& street : *streets) street -= middle;
    }
  }

  void wait(double duration_s) {
    speeds_.push_back({time_s_, duration_s, driven_m_, 0, 0});
    time_s_ += duration_s;
  }
  void ramp(double to_mps) {
    const double duration_s = ramp_time_s(speed_mps_, to_mps);
    if (duration_s == 0) return;
    speeds_.push_back({time_s_, duration_s, driven_m_, speed_mps_, to_mps - speed_mps_});
    time_s_ += duration_s, driven_m_ += (speed_mps_ + to_mps) / 2 * duration_s, speed_mps_ = to_mps;
  }
  /// Small changes take their time, too: that bounds the jerk.
  [[nodiscard]] double ramp_time_s(double from_mps, double to_mps) const {
    if (from_mps == to_mps) return 0;
    const double limit = to_mps > from_mps ? limits_.accelerate_mps2 : limits_.brake_mps2;
    return std::max(1.875 * std::abs(to_mps - from_mps) / limit, limits_.min_ramp_s);
  }
  [[nodiscard]] double ramp_length_m(double from_mps, double to_mps) const {
    return (from_mps + to_mps) / 2 * ramp_time_s(from_mps, to_mps);
  }

  /// Drives on to `to_m` of the way and passes it at `end_mps`: as near to the cruising speed in between as the length allows.
  void approach(double to_m, double end_mps) {
    const double length_m = to_m - driven_m_;
    double low = std::max(speed_mps_, end_mps), high = std::max(low, cruise_mps_);
    const auto needed_m = [&](double peak) { return ramp_length_m(speed_mps_, peak) + ramp_length_m(peak, end_mps); };
    if (needed_m(high) <= length_m) low = high;
    for (int i = 0; i < 50; ++i) (needed_m((low + high) / 2) <= length_m ? low : high) = (low + high) / 2;
    ramp(low);
    const double cruise_m = to_m - ramp_length_m(low, end_mps) - driven_m_;
    if (cruise_m > 1e-6) {
      speeds_.push_back({time_s_, cruise_m / speed_mps_, driven_m_, speed_mps_, 0});
      time_s_ += cruise_m / speed_mps_, driven_m_ += cruise_m;
    }
    ramp(end_mps);
  }

  void add_way(double length_m, double turn_rad) {
    ways_.push_back({way_m_, length_m, heading_rad(), turn_rad, place_});
    place_ = ways_.back().place_at(length_m);
    way_m_ += length_m;
  }
  [[nodiscard]] double heading_rad() const { return quarter_ * std::numbers::pi / 2; }

  using Block = std::array<int, 4>;
  [[nodiscard]] static Block block_between(int x0, int y0, int x1, int y1) {
    return std::pair{x0, y0} < std::pair{x1, y1} ? Block{x0, y0, x1, y1} : Block{x1, y1, x0, y0};
  }

  /// To the next crossing, and over it or round the corner.
  void drive_block(Random& random) {
    constexpr std::array<int, 4> kEast{0, 1, 0, -1}, kNorth{1, 0, -1, 0};
    const auto step_of = [&](int quarter) { return static_cast<std::size_t>(((quarter % 4) + 4) % 4); };
    const std::size_t side = step_of(quarter_);
    const int i = column_ + kEast[side], k = row_ + kNorth[side];
    const double block_m = std::abs(east_m_[static_cast<std::size_t>(i)] - east_m_[static_cast<std::size_t>(column_)]) +
                           std::abs(north_m_[static_cast<std::size_t>(k)] - north_m_[static_cast<std::size_t>(row_)]);
    const int column_before = column_, row_before = row_;
    column_ = i, row_ = k;
    driven_.insert(block_between(column_before, row_before, i, k));
    // The way that is drawn, else one that is new, else one that stays on the map.
    const auto leads = [&](int turn, bool to_new) {
      const std::size_t s = step_of(quarter_ + turn);
      const int x = i + kEast[s], y = k + kNorth[s];
      return x >= 0 && x < kStreets && y >= 0 && y < kStreets && !(to_new && driven_.contains(block_between(i, k, x, y)));
    };
    const double draw = random.uniform(0, 1);
    const int drawn = draw < 0.56 ? 0 : draw < 0.79 ? 1 : -1;
    int turn = 2;
    for (const bool to_new : {true, false})
      for (const int choice : {drawn, 0, 1, -1})
        if (turn == 2 && leads(choice, to_new)) turn = choice;
    cruise_mps_ = random.uniform(limits_.min_cruise_mps, limits_.max_speed_mps);
    const bool stops = random.uniform(0, 1) < limits_.stop_share;
    const double wait_s = random.uniform(limits_.min_wait_s, limits_.max_wait_s);

    const double straight_m = block_m - behind_crossing_m_ - (turn == 0 ? 0 : turn_offset_m_);
    add_way(straight_m, 0);
    if (stops) approach(way_m_ - kStopBeforeM, 0), wait(wait_s);
    behind_crossing_m_ = 0;
    if (turn == 0) return;
    approach(way_m_, turn_speed_mps_);
    add_way(limits_.turn_length_m, turn * std::numbers::pi / 2);
    quarter_ += turn;
    behind_crossing_m_ = turn_offset_m_;
    const double cruise = cruise_mps_;
    cruise_mps_ = turn_speed_mps_;
    approach(way_m_, turn_speed_mps_);
    cruise_mps_ = cruise;
  }

  static constexpr double kStopBeforeM = 13;  // enough to reach the speed of a turn

  DriveLimits limits_;
  std::array<double, kStreets> east_m_{}, north_m_{};
  double turn_offset_m_{0}, turn_speed_mps_{0};
  std::vector<WayPiece> ways_;
  std::vector<SpeedPiece> speeds_;
  std::set<Block> driven_;
  // Where planning has come to: on the map, along the way, in time.
  int column_{kStreets / 2}, row_{kStreets / 2}, quarter_{0};
  double behind_crossing_m_{0}, way_m_{0};
  Eigen::Vector2d place_{Eigen::Vector2d::Zero()};
  double time_s_{0}, driven_m_{0}, speed_mps_{0}, cruise_mps_{10};
};

}  // namespace searvins::simulator
