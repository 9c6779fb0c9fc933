// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// What annotated pictures are drawn with: a grey image made dark and small, marks on it, and the colours of tracks by age.
///
/// Marks are drawn where they are asked for, to the last one and over each other; what lies outside the picture is left out.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <searvins/vision/image_view.hpp>

#include "examples/support/gray_image.hpp"
#include "examples/support/rgb_image.hpp"

namespace searvins::examples {

inline constexpr int kFullAge = 25;  ///< frames from which on a track has the last colour

/// Colour of a track by the frames it has been seen in: blue (1), green, yellow (kFullAge).
[[nodiscard]] inline Rgb colour_of_age(int age) {
  constexpr std::array<Rgb, 4> kStops{{{70, 110, 255}, {40, 190, 230}, {70, 220, 90}, {255, 225, 40}}};
  const double place = 3.0 * std::clamp(age - 1, 0, kFullAge - 1) / (kFullAge - 1);
  const auto i = std::min<std::size_t>(2, static_cast<std::size_t>(place));
  const auto blend = [part = place - static_cast<double>(i)](std::uint8_t a, std::uint8_t b) {
    return static_cast<std::uint8_t>(std::lround(a + part * (b - a)));
  };
  const Rgb a = kStops[i], b = kStops[i + 1];
  return {blend(a.r, b.r), blend(a.g, b.g), blend(a.b, b.b)};
}

/// A rectangle with its upper left corner at (x, y).
inline void fill(RgbImage& image, int x, int y, int width, int height, Rgb colour) {
  for (int row = y; row < y + height; ++row)
    for (int column = x; column < x + width; ++column) image.set(column, row, colour);
}

/// A circle line, 1.6 px wide.
inline void ring(RgbImage& image, float u, float v, float radius, Rgb colour) {
  const int reach = static_cast<int>(radius) + 2, x = static_cast<int>(std::lround(u)), y = static_cast<int>(std::lround(v));
  for (int dy = -reach; dy <= reach; ++dy)
    for (int dx = -reach; dx <= reach; ++dx) {
      const float from_ring = std::hypot(static_cast<float>(x + dx) - u, static_cast<float>(y + dy) - v) - radius;
      if (std::abs(from_ring) < 0.8F) image.set(x + dx, y + dy, colour);
    }
}

/// Two diagonals through pixel (x, y), `reach` px to either side and 2 px wide.
inline void cross(RgbImage& image, int x, int y, int reach, Rgb colour) {
  for (int d = -reach; d <= reach; ++d)
    for (const int side : {0, 1}) image.set(x + d + side, y + d, colour), image.set(x + d + side, y - d, colour);
}

/// An image of a whole fraction of the size: a pixel is the mean of `factor` x `factor`. What does not fill one is left out.
[[nodiscard]] inline GrayImage reduced(const vision::ImageView& image, int factor) {
  if (!image.valid() || factor < 1) return {};
  GrayImage out(image.width / factor, image.height / factor);
  for (int y = 0; y < out.height(); ++y)
    for (int x = 0; x < out.width(); ++x) {
      int sum = 0;
      for (int dy = 0; dy < factor; ++dy)
        for (int dx = 0; dx < factor; ++dx) sum += image(x * factor + dx, y * factor + dy);
      out(x, y) = static_cast<std::uint8_t>((sum + factor * factor / 2) / (factor * factor));
    }
  return out;
}

/// The image at `percent` of its brightness to draw on, with black rows below it.
[[nodiscard]] inline RgbImage darkened(const vision::ImageView& image, int percent, int rows_below = 0) {
  if (!image.valid()) return {};
  RgbImage out(image.width, image.height + rows_below);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const auto grey = static_cast<std::uint8_t>(image(x, y) * percent / 100);
      out.set(x, y, {grey, grey, grey});
    }
  return out;
}

}  // namespace searvins::examples
