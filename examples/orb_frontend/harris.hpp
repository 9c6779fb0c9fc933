// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Harris' response: how well a place can be found again. FAST likes edges with a kink; this tells them from corners.
///
///     M = sum over a 7 x 7 window of g g',   g = central differences of the grey values
///     response = det M - 0.04 (tr M)^2           [Harris and Stephens, Alvey 1988]
///
/// in (grey value)^4, the same for every level, so that levels can be compared. Its maximum, through parabolas, is where a corner is to a
/// fraction of a pixel.
#pragma once

#include <algorithm>
#include <cstdint>

#include <searvins/vision/image_view.hpp>

namespace searvins::orb {

/// Pixels that the response reaches from its centre.
inline constexpr int kHarrisReach = 4;

/// The response at (x, y), at least kHarrisReach pixels inside the image.
[[nodiscard]] inline float harris_response(const vision::ImageView& image, int x, int y) {
  std::int32_t xx[7] = {}, xy[7] = {}, yy[7] = {};
  for (int dy = -3; dy <= 3; ++dy) {
    const std::uint8_t* row = image.row(y + dy) + x - 3;
    const std::uint8_t *above = row - image.stride_bytes, *below = row + image.stride_bytes;
    for (int i = 0; i < 7; ++i) {
      const int gx = row[i + 1] - row[i - 1], gy = below[i] - above[i];
      xx[i] += gx * gx;
      xy[i] += gx * gy;
      yy[i] += gy * gy;
    }
  }
  std::int32_t sum_xx = 0, sum_xy = 0, sum_yy = 0;  // at most 49 * 255^2
  for (int i = 0; i < 7; ++i) {
    sum_xx += xx[i];
    sum_xy += xy[i];
    sum_yy += yy[i];
  }
  const auto a = static_cast<float>(sum_xx), b = static_cast<float>(sum_xy), c = static_cast<float>(sum_yy);
  return a * c - b * b - 0.04F * (a + c) * (a + c);
}

/// Where the parabola through (-1, before), (0, here), (1, after) has its maximum, held in [-1, 1]; 0 when it has none.
[[nodiscard]] inline float parabola_peak(float before, float here, float after) {
  const float bend = before - 2 * here + after;
  return bend < 0 ? std::clamp((before - after) / (2 * bend), -1.0F, 1.0F) : 0.0F;
}

/// The response at a place and at its four neighbours.
struct HarrisCross {
  float here{0}, left{0}, right{0}, above{0}, below{0};
};

[[nodiscard]] inline HarrisCross harris_cross(const vision::ImageView& image, int x, int y, float here) {
  return {here, harris_response(image, x - 1, y), harris_response(image, x + 1, y), harris_response(image, x, y - 1),
          harris_response(image, x, y + 1)};
}

/// Moves (x, y) uphill to a maximum of the response, at most kClimb whole pixels, and returns the cross there. FAST's greatest contrast
/// often lies a pixel or two from the corner, and not by the same way in every image. kHarrisReach + 1 + kClimb pixels around must lie
/// inside the image.
inline constexpr int kClimb = 3;
[[nodiscard]] inline HarrisCross climb_to_corner(const vision::ImageView& image, int& x, int& y, float response) {
  HarrisCross cross = harris_cross(image, x, y, response);
  for (int step = 0; step < kClimb; ++step) {
    const float best = std::max({cross.left, cross.right, cross.above, cross.below});
    if (!(best > cross.here)) break;
    if (best == cross.left)
      --x;
    else if (best == cross.right)
      ++x;
    else if (best == cross.above)
      --y;
    else
      ++y;
    cross = harris_cross(image, x, y, best);
  }
  return cross;
}

}  // namespace searvins::orb
