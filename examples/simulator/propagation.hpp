// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// How the signal of a satellite comes to the antenna through a city.
///
/// The satellite is so far away that its rays are parallel: unit vector u from the antenna A to it, in the map.
///
/// Roof edge. A wall that the ray passes below its roof obstructs it; the wave bends over the roof. With the edge's direction t, the
/// vector w from A to the edge perpendicular to t, and u_p = u - (u.t) t, Fermat's principle gives the detour over the best point of the
/// edge, and the detour the loss J over a knife edge (ITU-R P.526, for an edge that hides the satellite):
///
///     detour = |u_p| |w| - u_p . w          nu = 2 sqrt(detour / lambda)          J = 6.9 + 20 log10(sqrt((nu - 0.1)^2 + 1) + nu - 0.1) dB
///
/// Mirror. A plane wall with outward normal n, A at the distance d in front of it, satellite on the same side (u.n > 0): the reflected ray
/// reaches A from u' = u - 2 (u.n) n, off the point A + d / (u.n) u'; it is longer than the direct ray by
///
///     extra = 2 d (u.n)          (the image of A lies 2 d behind: its distance to the plane wave is larger by that much along u)
///
/// if the point lies on the wall and nothing stands in either leg.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include "city.hpp"

namespace searvins::simulator {

/// The direct ray.
struct DirectRay {
  bool is_clear{true};   ///< no wall and no bridge in the line of sight
  bool is_dark{false};   ///< under a bridge: nothing comes through
  double detour_m{0};    ///< over the roof edge
  double foliage_db{0};  ///< lost in trees
};

/// The best mirror image of the satellite.
struct Reflection {
  std::size_t wall{0};  ///< index in the city
  double extra_m{0}, loss_db{0};
  Eigen::Vector3d point_m{Eigen::Vector3d::Zero()};
};

/// Loss over a knife edge that hides the satellite, dB.
[[nodiscard]] inline double knife_edge_loss_db(double detour_m, double wavelength_m) {
  const double x = 2 * std::sqrt(std::max(detour_m, 0.0) / wavelength_m) - 0.1;
  return 6.9 + 20 * std::log10(std::sqrt(x * x + 1) + x);
}

/// The part of a city around a place.
class Surroundings {
 public:
  static constexpr double kReachM = 220, kMirrorReachM = 60;

  Surroundings(const City& city, const Eigen::Vector3d& antenna_m) : city_(city), antenna_m_(antenna_m) {
    const Eigen::Vector2d at = antenna_m.head<2>();
    for (std::size_t i = 0; i < city.walls.size(); ++i)
      if (((city.walls[i].a_m + city.walls[i].b_m) / 2 - at).squaredNorm() < kReachM * kReachM) walls_.push_back(i);
    for (const Bridge& b : city.bridges)
      if ((b.centre_m - at).norm() < 80) bridges_.push_back(&b);
    for (const Tree& t : city.trees)
      if ((t.centre_m.head<2>() - at).norm() < 40) trees_.push_back(&t);
  }

  [[nodiscard]] DirectRay direct(const Eigen::Vector3d& u) const {
    DirectRay ray;
    ray.is_dark = hidden_by_bridge(antenna_m_, u);
    ray.is_clear = !ray.is_dark;
    for (const std::size_t i : walls_) {
      const Wall& wall = city_.walls[i];
      const double along = crossing(antenna_m_, u, wall);
      if (along < 0 || antenna_m_.z() + along * u.z() >= wall.top_m) continue;
      ray.is_clear = false;
      ray.detour_m = std::max(ray.detour_m, detour_m(u, wall));
    }
    for (const Tree* tree : trees_) ray.foliage_db += kFoliageDbPerM * chord_m(*tree, u);
    ray.foliage_db = std::min(ray.foliage_db, 16.0);
    return ray;
  }

  /// The reflection with the least loss.
  [[nodiscard]] std::optional<Reflection> reflection(const Eigen::Vector3d& u) const {
    std::optional<Reflection> best;
    for (const std::size_t i : walls_) {
      const Wall& wall = city_.walls[i];
      const Eigen::Vector3d n{wall.normal.x(), wall.normal.y(), 0};
      const double distance_m = wall.normal.dot(antenna_m_.head<2>() - wall.a_m), facing = u.dot(n);
      if (distance_m <= 0 || distance_m > kMirrorReachM || facing <= 1e-3) continue;
      const Eigen::Vector3d from = u - 2 * facing * n;
      const double leg_m = distance_m / facing;
      const double loss_db = wall.mirror_loss_db + kSpreadDbPerM * leg_m;
      if (best && best->loss_db <= loss_db) continue;
      const Eigen::Vector3d point_m = antenna_m_ + leg_m * from;
      const Eigen::Vector2d side = wall.b_m - wall.a_m;
      const double part = side.dot(point_m.head<2>() - wall.a_m) / side.squaredNorm();
      if (part < 0 || part > 1 || point_m.z() < wall.bottom_m || point_m.z() > wall.top_m) continue;
      if (!is_free(antenna_m_, from, leg_m - 0.01) || !is_free(point_m + 0.01 * n, u, 1e9)) continue;
      best = Reflection{i, 2 * distance_m * facing, loss_db, point_m};
    }
    return best;
  }

  /// Whether a ray from a place is free of walls and bridges for a length.
  [[nodiscard]] bool is_free(const Eigen::Vector3d& from_m, const Eigen::Vector3d& u, double length_m) const {
    for (const std::size_t i : walls_) {
      const double along = crossing(from_m, u, city_.walls[i]);
      if (along >= 0 && along < length_m && from_m.z() + along * u.z() < city_.walls[i].top_m) return false;
    }
    return !hidden_by_bridge(from_m, u);
  }

 private:
  static constexpr double kFoliageDbPerM = 1.6, kSpreadDbPerM = 0.07;  // no facade is quite flat

  /// How far along the ray it crosses the vertical plane of a wall between its ends; -1 where it does not.
  [[nodiscard]] static double crossing(const Eigen::Vector3d& from_m, const Eigen::Vector3d& u, const Wall& wall) {
    const double approach = -u.x() * wall.normal.x() - u.y() * wall.normal.y();
    const double distance_m = wall.normal.dot(from_m.head<2>() - wall.a_m);
    if (std::abs(approach) < 1e-12) return -1;
    const double along = distance_m / approach;
    if (along < 0) return -1;
    const Eigen::Vector2d side = wall.b_m - wall.a_m, hit = from_m.head<2>() + along * u.head<2>() - wall.a_m;
    const double part = side.dot(hit);
    return part < 0 || part > side.squaredNorm() ? -1 : along;
  }

  [[nodiscard]] double detour_m(const Eigen::Vector3d& u, const Wall& wall) const {
    const Eigen::Vector2d side = (wall.b_m - wall.a_m).normalized();
    const Eigen::Vector3d edge{side.x(), side.y(), 0},
        to_a{wall.a_m.x() - antenna_m_.x(), wall.a_m.y() - antenna_m_.y(), wall.top_m - antenna_m_.z()};
    const Eigen::Vector3d w = to_a - to_a.dot(edge) * edge, up = u - u.dot(edge) * edge;
    return up.norm() * w.norm() - up.dot(w);
  }

  [[nodiscard]] bool hidden_by_bridge(const Eigen::Vector3d& from_m, const Eigen::Vector3d& u) const {
    for (const Bridge* bridge : bridges_) {
      const double up_m = bridge->underside_m - from_m.z();
      if (up_m <= 0 || u.z() <= 0) continue;
      const Eigen::Vector2d hit = from_m.head<2>() + up_m / u.z() * u.head<2>() - bridge->centre_m;
      const Eigen::Vector2d across{bridge->along.y(), -bridge->along.x()};
      if (std::abs(hit.dot(bridge->along)) < bridge->half_length_m && std::abs(hit.dot(across)) < bridge->half_width_m) return true;
    }
    return false;
  }

  [[nodiscard]] double chord_m(const Tree& tree, const Eigen::Vector3d& u) const {
    const Eigen::Vector3d to_centre = tree.centre_m - antenna_m_;
    const double along = u.dot(to_centre), off2 = to_centre.squaredNorm() - along * along, r2 = tree.radius_m * tree.radius_m;
    return along <= 0 || off2 >= r2 ? 0 : 2 * std::sqrt(r2 - off2);
  }

  const City& city_;
  Eigen::Vector3d antenna_m_;
  std::vector<std::size_t> walls_;
  std::vector<const Bridge*> bridges_;
  std::vector<const Tree*> trees_;
};

}  // namespace searvins::simulator
