// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The surfaces of the rendered world: flat convex pieces with a pattern painted on them.
///
/// A point X of a facet carries the pattern's value at the texel coordinates
///
///     s = (X - origin_m) . s_axis          t = (X - origin_m) . t_axis          axes in texels a metre
///
/// Everything is in the map's axes (east, north, up), metres.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "texture_art.hpp"

namespace searvins::simulator {

/// What a pixel shows; the numbers are the semantic classes of stereo_tracks.csv, with the sky added.
enum class SurfaceClass : std::uint8_t { building = 0, road = 1, pole_sign = 2, vegetation = 3, vehicle = 4, other_static = 5, sky = 6 };
inline constexpr std::array<const char*, 7> kSurfaceClassNames{"building", "road",         "pole_sign", "vegetation",
                                                               "vehicle",  "other_static", "sky"};

/// A pattern in place.
struct Layer {
  int texture{0};  ///< index in the renderer's set
  Eigen::Vector3d origin_m{Eigen::Vector3d::Zero()}, s_axis{Eigen::Vector3d::Zero()}, t_axis{Eigen::Vector3d::Zero()};
};

/// A flat convex piece, seen from the side to which its normal points.
struct Facet {
  std::array<Eigen::Vector3d, 4> corners_m{};
  std::uint8_t count{4};
  SurfaceClass surface{SurfaceClass::building};
  std::uint32_t body{1};  ///< facets of one body meet without an outline that would have to be smoothed; 0: the sky's
  float shade{1};         ///< brightness by the direction to the sun
  float reach_m{150};     ///< not drawn from farther away
  Layer paint{}, grime{};
  Eigen::Vector3d normal{Eigen::Vector3d::UnitZ()};

  [[nodiscard]] Eigen::Vector3d centre_m() const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < count; ++i) sum += corners_m[i];
    return sum / count;
  }
};

/// Brightness of a surface by its normal: light from the sky, and a sun in the south-south-west, 40 degrees high.
[[nodiscard]] inline float sunlight(const Eigen::Vector3d& normal) {
  const Eigen::Vector3d sun{-0.29, -0.71, 0.643};
  const double sky = 0.8 + 0.1 * normal.z(), direct = 0.4 * std::max(0.0, normal.dot(sun));
  return static_cast<float>(sky + direct);
}

/// A facet through corners that go round counter-clockwise as seen from outside; a triangle repeats none: `count` is 3.
[[nodiscard]] inline Facet facet_of(std::span<const Eigen::Vector3d> corners_m, SurfaceClass surface) {
  Facet f;
  f.count = static_cast<std::uint8_t>(corners_m.size());
  for (std::size_t i = 0; i < corners_m.size(); ++i) f.corners_m[i] = corners_m[i];
  // Newell's sum holds for any number of corners, and when two of them coincide.
  f.normal.setZero();
  for (std::size_t i = 0; i < corners_m.size(); ++i)
    f.normal += (corners_m[i] - corners_m[0]).cross(corners_m[(i + 1) % corners_m.size()] - corners_m[0]);
  f.normal.normalize();
  f.surface = surface;
  f.shade = sunlight(f.normal);
  return f;
}

/// Lays a pattern along an edge: s from the first corner to the second, t downwards in the plane (rows of a pattern go down).
[[nodiscard]] inline Layer layer_along(const Facet& f, int texture, double texels_per_m = kTexelsPerM) {
  const Eigen::Vector3d along = (f.corners_m[1] - f.corners_m[0]).normalized();
  return {texture, f.corners_m[0], texels_per_m * along, -texels_per_m * f.normal.cross(along)};
}

/// Lays a pattern on the map as seen from above: s east, t south.
[[nodiscard]] inline Layer layer_on_map(int texture, double texels_per_m) {
  return {texture, Eigen::Vector3d::Zero(), texels_per_m * Eigen::Vector3d::UnitX(), -texels_per_m * Eigen::Vector3d::UnitY()};
}

/// Stretches a pattern of so many texels over the whole of a facet with four corners at right angles.
[[nodiscard]] inline Layer layer_stretched(const Facet& f, int texture, int width, int height) {
  const Eigen::Vector3d along = f.corners_m[1] - f.corners_m[0], up = f.corners_m[3] - f.corners_m[0];
  // Perpendicular parts, for facets that are trapezes.
  const Eigen::Vector3d upright = up - up.dot(along) / along.squaredNorm() * along;
  return {texture, f.corners_m[0] + upright, width / along.squaredNorm() * along, -height / upright.squaredNorm() * upright};
}

/// The numbers of the patterns in the renderer's set.
struct PatternSet {
  static constexpr int kFacades = 8, kShops = 4;
  static constexpr int kFacade = 0, kShop = kFacade + kFacades, kRoad = kShop + kShops, kPaving = kRoad + 1, kGrass = kPaving + 1,
                       kLeaves = kGrass + 1, kConcrete = kLeaves + 1, kGrime = kConcrete + 1, kCarSide = kGrime + 1, kCarEnd = kCarSide + 1,
                       kCarGlass = kCarEnd + 1;

  /// Draws them all.
  [[nodiscard]] static std::vector<Texture> drawn(std::uint64_t seed) {
    std::vector<Texture> all;
    for (std::uint64_t i = 0; i < kFacades; ++i) all.push_back(facade_texture(seed * 100 + i));
    for (std::uint64_t i = 0; i < kShops; ++i) all.push_back(shop_texture(seed * 100 + i));
    all.push_back(road_texture(seed)), all.push_back(paving_texture(seed));
    all.push_back(rough_texture(seed, 105, 22)), all.push_back(rough_texture(seed + 1, 70, 30));
    all.push_back(concrete_texture(seed)), all.push_back(grime_texture(seed));
    all.push_back(car_side_texture(seed)), all.push_back(car_end_texture(seed)), all.push_back(car_glass_texture(seed));
    return all;
  }
};

}  // namespace searvins::simulator
