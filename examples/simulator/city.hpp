// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// A procedural city along a route: buildings, bridges over the street, trees.
///
/// A building is four vertical walls with a common roof height. Buildings stand in a row on either side of the way, at a set-back, with
/// gaps and with openings where another street crosses; what would stand in the way of the vehicle at any time is left out. How high and
/// how near they are depends on the kind of the neighbourhood, which follows the time of the drive so that shares of time are met.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "random.hpp"
#include "vehicle.hpp"

namespace searvins::simulator {

/// Kind of the neighbourhood.
enum class District : std::uint8_t { open, light, deep };
inline constexpr std::array<const char*, 3> kDistrictNames{"open", "light", "deep"};

/// A vertical wall over the segment a b; the normal points away from its building.
struct Wall {
  Eigen::Vector2d a_m, b_m, normal;
  double bottom_m{0}, top_m{0};
  double mirror_loss_db{0};  ///< of a reflection
  int building{0};
};

/// A bridge: a horizontal rectangle over the street.
struct Bridge {
  Eigen::Vector2d centre_m, along;  ///< along: unit vector of the street below
  double half_length_m{0}, half_width_m{0}, underside_m{0};
};

/// The crown of a tree, a ball.
struct Tree {
  Eigen::Vector3d centre_m;
  double radius_m{0};
};

/// What stands along the way.
struct City {
  std::vector<Wall> walls;
  std::vector<Bridge> bridges;
  std::vector<Tree> trees;
  int buildings{0};
};

/// How one kind of neighbourhood is built; lengths and heights in metres, pairs are the limits of uniform draws.
struct DistrictPlan {
  double set_back_low_m, set_back_high_m, median_height_m, height_spread, lowest_m, highest_m;
  double length_low_m, length_high_m, gap_share, gap_low_m, gap_high_m, tree_share;
};
inline constexpr DistrictPlan kLightPlan{10, 16, 8, 0.16, 6, 10, 10, 28, 0.30, 6, 22, 0.30};
inline constexpr DistrictPlan kDeepPlan{8, 12.5, 25, 0.40, 12, 80, 16, 42, 0.08, 3, 9, 0.12};

/// Where the districts lie in time: they repeat in this order.
struct Profile {
  std::string_view name;
  std::vector<std::pair<District, double>> cycle;  ///< with their length, seconds
  int bridges_per_hour;
};

/// The profile of a name for a drive of some length, empty where there is none. The cycle is shortened so that whole ones fill the drive:
/// shares of time are urban 25 % light and 75 % deep, texcup 10, 40 and 50 %.
[[nodiscard]] inline std::optional<Profile> profile_named(std::string_view name, double duration_s) {
  using enum District;
  Profile profiles[] = {{"open", {{open, 600}}, 0},
                        {"light", {{light, 600}}, 0},
                        {"urban", {{light, 60}, {deep, 180}}, 12},
                        {"texcup", {{open, 60}, {light, 90}, {deep, 150}, {light, 90}, {deep, 150}, {light, 60}}, 10}};
  for (Profile& p : profiles) {
    if (name != p.name) continue;
    double length_s = 0;
    for (const auto& part : p.cycle) length_s += part.second;
    const double scale = duration_s / std::ceil(duration_s / length_s) / length_s;
    for (auto& part : p.cycle) part.second *= scale;
    return p;
  }
  return std::nullopt;
}

/// The district at a time of the drive.
[[nodiscard]] inline District district_at(const Profile& profile, double t_s) {
  double length_s = 0;
  for (const auto& part : profile.cycle) length_s += part.second;
  double rest_s = std::fmod(std::max(t_s, 0.0), length_s);
  for (const auto& [district, part_s] : profile.cycle) {
    if (rest_s < part_s) return district;
    rest_s -= part_s;
  }
  return profile.cycle.back().first;
}

/// The way of the vehicle as points one metre apart, with the time of passing.
struct WayPoint {
  Eigen::Vector2d p_m, forward;
  double t_s{0}, ground_m{0};
  District district{District::open};
  bool is_known{false};  ///< the vehicle came along here before
};

/// Places by cells of ten metres.
class WayIndex {
 public:
  void add(const Eigen::Vector2d& p_m, std::size_t i) { cells_[cell_of(p_m)].push_back(i); }
  /// Whether any point in the cells around a place fulfils a condition.
  template <class Condition>
  [[nodiscard]] bool any_near(const Eigen::Vector2d& p_m, const Condition& condition) const {
    const Cell c = cell_of(p_m);
    for (int x = -1; x <= 1; ++x)
      for (int y = -1; y <= 1; ++y) {
        const auto found = cells_.find({c.first + x, c.second + y});
        if (found != cells_.end() && std::any_of(found->second.begin(), found->second.end(), condition)) return true;
      }
    return false;
  }

 private:
  using Cell = std::pair<int, int>;
  [[nodiscard]] static Cell cell_of(const Eigen::Vector2d& p_m) {
    return {static_cast<int>(std::floor(p_m.x() / 10)), static_cast<int>(std::floor(p_m.y() / 10))};
  }
  std::map<Cell, std::vector<std::size_t>> cells_;
};

/// The points until a time, with the street going on straight before and behind; a street that the vehicle comes along again keeps its
/// district.
[[nodiscard]] inline std::vector<WayPoint> way_points(const Vehicle& vehicle, const Profile& profile, double end_s) {
  constexpr int kBehindM = 60, kAheadM = 90;
  std::vector<WayPoint> all;
  WayIndex index;
  const auto add = [&](double t, double beyond_m) {
    const PathMotion m = vehicle.path(t);
    const Eigen::Vector2d forward{std::sin(m.heading_rad), std::cos(m.heading_rad)};
    WayPoint w{m.p_m + beyond_m * forward, forward, t, vehicle.ground_m(t), district_at(profile, std::min(t, end_s - 2)), false};
    w.is_known = index.any_near(w.p_m, [&](std::size_t i) {
      const bool same = i + 60 < all.size() && (all[i].p_m - w.p_m).norm() < 8 && std::abs(all[i].forward.dot(w.forward)) > 0.8;
      if (same) w.district = all[i].district;
      return same;
    });
    index.add(w.p_m, all.size());
    all.push_back(w);
  };
  for (int i = kBehindM; i > 0; --i) add(0, -i);
  Eigen::Vector2d last_m = vehicle.path(0).p_m;
  double driven_m = 0;
  for (double t = 0; t <= end_s; t += 0.02) {
    const Eigen::Vector2d p_m = vehicle.path(t).p_m;
    driven_m += (p_m - last_m).norm(), last_m = p_m;
    if (driven_m + kBehindM >= static_cast<double>(all.size())) add(t, 0);
  }
  for (int i = 1; i <= kAheadM; ++i) add(end_s, i);
  return all;
}

/// The district that the vehicle is in at a time.
[[nodiscard]] inline District district_on(const std::vector<WayPoint>& way, double t_s) {
  const auto after = std::upper_bound(way.begin(), way.end(), t_s, [](double t, const WayPoint& w) { return t < w.t_s; });
  return after == way.begin() ? way.front().district : (after - 1)->district;
}

/// Builds a city along a way.
class CityBuilder {
 public:
  CityBuilder(const std::vector<WayPoint>& way, const Profile& profile, Random& random) : way_(way), profile_(profile), random_(random) {
    for (std::size_t i = 0; i < way_.size(); ++i) index_.add(way_[i].p_m, i);
  }

  [[nodiscard]] City build() {
    plan_crossings();
    for (const double side : {-1.0, 1.0}) build_row(side);
    build_bridges();
    return std::move(city_);
  }

 private:
  static constexpr double kCorridorM = 6;

  /// Whether a place lies on or close to the way.
  [[nodiscard]] bool in_the_way(const Eigen::Vector2d& p_m) const {
    return index_.any_near(p_m, [&](std::size_t i) { return (way_[i].p_m - p_m).squaredNorm() < kCorridorM * kCorridorM; });
  }

  /// Streets that cross the way every 85 to 150 m: openings in both rows.
  void plan_crossings() {
    open_.assign(way_.size(), false);
    for (double at = random_.uniform(40, 110); at < static_cast<double>(way_.size()); at += random_.uniform(85, 150)) {
      const double half_m = random_.uniform(5.5, 8.5);
      for (std::size_t i = 0; i < way_.size(); ++i)
        if (std::abs(static_cast<double>(i) - at) < half_m) open_[i] = true;
    }
  }

  [[nodiscard]] static const DistrictPlan& plan_of(District d) { return d == District::deep ? kDeepPlan : kLightPlan; }

  void build_row(double side) {
    double at = 0;
    while (at + 4 < static_cast<double>(way_.size())) {
      const auto i = static_cast<std::size_t>(at);
      const District district = way_[i].district;
      if (district == District::open || open_[i] || way_[i].is_known) {
        at += 1;
        continue;
      }
      const DistrictPlan& plan = plan_of(district);
      double length_m = random_.uniform(plan.length_low_m, plan.length_high_m);
      std::size_t k = i;
      while (k + 1 < way_.size() && static_cast<double>(k - i) < length_m && !open_[k + 1]) ++k;
      const double set_back_m = random_.uniform(plan.set_back_low_m, plan.set_back_high_m);
      const double height_m =
          std::clamp(plan.median_height_m * std::exp(plan.height_spread * random_.normal()), plan.lowest_m, plan.highest_m);
      const double mirror_db = random_.uniform(0, 1) < 0.55 ? random_.uniform(7, 11) : random_.uniform(12, 20);  // glass or rough
      if (k > i + 4) add_building(way_[i], way_[k], side, set_back_m, height_m, mirror_db);
      if (random_.uniform(0, 1) < plan.tree_share) add_trees(i, k, side);
      at = static_cast<double>(k) + 0.5;
      if (random_.uniform(0, 1) < plan.gap_share) at += random_.uniform(plan.gap_low_m, plan.gap_high_m);
    }
  }

  /// A building whose front runs beside the way from one point to another, as deep as there is room.
  void add_building(const WayPoint& from, const WayPoint& to, double side, double set_back_m, double height_m, double mirror_db) {
    const auto outwards = [side](const WayPoint& w) { return Eigen::Vector2d{side * w.forward.y(), -side * w.forward.x()}; };
    const Eigen::Vector2d a = from.p_m + set_back_m * outwards(from), b = to.p_m + set_back_m * outwards(to);
    const Eigen::Vector2d along = (b - a).normalized();
    Eigen::Vector2d out{side * along.y(), -side * along.x()};
    if ((b - a).norm() < 5 || along.dot(from.forward) < 0.5) return;
    for (const double depth_m : {16.0, 10.0, 5.0}) {
      const Eigen::Vector2d c = b + depth_m * out, d = a + depth_m * out;
      if (!is_free(a, b, depth_m * out)) continue;
      const double ground_m = (from.ground_m + to.ground_m) / 2;
      const Eigen::Vector2d corners[4] = {a, b, c, d}, normals[4] = {-out, along, out, -along};
      for (std::size_t w = 0; w < 4; ++w)
        city_.walls.push_back(
            {corners[w], corners[(w + 1) % 4], normals[w], ground_m - 3, ground_m + height_m, mirror_db, city_.buildings});
      ++city_.buildings;
      return;
    }
  }

  [[nodiscard]] bool is_free(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& depth) const {
    const int along = static_cast<int>((b - a).norm() / 2) + 1, deep = static_cast<int>(depth.norm() / 2) + 1;
    for (int i = 0; i <= along; ++i)
      for (int k = 0; k <= deep; ++k)
        if (in_the_way(a + static_cast<double>(i) / along * (b - a) + static_cast<double>(k) / deep * depth)) return false;
    return true;
  }

  void add_trees(std::size_t from, std::size_t to, double side) {
    for (double at = static_cast<double>(from) + 3; at < static_cast<double>(to); at += random_.uniform(7, 13)) {
      const WayPoint& w = way_[static_cast<std::size_t>(at)];
      const double radius_m = random_.uniform(1.5, 3), aside_m = random_.uniform(6.2, 7.5), above_m = random_.uniform(4, 6.5);
      const Eigen::Vector2d p = w.p_m + aside_m * side * Eigen::Vector2d{w.forward.y(), -w.forward.x()};
      if (!in_the_way(p)) city_.trees.push_back({{p.x(), p.y(), w.ground_m + above_m}, radius_m});
    }
  }

  /// Bridges over the way in the second half of a district that is not open, spread evenly over the drive.
  void build_bridges() {
    if (way_.empty()) return;
    const double duration_s = way_.back().t_s;
    const int count = static_cast<int>(std::ceil(profile_.bridges_per_hour * duration_s / 3600));
    for (int n = 0; n < count; ++n) {
      const double t_s = (n + random_.uniform(0.3, 0.8)) * duration_s / count, half_m = random_.uniform(5, 11);
      const auto at = std::lower_bound(way_.begin(), way_.end(), t_s, [](const WayPoint& w, double t) { return w.t_s < t; });
      if (at == way_.end() || at->district == District::open || at->is_known) continue;
      city_.bridges.push_back({at->p_m, at->forward, half_m, 18, at->ground_m + random_.uniform(5.2, 7)});
    }
  }

  const std::vector<WayPoint>& way_;
  const Profile& profile_;
  Random& random_;
  WayIndex index_;
  std::vector<bool> open_;
  City city_;
};

}  // namespace searvins::simulator
