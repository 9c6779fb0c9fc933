// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The low-pass filter before BRIEF: single pixels are too noisy to be compared.
///
/// The kernel is a triangle over seven pixels in each axis, [1 2 3 4 3 2 1] / 16 (sigma 1.58 px), because that is two steps of averages:
///
///     [1 2 1] / 4  *  [1 0 2 0 1] / 4,      [1 2 1] / 4 = mean(mean(x-1, x+1), x)
///
/// and the mean of two bytes, rounded up, is one instruction on sixteen of them wherever there are vectors. Rounding up lifts the image by
/// about one grey value everywhere; comparisons do not see that. The outermost three pixels are not smoothed in the axis that lacks
/// neighbours.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include <searvins/vision/image_view.hpp>

#include "examples/support/gray_image.hpp"

namespace searvins::orb {

/// Smooths images; memory is kept from call to call.
class Smoother {
 public:
  /// `out` gets the size of `in`.
  void smooth(const vision::ImageView& in, examples::GrayImage& out) {
    out.resize(in.width, in.height);
    half_.resize(in.width, in.height);
    row_.resize(static_cast<std::size_t>(in.width));
    for (int y = 0; y < in.height; ++y) {
      average<1>(in.row(y), in.width, row_.data());
      average<2>(row_.data(), in.width, out.row(y));
    }
    average_columns<1>(out, half_);
    average_columns<2>(half_, out);
  }

 private:
  [[nodiscard]] static std::uint8_t mean(std::uint8_t a, std::uint8_t b) { return static_cast<std::uint8_t>((a + b + 1) / 2); }

  /// Along a row: neighbours at +-kReach.
  template <int kReach>
  static void average(const std::uint8_t* in, int width, std::uint8_t* out) {
    for (int x = 0; x < kReach && x < width; ++x) out[x] = in[x];
    for (int x = kReach; x < width - kReach; ++x) out[x] = mean(mean(in[x - kReach], in[x + kReach]), in[x]);
    for (int x = width - kReach < 0 ? 0 : width - kReach; x < width; ++x) out[x] = in[x];
  }

  /// Across rows: neighbours kReach rows above and below.
  template <int kReach>
  static void average_columns(const examples::GrayImage& in, examples::GrayImage& out) {
    const int width = in.width(), height = in.height();
    for (int y = 0; y < height; ++y) {
      std::uint8_t* to = out.row(y);
      const std::uint8_t* centre = in.row(y);
      if (y < kReach || y >= height - kReach) {
        std::memcpy(to, centre, static_cast<std::size_t>(width));
        continue;
      }
      const std::uint8_t *above = in.row(y - kReach), *below = in.row(y + kReach);
      for (int x = 0; x < width; ++x) to[x] = mean(mean(above[x], below[x]), centre[x]);
    }
  }

  examples::GrayImage half_;
  std::vector<std::uint8_t> row_;
};

}  // namespace searvins::orb
