// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The same image at falling sizes, so that a corner found from near is found from far.
///
/// Level l is smaller by s_l = factor^l. Pixel centres are at whole numbers and the outer edges of the levels coincide, so
///
///     x_0 + 1/2 = s_l (x_l + 1/2)
///
/// in both axes. A level is interpolated bilinearly from the one above it. For factors well below 2 that needs no low-pass filter of its
/// own.
///
/// Each row is blended vertically first, which the compiler vectorises, and then sampled horizontally through a table of places and
/// weights.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <searvins/vision/image_view.hpp>

#include "examples/support/gray_image.hpp"

namespace searvins::orb {

/// From a coordinate on a level of scale s to the full image.
[[nodiscard]] constexpr float to_full_image(float x, float scale) { return (x + 0.5F) * scale - 0.5F; }
/// From a coordinate in the full image to a level of scale s.
[[nodiscard]] constexpr float to_level(float x, float scale) { return (x + 0.5F) / scale - 0.5F; }

/// Bilinear reduction by a step of 1 to 2; memory is kept from call to call.
class Reducer {
 public:
  /// out(x, y) = in((x + 1/2) step - 1/2, ...), clamped at the edges. `out` has the size wanted.
  void reduce(const vision::ImageView& in, float step, examples::GrayImage& out) {
    make_columns(in.width, step, out.width());
    row_.resize(static_cast<std::size_t>(in.width) + 1);
    for (int y = 0; y < out.height(); ++y) {
      const Place at = place(y, step, in.height);
      blend_rows(in.row(at.index), in.row(std::min(at.index + 1, in.height - 1)), at.weight, in.width);
      sample_row(out.row(y), out.width());
    }
  }

 private:
  static constexpr int kOne = 128;  // weights in 1/128: products of pixels and weights stay below 2^15
  struct Place {
    std::uint16_t index{0};
    std::uint8_t weight{0};  // of the pixel after index
  };

  [[nodiscard]] static Place place(int i, float step, int size) {
    const float x = std::clamp(to_full_image(static_cast<float>(i), step), 0.0F, static_cast<float>(size - 1));
    const int index = static_cast<int>(x);
    return {static_cast<std::uint16_t>(index), static_cast<std::uint8_t>(std::lround((x - static_cast<float>(index)) * kOne))};
  }

  void make_columns(int in_width, float step, int out_width) {
    columns_.resize(static_cast<std::size_t>(out_width));
    for (int x = 0; x < out_width; ++x) columns_[static_cast<std::size_t>(x)] = place(x, step, in_width);
  }

  void blend_rows(const std::uint8_t* above, const std::uint8_t* below, int weight, int width) {
    std::uint8_t* row = row_.data();
    const auto w1 = static_cast<std::uint16_t>(weight), w0 = static_cast<std::uint16_t>(kOne - weight);
    for (int x = 0; x < width; ++x) {
      const auto sum = static_cast<std::uint16_t>(above[x] * w0 + below[x] * w1 + kOne / 2);
      row[x] = static_cast<std::uint8_t>(sum / kOne);
    }
    row[width] = row[width - 1];
  }

  void sample_row(std::uint8_t* out, int width) const {
    const std::uint8_t* row = row_.data();
    for (int x = 0; x < width; ++x) {
      const Place at = columns_[static_cast<std::size_t>(x)];
      const int a = row[at.index], b = row[at.index + 1];
      out[x] = static_cast<std::uint8_t>((a * (kOne - at.weight) + b * at.weight + kOne / 2) / kOne);
    }
  }

  std::vector<Place> columns_;
  std::vector<std::uint8_t> row_;
};

/// Up to kMaxLevels levels. Level 0 is a view of the image given to build(), which must live as long as the levels are used.
class Pyramid {
 public:
  static constexpr int kMaxLevels = 8;
  static constexpr int kMinSize = 64;  ///< px; a level that would be smaller in either axis is left out

  /// Makes the levels. `factor` is held in 1.05 .. 2, `levels` in 1 .. kMaxLevels.
  void build(const vision::ImageView& image, int levels, float factor) {
    levels = std::clamp(levels, 1, kMaxLevels);
    factor = std::clamp(factor, 1.05F, 2.0F);
    views_[0] = image;
    scales_[0] = 1;
    for (count_ = 1; count_ < levels; ++count_) {
      const auto l = static_cast<std::size_t>(count_);
      scales_[l] = scales_[l - 1] * factor;
      const int width = static_cast<int>(static_cast<float>(image.width) / scales_[l]);
      const int height = static_cast<int>(static_cast<float>(image.height) / scales_[l]);
      if (width < kMinSize || height < kMinSize) return;
      images_[l].resize(width, height);
      reducer_.reduce(views_[l - 1], factor, images_[l]);
      views_[l] = images_[l].view();
    }
  }

  [[nodiscard]] int levels() const { return count_; }
  [[nodiscard]] const vision::ImageView& level(int l) const { return views_[static_cast<std::size_t>(l)]; }
  /// Pixels of the full image per pixel of the level.
  [[nodiscard]] float scale(int l) const { return scales_[static_cast<std::size_t>(l)]; }

 private:
  int count_{0};
  std::array<vision::ImageView, kMaxLevels> views_{};
  std::array<float, kMaxLevels> scales_{};
  std::array<examples::GrayImage, kMaxLevels> images_;  // images_[0] stays empty
  Reducer reducer_;
};

}  // namespace searvins::orb
