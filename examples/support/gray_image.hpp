// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// An 8-bit grey image that owns its pixels: what readers return, renderers fill and frontends work on. Everything else takes the
/// vision::ImageView that view() gives.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <searvins/vision/image_view.hpp>

namespace searvins::examples {

/// Pixels row by row without gaps. A width or height of 0 is no image.
class GrayImage {
 public:
  GrayImage() = default;
  GrayImage(int width_px, int height_px, std::uint8_t value = 0) {
    resize(width_px, height_px);
    for (std::uint8_t& pixel : pixels_) pixel = value;
  }

  /// New size; the content is unspecified afterwards. Negative sizes count as 0.
  void resize(int width_px, int height_px) {
    width_ = width_px > 0 ? width_px : 0;
    height_ = height_px > 0 ? height_px : 0;
    pixels_.resize(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  }

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  [[nodiscard]] bool empty() const { return pixels_.empty(); }
  [[nodiscard]] std::vector<std::uint8_t>& pixels() { return pixels_; }
  [[nodiscard]] const std::vector<std::uint8_t>& pixels() const { return pixels_; }

  [[nodiscard]] std::uint8_t* row(int y) { return pixels_.data() + static_cast<std::ptrdiff_t>(y) * width_; }
  [[nodiscard]] const std::uint8_t* row(int y) const { return pixels_.data() + static_cast<std::ptrdiff_t>(y) * width_; }
  [[nodiscard]] std::uint8_t& operator()(int x, int y) { return row(y)[x]; }
  [[nodiscard]] std::uint8_t operator()(int x, int y) const { return row(y)[x]; }

  /// A look at it; good until the next resize.
  [[nodiscard]] vision::ImageView view() const {
    return empty() ? vision::ImageView{} : vision::packed_image(pixels_.data(), width_, height_);
  }

 private:
  int width_{0}, height_{0};
  std::vector<std::uint8_t> pixels_;
};

}  // namespace searvins::examples
