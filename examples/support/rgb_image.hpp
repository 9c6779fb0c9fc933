// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// An 8-bit colour image to draw on: what a report shows.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "examples/support/gray_image.hpp"

namespace searvins::examples {

/// A colour.
struct Rgb {
  std::uint8_t r{0}, g{0}, b{0};
  [[nodiscard]] bool operator==(const Rgb&) const = default;
};

/// Pixels row by row without gaps, three bytes each.
class RgbImage {
 public:
  RgbImage() = default;
  RgbImage(int width_px, int height_px)
      : width_(width_px > 0 ? width_px : 0),
        height_(height_px > 0 ? height_px : 0),
        bytes_(3 * static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_)) {}
  /// A grey image to draw on in colour.
  explicit RgbImage(const GrayImage& grey) : RgbImage(grey.width(), grey.height()) {
    for (std::size_t i = 0; i < bytes_.size(); ++i) bytes_[i] = grey.pixels()[i / 3];
  }

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  [[nodiscard]] const std::vector<std::uint8_t>& bytes() const { return bytes_; }

  [[nodiscard]] Rgb operator()(int x, int y) const {
    const std::size_t i = index(x, y);
    return {bytes_[i], bytes_[i + 1], bytes_[i + 2]};
  }
  /// Sets a pixel; outside the image nothing happens.
  void set(int x, int y, Rgb colour) {
    if (x < 0 || y < 0 || x >= width_ || y >= height_) return;
    const std::size_t i = index(x, y);
    bytes_[i] = colour.r, bytes_[i + 1] = colour.g, bytes_[i + 2] = colour.b;
  }

 private:
  [[nodiscard]] std::size_t index(int x, int y) const {
    return 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x));
  }

  int width_{0}, height_{0};
  std::vector<std::uint8_t> bytes_;
};

}  // namespace searvins::examples
