// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Rectifies images by the tables of vision/rectification.hpp: each pixel of the new image is interpolated at its place in the raw one.
///
/// A pixel without a source takes the place of its nearest neighbour that has one: a black wedge would have an edge, and the edge corners
/// that move with the camera. Places are held in 1/32 px, so that the interpolation is whole numbers.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <searvins/core/status.hpp>
#include <searvins/vision/image_view.hpp>
#include <searvins/vision/rectification.hpp>

#include "examples/support/gray_image.hpp"

namespace searvins::orb {

/// The table of one eye.
class Remap {
 public:
  Remap() = default;

  /// From a rectification. Errors: those of Rectification::fill_row; no_data when no pixel of the new image has a source.
  [[nodiscard]] Status build(const vision::Rectification<double>& rectification, vision::Eye eye) {
    const vision::StereoCamera<double>& camera = rectification.camera();
    width_ = camera.width_px;
    height_ = camera.height_px;
    places_.assign(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_), {});
    std::vector<float> u(static_cast<std::size_t>(width_)), v(u.size());
    std::vector<bool> row_has_source(static_cast<std::size_t>(height_), false);
    for (int y = 0; y < height_; ++y) {
      const Result<int> sources = rectification.fill_row(eye, y, u, v);
      if (!sources) return sources.status();
      row_has_source[static_cast<std::size_t>(y)] = *sources > 0;
      if (*sources == 0) continue;
      fill_gaps(u, v);
      for (std::size_t x = 0; x < u.size(); ++x) place(static_cast<int>(x), y) = place_of(u[x], v[x]);
    }
    return fill_rows(row_has_source) ? ok_status()
                                     : failure(StatusCode::no_data, "remap: the rectified image shows nothing of the raw one");
  }

  /// Errors: invalid_argument when the raw image is not of the size that the calibration is of.
  [[nodiscard]] Status apply(const vision::ImageView& raw, examples::GrayImage& out) const {
    if (!raw.valid() || raw.width != width_ || raw.height != height_)
      return failure(StatusCode::invalid_argument, "remap: not the image size that the calibration is of", raw.width, raw.height);
    out.resize(width_, height_);
    for (int y = 0; y < height_; ++y) {
      const Place* row = places_.data() + static_cast<std::ptrdiff_t>(y) * width_;
      std::uint8_t* to = out.row(y);
      for (int x = 0; x < width_; ++x) to[x] = sample(raw, row[x]);
    }
    return ok_status();
  }

 private:
  static constexpr int kOne = 32;
  struct Place {
    std::int16_t x{0}, y{0};          // upper left of four pixels
    std::uint8_t right{0}, below{0};  // weights in 1/32
  };

  [[nodiscard]] static std::uint8_t sample(const vision::ImageView& raw, const Place& p) {
    const std::uint8_t* a = raw.row(p.y) + p.x;
    const std::uint8_t* b = a + raw.stride_bytes;
    const int upper = a[0] * (kOne - p.right) + a[1] * p.right, lower = b[0] * (kOne - p.right) + b[1] * p.right;
    return static_cast<std::uint8_t>((upper * (kOne - p.below) + lower * p.below + kOne * kOne / 2) / (kOne * kOne));
  }

  [[nodiscard]] Place& place(int x, int y) {
    return places_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x)];
  }

  /// The raw image has the size of the new one; the four pixels are kept inside it.
  [[nodiscard]] Place place_of(float u, float v) const {
    const int x = std::clamp(static_cast<int>(u), 0, width_ - 2), y = std::clamp(static_cast<int>(v), 0, height_ - 2);
    const auto weight = [](float part) {
      return static_cast<std::uint8_t>(std::clamp(std::lround(part * kOne), 0L, static_cast<long>(kOne)));
    };
    return {static_cast<std::int16_t>(x), static_cast<std::int16_t>(y), weight(u - static_cast<float>(x)),
            weight(v - static_cast<float>(y))};
  }

  /// Along a row that has a source somewhere: from the left, then what is before the first.
  static void fill_gaps(std::vector<float>& u, std::vector<float>& v) {
    const auto has_source = [&](std::size_t i) { return u[i] != vision::Rectification<double>::kNoSource; };
    std::size_t first = 0;
    while (!has_source(first)) ++first;
    for (std::size_t i = 0; i < first; ++i) u[i] = u[first], v[i] = v[first];
    for (std::size_t i = first + 1; i < u.size(); ++i)
      if (!has_source(i)) u[i] = u[i - 1], v[i] = v[i - 1];
  }

  /// Rows without any source take the nearest above, at the top the first below. False when no row has one.
  [[nodiscard]] bool fill_rows(const std::vector<bool>& has_source) {
    int first = 0;
    while (first < height_ && !has_source[static_cast<std::size_t>(first)]) ++first;
    if (first == height_) return false;
    for (int y = 0; y < first; ++y) copy_row(first, y);
    for (int y = first + 1; y < height_; ++y)
      if (!has_source[static_cast<std::size_t>(y)]) copy_row(y - 1, y);
    return true;
  }
  void copy_row(int from, int to) {
    for (int x = 0; x < width_; ++x) place(x, to) = place(x, from);
  }

  int width_{0}, height_{0};
  std::vector<Place> places_;
};

}  // namespace searvins::orb
