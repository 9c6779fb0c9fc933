// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Cars along the way: parked at both sides, coming towards the vehicle, and one that drives ahead of it.
///
/// A place on the way is its coordinate c (metres from its first point) and how far right of the middle. The car k of the oncoming stream
/// is at c = 42 k + (its share of 14) - v t; as many as are near are listed, those of other streets are not. The car ahead keeps
/// 14 to 60 m, a slow wave of the vehicle's own coordinate, so it waits when the vehicle waits.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <vector>

#include "city.hpp"
#include "facet.hpp"
#include "hash.hpp"

namespace searvins::simulator {

/// A car at a time: middle of its underside on the road, direction, and which kind of car it is.
struct Car {
  Eigen::Vector3d place_m;
  Eigen::Vector2d forward;
  std::uint64_t kind{0};
};

/// Where cars are.
class Traffic {
 public:
  static constexpr double kParkedAsideM = 4.9, kOncomingAsideM = -3.3, kOncomingMps = 9;

  Traffic(const std::vector<WayPoint>& way, std::uint64_t seed) : way_(way), seed_(scrambled(seed ^ 0x54524146)) {}

  /// Those that never move. Nothing stands where the way comes by again.
  [[nodiscard]] std::vector<Car> parked() const {
    WayIndex index;
    for (std::size_t i = 0; i < way_.size(); ++i) index.add(way_[i].p_m, i);
    std::vector<Car> all;
    for (const double side : {-1.0, 1.0})
      for (std::int64_t slot = 0; static_cast<double>(slot) * 7 < static_cast<double>(way_.size()); ++slot) {
        const std::int64_t key = 2 * slot + (side > 0 ? 1 : 0);
        if (uniform_at(seed_, key, 1) > 0.45) continue;
        const double at = 7 * static_cast<double>(slot) + uniform_at(seed_, key, 2);
        const Car car = car_at(at, side * kParkedAsideM, side, scrambled(seed_ + static_cast<std::uint64_t>(key)));
        const auto too_near = [&](double along_m) {
          const Eigen::Vector2d p = car.place_m.head<2>() + along_m * car.forward;
          return index.any_near(p, [&](std::size_t i) { return (way_[i].p_m - p).norm() < 3.4; });
        };
        if (!too_near(-2.5) && !too_near(0) && !too_near(2.5)) all.push_back(car);
      }
    return all;
  }

  /// Those that drive, as far as the vehicle at this time and place can see them.
  [[nodiscard]] std::vector<Car> moving(double t_s, const Eigen::Vector2d& vehicle_m) const {
    constexpr double kSpacingM = 42, kSeenM = 130;
    std::vector<Car> all;
    const double here = coordinate_of(t_s, vehicle_m), shifted = here + kOncomingMps * t_s;
    const auto first = static_cast<std::int64_t>(std::floor((shifted - 30) / kSpacingM));
    for (std::int64_t k = first; static_cast<double>(k) * kSpacingM < shifted + kSeenM; ++k) {
      if (uniform_at(seed_, k, 3) > 0.7) continue;
      const double at = kSpacingM * static_cast<double>(k) + 14 * uniform_at(seed_, k, 4) - kOncomingMps * t_s;
      add_if_on_way(at, kOncomingAsideM, -1, scrambled(seed_ ^ static_cast<std::uint64_t>(k)), all);
    }
    const double wave = std::sin(here * 2 * std::numbers::pi / 420 + 6 * uniform_at(seed_, 0, 5));
    add_if_on_way(here + 37 + 23 * wave, 0, 1, scrambled(seed_ ^ 0x41484541), all);
    return all;
  }

 private:
  /// The coordinate on the way of a place that the vehicle passes at a time.
  [[nodiscard]] double coordinate_of(double t_s, const Eigen::Vector2d& p_m) const {
    const auto after = std::upper_bound(way_.begin(), way_.end(), t_s, [](double t, const WayPoint& w) { return t < w.t_s; });
    const std::size_t i = after == way_.begin() ? 0 : static_cast<std::size_t>(after - way_.begin()) - 1;
    return static_cast<double>(i) + way_[i].forward.dot(p_m - way_[i].p_m);
  }

  [[nodiscard]] Car car_at(double at, double aside_m, double direction, std::uint64_t kind) const {
    const auto i = std::min(static_cast<std::size_t>(at), way_.size() - 1), k = std::min(i + 1, way_.size() - 1);
    const double share = at - static_cast<double>(i);
    const Eigen::Vector2d forward = (way_[i].forward + share * (way_[k].forward - way_[i].forward)).normalized();
    const Eigen::Vector2d p = way_[i].p_m + share * (way_[k].p_m - way_[i].p_m) + aside_m * Eigen::Vector2d{forward.y(), -forward.x()};
    const double ground_m = way_[i].ground_m + share * (way_[k].ground_m - way_[i].ground_m);
    return {{p.x(), p.y(), ground_m}, direction * forward, kind};
  }

  void add_if_on_way(double at, double aside_m, double direction, std::uint64_t kind, std::vector<Car>& all) const {
    if (at >= 0 && at + 1 < static_cast<double>(way_.size())) all.push_back(car_at(at, aside_m, direction, kind));
  }

  const std::vector<WayPoint>& way_;
  std::uint64_t seed_;
};

namespace traffic_detail {

/// Makes facets in the axes of a car (forward, left, up) from corners in its own coordinates.
struct CarFrame {
  Eigen::Vector3d place_m, forward, left;
  [[nodiscard]] Eigen::Vector3d operator()(double x, double y, double z) const {
    return place_m + x * forward + y * left + z * Eigen::Vector3d::UnitZ();
  }
};

/// A block with a lower rectangle [back, front] x [-wide, wide] at z0 and an upper one at z1: sides, ends, top.
inline void add_block(const CarFrame& at, const std::array<double, 4>& x, const std::array<double, 2>& wide, double z0, double z1,
                      const std::array<int, 3>& looks, float shade, std::vector<Facet>& out) {
  const auto [back, front, back_top, front_top] = x;
  const auto [w, w_top] = wide;
  using Corners = std::array<Eigen::Vector3d, 4>;
  const Corners right{at(back, -w, z0), at(front, -w, z0), at(front_top, -w_top, z1), at(back_top, -w_top, z1)};
  const Corners left{at(front, w, z0), at(back, w, z0), at(back_top, w_top, z1), at(front_top, w_top, z1)};
  const Corners ahead{at(front, -w, z0), at(front, w, z0), at(front_top, w_top, z1), at(front_top, -w_top, z1)};
  const Corners behind{at(back, w, z0), at(back, -w, z0), at(back_top, -w_top, z1), at(back_top, w_top, z1)};
  const Corners top{at(back_top, -w_top, z1), at(front_top, -w_top, z1), at(front_top, w_top, z1), at(back_top, w_top, z1)};
  const auto add = [&](const Corners& corners, int texture, int width, int height) {
    Facet f = facet_of(corners, SurfaceClass::vehicle);
    f.paint = layer_stretched(f, texture, width, height);
    f.grime = layer_along(f, PatternSet::kGrime);
    f.shade *= shade, f.reach_m = 130;
    out.push_back(f);
  };
  const bool glass = looks[0] == PatternSet::kCarGlass;
  for (const Corners& side : {right, left}) add(side, looks[0], glass ? 128 : 256, glass ? 32 : 64);
  for (const Corners& end : {ahead, behind}) add(end, looks[1], 128, glass ? 32 : 64);
  add(top, looks[2], 64, 64);
}

}  // namespace traffic_detail

/// The surfaces of a car: a saloon, or every fourth time a van; and its shadow, which the road carries.
inline void add_car(const Car& car, std::vector<Facet>& out) {
  const traffic_detail::CarFrame at{car.place_m, {car.forward.x(), car.forward.y(), 0}, {-car.forward.y(), car.forward.x(), 0}};
  const auto paint = static_cast<float>(0.35 + 0.85 * uniform_at(car.kind, 1));
  const double long_m = 2.0 + 0.35 * uniform_at(car.kind, 2);
  using P = PatternSet;
  const std::array<Eigen::Vector3d, 4> ground{at(-long_m - 0.1, -1, 0.02), at(long_m + 0.1, -1, 0.02), at(long_m + 0.1, 1, 0.02),
                                              at(-long_m - 0.1, 1, 0.02)};
  Facet shadow = facet_of(ground, SurfaceClass::road);
  shadow.paint = layer_along(shadow, P::kGrime), shadow.grime = shadow.paint;
  shadow.shade = 0.25F, shadow.reach_m = 60;
  out.push_back(shadow);
  if (uniform_at(car.kind, 3) < 0.25) {
    traffic_detail::add_block(at, {-long_m - 0.4, long_m + 0.4, -long_m - 0.4, long_m}, {0.95, 0.92}, 0.12, 2.15,
                              {P::kCarSide, P::kCarEnd, P::kGrime}, paint, out);
    return;
  }
  traffic_detail::add_block(at, {-long_m, long_m, -long_m, long_m}, {0.88, 0.86}, 0.1, 0.92, {P::kCarSide, P::kCarEnd, P::kGrime}, paint,
                            out);
  traffic_detail::add_block(at, {-long_m + 0.15, long_m - 1.0, -long_m + 0.6, long_m - 1.6}, {0.84, 0.7}, 0.9, 1.45,
                            {P::kCarGlass, P::kCarGlass, P::kGrime}, 1.F, out);
}

}  // namespace searvins::simulator
