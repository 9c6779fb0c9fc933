// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The surfaces of a simulated city: houses, bridges, trees, lamp posts, road, ground and parked cars, found by place.
///
/// The ground is a grid of triangles whose height at a node is the mean of the way's heights around it, weighted by the inverse fourth
/// power of the distance; the road is a strip of the way's own heights 4 cm above.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include "city.hpp"
#include "facet.hpp"
#include "hash.hpp"
#include "traffic.hpp"

namespace searvins::simulator {

/// All that stands still.
class Scene {
 public:
  Scene(const City& city, const std::vector<WayPoint>& way, std::uint64_t seed) : way_(way), seed_(scrambled(seed ^ 0x5343)) {
    for (const Wall& wall : city.walls) add_wall(wall);
    for (const Bridge& bridge : city.bridges) add_bridge(bridge);
    for (const Tree& tree : city.trees) add_tree(tree);
    add_lamps();
    add_road();
    add_ground();
    const Traffic traffic(way, seed);
    for (const Car& car : traffic.parked()) {
      std::vector<Facet> parts;
      add_car(car, parts);
      for (Facet& f : parts) ++body_, add(f);
    }
  }

  [[nodiscard]] const std::vector<Facet>& facets() const { return facets_; }

  /// Calls with each facet that may be seen from a place.
  template <class Call>
  void for_each_near(const Eigen::Vector3d& p_m, const Call& call) const {
    const Cell c = cell_of(p_m.head<2>());
    constexpr int kReach = static_cast<int>(kFarthestM / kCellM) + 1;
    for (int x = c.first - kReach; x <= c.first + kReach; ++x)
      for (int y = c.second - kReach; y <= c.second + kReach; ++y) {
        const auto found = cells_.find({x, y});
        if (found == cells_.end()) continue;
        for (const std::size_t i : found->second) {
          const Facet& f = facets_[i];
          const Eigen::Vector3d to = f.corners_m[0] - p_m;
          if (f.normal.dot(to) < 0 && to.norm() < static_cast<double>(f.reach_m)) call(f);
        }
      }
  }

 private:
  static constexpr double kCellM = 40, kFarthestM = 280, kStoreyM = 3.2;
  static constexpr double kGroundCellM = 8, kGroundReachM = 72, kRoadHalfM = 6, kKerbM = 0.04;
  using Cell = std::pair<int, int>;
  using Quad = std::array<Eigen::Vector3d, 4>;

  [[nodiscard]] static Cell cell_of(const Eigen::Vector2d& p_m) {
    return {static_cast<int>(std::floor(p_m.x() / kCellM)), static_cast<int>(std::floor(p_m.y() / kCellM))};
  }
  [[nodiscard]] double chance(std::int64_t i, std::int64_t j) const { return uniform_at(seed_, i, j); }

  void add(Facet& f) {
    f.body = body_;
    cells_[cell_of(f.centre_m().head<2>())].push_back(facets_.size());
    facets_.push_back(f);
  }

  /// Ground floor and upper floors, each facade with a pattern and a beginning of its own.
  void add_wall(const Wall& wall) {
    ++body_;
    const std::int64_t key = wall.building;
    const double ground_m = wall.bottom_m + 3, split_m = std::min(ground_m + kStoreyM, wall.top_m);
    // As seen from outside the first corner must be on the left, so that the corners go round counter-clockwise.
    const Eigen::Vector2d side = wall.b_m - wall.a_m;
    const bool a_left = side.x() * wall.normal.y() - side.y() * wall.normal.x() < 0;
    const Eigen::Vector2d l = a_left ? wall.a_m : wall.b_m, r = a_left ? wall.b_m : wall.a_m;
    const auto part = [&](double low_m, double high_m, int texture, double start) {
      const Quad corners{Eigen::Vector3d{l.x(), l.y(), low_m}, {r.x(), r.y(), low_m}, {r.x(), r.y(), high_m}, {l.x(), l.y(), high_m}};
      Facet f = facet_of(corners, SurfaceClass::building);
      f.paint = layer_along(f, texture), f.grime = layer_along(f, PatternSet::kGrime);
      f.paint.origin_m.z() = split_m;  // row 0 of either pattern: both begin at the edge between the floors
      f.paint.origin_m -= start * f.paint.s_axis.normalized();
      f.grime.origin_m -= 25.6 * chance(key, 7) * f.paint.s_axis.normalized() + 25.6 * chance(key, 8) * Eigen::Vector3d::UnitZ();
      f.shade *= static_cast<float>(0.8 + 0.35 * chance(key, 3)), f.reach_m = static_cast<float>(kFarthestM);
      add(f);
    };
    const double start = 25.6 * chance(key, 4) + side.norm();
    const int facade = PatternSet::kFacade + static_cast<int>(PatternSet::kFacades * chance(key, 1));
    const int shop = PatternSet::kShop + static_cast<int>(PatternSet::kShops * chance(key, 2));
    part(wall.bottom_m, ground_m, PatternSet::kConcrete, start);
    const std::size_t base = facets_.size();
    part(ground_m, split_m, shop, start);
    facets_[base].paint.origin_m.z() = ground_m + kStoreyM;
    if (wall.top_m > split_m) part(split_m, wall.top_m, facade, start);
  }

  void add_bridge(const Bridge& bridge) {
    ++body_;
    const Eigen::Vector2d across{bridge.along.y(), -bridge.along.x()};
    const auto corner = [&](double along, double aside, double z) {
      const Eigen::Vector2d p = bridge.centre_m + along * bridge.half_length_m * bridge.along + aside * bridge.half_width_m * across;
      return Eigen::Vector3d{p.x(), p.y(), z};
    };
    const double low = bridge.underside_m, high = low + 1.6;
    const Quad under{corner(-1, 1, low), corner(-1, -1, low), corner(1, -1, low), corner(1, 1, low)};
    const Quad before{corner(-1, -1, low), corner(-1, 1, low), corner(-1, 1, high), corner(-1, -1, high)};
    const Quad behind{corner(1, 1, low), corner(1, -1, low), corner(1, -1, high), corner(1, 1, high)};
    for (const Quad& quad : {under, before, behind}) {
      Facet f = facet_of(quad, SurfaceClass::building);
      f.paint = layer_along(f, PatternSet::kConcrete), f.grime = layer_along(f, PatternSet::kGrime);
      if (f.normal.z() < -0.5) f.shade = 0.4F;
      add(f);
    }
  }

  /// A trunk and a crown of eighty triangles.
  void add_tree(const Tree& tree) {
    ++body_;
    const Eigen::Vector3d& c = tree.centre_m;
    add_post({c.x(), c.y()}, c.z() - 7, c.z(), 0.14, PatternSet::kLeaves, SurfaceClass::vegetation, 0.9F);
    const double g = (1 + std::sqrt(5.0)) / 2;
    const std::array<Eigen::Vector3d, 12> v{Eigen::Vector3d{-1, g, 0},
                                            {1, g, 0},
                                            {-1, -g, 0},
                                            {1, -g, 0},
                                            {0, -1, g},
                                            {0, 1, g},
                                            {0, -1, -g},
                                            {0, 1, -g},
                                            {g, 0, -1},
                                            {g, 0, 1},
                                            {-g, 0, -1},
                                            {-g, 0, 1}};
    constexpr std::array<std::array<std::size_t, 3>, 20> kFaces{
        {{0, 11, 5}, {0, 5, 1}, {0, 1, 7}, {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
         {3, 9, 4},  {3, 4, 2}, {3, 2, 6}, {3, 6, 8},  {3, 8, 9},   {4, 9, 5}, {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}}};
    for (const auto& face : kFaces) {
      const Eigen::Vector3d a = v[face[0]].normalized(), b = v[face[1]].normalized(), d = v[face[2]].normalized();
      const Eigen::Vector3d ab = (a + b).normalized(), bd = (b + d).normalized(), da = (d + a).normalized();
      for (const auto& small : {std::array{a, ab, da}, std::array{ab, b, bd}, std::array{da, bd, d}, std::array{ab, bd, da}}) {
        std::array<Eigen::Vector3d, 3> corners;
        for (std::size_t i = 0; i < 3; ++i) {
          // A crown is no ball: each corner lies a little nearer or farther, the same for all faces that meet in it.
          const auto key = static_cast<std::int64_t>(std::llround(1e4 * (small[i].x() + 3 * small[i].y() + 7 * small[i].z())));
          corners[i] = c + tree.radius_m * (0.85 + 0.3 * chance(key, 50)) * small[i];
        }
        Facet f = facet_of(corners, SurfaceClass::vegetation);
        f.paint = layer_along(f, PatternSet::kLeaves), f.grime = layer_along(f, PatternSet::kGrime);
        f.shade *= static_cast<float>(1.05 + 0.25 * small[0].z());
        add(f);
      }
    }
  }

  /// A post with four sides.
  void add_post(const Eigen::Vector2d& p, double low_m, double high_m, double half_m, int texture, SurfaceClass surface, float shade) {
    const std::array<Eigen::Vector2d, 4> corner{Eigen::Vector2d{-half_m, -half_m}, {half_m, -half_m}, {half_m, half_m}, {-half_m, half_m}};
    for (std::size_t i = 0; i < 4; ++i) {
      const Eigen::Vector2d a = p + corner[i], b = p + corner[(i + 1) % 4];
      const Quad quad{Eigen::Vector3d{a.x(), a.y(), low_m}, {b.x(), b.y(), low_m}, {b.x(), b.y(), high_m}, {a.x(), a.y(), high_m}};
      Facet f = facet_of(quad, surface);
      f.paint = layer_along(f, texture), f.grime = layer_along(f, PatternSet::kGrime);
      f.shade *= shade;
      add(f);
    }
  }

  /// Lamp posts, some with a sign, where the way does not come by again.
  void add_lamps() {
    WayIndex index;
    for (std::size_t i = 0; i < way_.size(); ++i) index.add(way_[i].p_m, i);
    for (std::size_t i = 8; i < way_.size(); i += 22) {
      const auto key = static_cast<std::int64_t>(i);
      const double side = chance(key, 20) < 0.5 ? -1 : 1;
      const WayPoint& w = way_[i];
      const Eigen::Vector2d right{w.forward.y(), -w.forward.x()}, p = w.p_m + side * (6.2 + 0.5 * chance(key, 21)) * right;
      if (index.any_near(p, [&](std::size_t k) { return (way_[k].p_m - p).norm() < 5.8; })) continue;
      ++body_;
      add_post(p, w.ground_m - 0.3, w.ground_m + 7, 0.07, PatternSet::kGrime, SurfaceClass::pole_sign, chance(key, 22) < 0.5 ? 0.5F : 1.2F);
      if (chance(key, 23) < 0.6) add_sign(p, w, key);
    }
  }

  void add_sign(const Eigen::Vector2d& p, const WayPoint& w, std::int64_t key) {
    const Eigen::Vector2d right{w.forward.y(), -w.forward.x()};
    const double half_m = 0.35 + 0.3 * chance(key, 24), low = w.ground_m + 2.2, high = low + 0.6 + 0.5 * chance(key, 25);
    const Eigen::Vector2d front = p - 0.1 * w.forward, l = front - half_m * right, r = front + half_m * right;
    const Quad quad{Eigen::Vector3d{l.x(), l.y(), low}, {r.x(), r.y(), low}, {r.x(), r.y(), high}, {l.x(), l.y(), high}};
    Facet f = facet_of(quad, SurfaceClass::pole_sign);
    f.paint = layer_stretched(f, PatternSet::kCarEnd, 128, 64), f.grime = layer_along(f, PatternSet::kGrime);
    f.shade = 1.1F;
    add(f);
  }

  /// The strip of the road, a metre at a time. On open land it is as wide as in town.
  void add_road() {
    ++body_;
    for (std::size_t i = 0; i + 1 < way_.size(); ++i) {
      const WayPoint &w = way_[i], &next = way_[i + 1];
      const auto edge = [](const WayPoint& at, double aside_m) {
        return Eigen::Vector3d{at.p_m.x() + aside_m * at.forward.y(), at.p_m.y() - aside_m * at.forward.x(), at.ground_m};
      };
      const Quad quad{edge(w, kRoadHalfM), edge(next, kRoadHalfM), edge(next, -kRoadHalfM), edge(w, -kRoadHalfM)};
      Facet f = facet_of(quad, SurfaceClass::road);
      const Eigen::Vector2d along = (next.p_m - w.p_m).normalized();
      const Eigen::Vector3d s{along.x(), along.y(), 0}, t{along.y(), -along.x(), 0};
      const double row = 256, start = kTexelsPerM * std::fmod(static_cast<double>(i), 25.6);
      f.paint = {PatternSet::kRoad, Eigen::Vector3d{w.p_m.x(), w.p_m.y(), w.ground_m} - start / kTexelsPerM * s - row / kTexelsPerM * t,
                 kTexelsPerM * s, kTexelsPerM * t};
      f.grime = layer_on_map(PatternSet::kGrime, kTexelsPerM);
      f.reach_m = 190;
      add(f);
    }
  }

  /// Triangles all round the way; paving in town, grass outside.
  void add_ground() {
    ++body_;
    const auto node_of = [](double x) { return static_cast<int>(std::floor(x / kGroundCellM)); };
    struct Node {
      double weight{0}, sum{0}, nearest2{1e9};
      bool is_town{false};
    };
    std::map<std::pair<int, int>, Node> nodes;
    const int reach = static_cast<int>(kGroundReachM / kGroundCellM);
    for (const WayPoint& w : way_)
      for (int x = node_of(w.p_m.x()) - reach; x <= node_of(w.p_m.x()) + reach; ++x)
        for (int y = node_of(w.p_m.y()) - reach; y <= node_of(w.p_m.y()) + reach; ++y) {
          const double d2 = (Eigen::Vector2d{x * kGroundCellM, y * kGroundCellM} - w.p_m).squaredNorm() + 1, weight = 1 / (d2 * d2);
          Node& node = nodes[{x, y}];
          node.weight += weight, node.sum += weight * w.ground_m;
          if (d2 < node.nearest2) node.nearest2 = d2, node.is_town = w.district != District::open;
        }
    const auto height_m = [&](const Node& node) { return node.sum / node.weight - kKerbM; };
    for (const auto& [at, node] : nodes) {
      const auto [x, y] = at;
      const auto east = nodes.find({x + 1, y}), north = nodes.find({x, y + 1}), both = nodes.find({x + 1, y + 1});
      if (east == nodes.end() || north == nodes.end() || both == nodes.end()) continue;
      const double x0 = x * kGroundCellM, y0 = y * kGroundCellM, x1 = x0 + kGroundCellM, y1 = y0 + kGroundCellM;
      const Quad c{Eigen::Vector3d{x0, y0, height_m(node)},
                   {x1, y0, height_m(east->second)},
                   {x1, y1, height_m(both->second)},
                   {x0, y1, height_m(north->second)}};
      for (const auto& triangle : {std::array{c[0], c[1], c[2]}, std::array{c[0], c[2], c[3]}}) {
        Facet f = facet_of(triangle, node.is_town ? SurfaceClass::road : SurfaceClass::other_static);
        f.paint = layer_on_map(node.is_town ? PatternSet::kPaving : PatternSet::kGrass, kTexelsPerM);
        f.grime = layer_on_map(PatternSet::kGrime, kTexelsPerM);
        f.reach_m = 140;
        add(f);
      }
    }
  }

  const std::vector<WayPoint>& way_;
  std::uint64_t seed_;
  std::uint32_t body_{0};
  std::vector<Facet> facets_;
  std::map<Cell, std::vector<std::size_t>> cells_;
};

}  // namespace searvins::simulator
