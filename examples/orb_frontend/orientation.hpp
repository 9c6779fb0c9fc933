// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Which way a corner points: from its centre to the centroid of the grey values around it.
///
///     m_x = sum x I(x, y),  m_y = sum y I(x, y)   over the disc of radius 15,      angle = atan2(m_y, m_x)
///
/// x to the right, y down, so the angle grows clockwise as the image is seen. Turning the image turns the angle by as much
/// [Rosin, CVIU 1999; Rublee et al., ICCV 2011].
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <searvins/vision/image_view.hpp>

namespace searvins::orb {

inline constexpr int kDiscRadius = 15;  ///< px

namespace detail {

inline constexpr std::size_t kDiscWidth = 32;  // 31 columns and one of weight 0: whole vectors

struct DiscWeights {
  using Row = std::array<std::int16_t, kDiscWidth>;
  std::array<Row, 2 * kDiscRadius + 1> x{}, y{};  // 0 outside the disc
};

[[nodiscard]] constexpr DiscWeights disc_weights() {
  DiscWeights weights;
  for (int y = -kDiscRadius; y <= kDiscRadius; ++y)
    for (int x = -kDiscRadius; x <= kDiscRadius; ++x) {
      if (x * x + y * y > kDiscRadius * kDiscRadius) continue;
      const auto row = static_cast<std::size_t>(y + kDiscRadius), column = static_cast<std::size_t>(x + kDiscRadius);
      weights.x[row][column] = static_cast<std::int16_t>(x);
      weights.y[row][column] = static_cast<std::int16_t>(y);
    }
  return weights;
}

inline constexpr DiscWeights kDiscWeights = disc_weights();

}  // namespace detail

/// The angle at (x, y), radians in [-pi, pi]. The disc and one more column to its right must lie inside the image. 0 for a disc without
/// contrast.
[[nodiscard]] inline float orientation_rad(const vision::ImageView& image, int x, int y) {
  std::int32_t m_x = 0, m_y = 0;
  for (int dy = -kDiscRadius; dy <= kDiscRadius; ++dy) {
    const std::uint8_t* row = image.row(y + dy) + x - kDiscRadius;
    const auto& weight_x = detail::kDiscWeights.x[static_cast<std::size_t>(dy + kDiscRadius)];
    const auto& weight_y = detail::kDiscWeights.y[static_cast<std::size_t>(dy + kDiscRadius)];
    std::int32_t row_x = 0, row_y = 0;
    for (std::size_t i = 0; i < detail::kDiscWidth; ++i) {
      const auto grey = static_cast<std::int16_t>(row[i]);
      row_x += grey * weight_x[i];
      row_y += grey * weight_y[i];
    }
    m_x += row_x;
    m_y += row_y;
  }
  return m_x == 0 && m_y == 0 ? 0.0F : std::atan2(static_cast<float>(m_y), static_cast<float>(m_x));
}

}  // namespace searvins::orb
