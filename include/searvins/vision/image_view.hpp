// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// A look at an 8-bit grey image that somebody else owns: a camera driver's buffer, a decoded file, a crop of either.
///
///     pixel (x, y)  =  pixels[y stride_bytes + x]        x to the right 0 .. width - 1, y down 0 .. height - 1
///
/// The centre of the upper left pixel is (0, 0): a position of (10.25, 3) px lies a quarter of a pixel to the right of a centre.
#pragma once

#include <cstddef>
#include <cstdint>

namespace searvins::vision {

/// See the file comment. Copies are cheap and shallow; the pixels must outlive every view.
struct ImageView {
  const std::uint8_t* pixels{nullptr};  ///< upper left pixel; nullptr: no image
  int width{0}, height{0};              ///< px
  int stride_bytes{0};                  ///< from a pixel to the one below, at least width

  /// True when there is something to look at: pixels, a positive size and a stride that holds a row.
  [[nodiscard]] constexpr bool valid() const { return pixels != nullptr && width > 0 && height > 0 && stride_bytes >= width; }

  [[nodiscard]] constexpr bool contains(int x, int y) const { return x >= 0 && y >= 0 && x < width && y < height; }

  /// First pixel of row y, 0 <= y < height.
  [[nodiscard]] constexpr const std::uint8_t* row(int y) const {
    return pixels + static_cast<std::ptrdiff_t>(y) * static_cast<std::ptrdiff_t>(stride_bytes);
  }

  /// Grey value; contains(x, y) must hold.
  [[nodiscard]] constexpr std::uint8_t operator()(int x, int y) const { return row(y)[x]; }

  /// The part of width w and height h with its upper left corner at (x, y); empty when it does not lie inside.
  [[nodiscard]] constexpr ImageView crop(int x, int y, int w, int h) const {
    if (!valid() || x < 0 || y < 0 || w <= 0 || h <= 0 || w > width - x || h > height - y) return {};
    return {row(y) + x, w, h, stride_bytes};
  }
};

/// A view of pixels that follow each other without gaps.
[[nodiscard]] constexpr ImageView packed_image(const std::uint8_t* pixels, int width, int height) { return {pixels, width, height, width}; }

}  // namespace searvins::vision
