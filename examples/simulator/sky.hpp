// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// What is infinitely far away: sky with clouds, and a line of distant roofs and hills on the horizon.
///
/// Brightness depends on the direction alone, so it has no disparity and does not move with the vehicle. Clouds are a smooth pattern on a
/// plane high above; they fade where it meets the horizon. Roofs rise 0.3 to 3 degrees; below the horizon there is pale ground.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <vector>

#include "hash.hpp"
#include "texture_art.hpp"

namespace searvins::simulator {

/// The surroundings at infinity.
class Sky {
 public:
  explicit Sky(std::uint64_t seed) : clouds_(make_clouds(seed)) {
    double hill = 0.012;
    for (std::size_t i = 0; i < kSteps;) {
      const auto key = static_cast<std::int64_t>(i);
      const auto width = static_cast<std::size_t>(8 + 60 * uniform_at(seed, key, 1));
      const double house = uniform_at(seed, key, 2) < 0.7 ? 0.004 + 0.035 * uniform_at(seed, key, 3) : 0;
      const auto grey = static_cast<float>(130 + 50 * uniform_at(seed, key, 4));
      for (std::size_t k = 0; k < width && i < kSteps; ++k, ++i) {
        hill = 0.012 + 0.007 * std::sin(static_cast<double>(i) * 2 * std::numbers::pi * 7 / kSteps);
        roof_.push_back(static_cast<float>(std::max(hill, house))), grey_.push_back(house > hill ? grey : 172.F);
      }
    }
  }

  /// Brightness in a direction (map axes, any length).
  [[nodiscard]] float brightness(const Eigen::Vector3d& direction) const {
    const double level = direction.head<2>().norm(), slope = direction.z() / std::max(level, 1e-9);
    if (slope < 0) return 150;
    const double turn = std::atan2(direction.x(), direction.y()) / (2 * std::numbers::pi);
    const auto i = static_cast<std::size_t>((turn - std::floor(turn)) * kSteps) % kSteps;
    // The edge of a roof is spread over a tenth of a degree.
    const auto share = static_cast<float>(std::clamp((static_cast<double>(roof_[i]) - slope) / 0.0018 + 0.5, 0.0, 1.0));
    return share * grey_[i] + (1 - share) * above(direction, slope);
  }

 private:
  static constexpr std::size_t kSteps = 8192;

  [[nodiscard]] static Texture make_clouds(std::uint64_t seed) {
    Canvas c(256, 256, 128, scrambled(seed ^ 0x434C));
    c.add_noise(64, 45, 4);
    return c.texture();
  }

  [[nodiscard]] float above(const Eigen::Vector3d& direction, double slope) const {
    const auto clear = static_cast<float>(228 - 45 * std::min(slope, 1.0));
    const double up = std::max(direction.z(), 1e-3) + 0.05 * direction.head<2>().norm();
    TexturePatch patch;
    patch.x = static_cast<float>(20 * direction.x() / up + 4096), patch.y = static_cast<float>(20 * direction.y() / up + 4096);
    patch.x_u = patch.y_v = 2;
    const auto fade = static_cast<float>(std::min(1.0, 4 * slope));
    return std::clamp(clear + 0.9F * fade * (clouds_.mean(patch) - 128), 120.F, 250.F);
  }

  Texture clouds_;
  std::vector<float> roof_, grey_;  // slope of the skyline and its brightness, by azimuth
};

}  // namespace searvins::simulator
