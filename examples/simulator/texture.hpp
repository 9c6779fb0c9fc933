// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// A grey pattern that repeats in both directions, with smaller copies of itself for surfaces that are far away or seen at an angle.
///
/// A pixel of the image covers a patch of the pattern; d/du and d/dv of the pattern's coordinates are its sides. The mean over the patch
/// is taken as the mean of n samples along the longer side from copies whose texels are as large as the shorter one:
///
///     n = min(8, longer / shorter)          level = log2(longer / n)          (between two levels: both, weighted)
///
/// Level k holds means over 2^k x 2^k texels, so what is finer than a pixel neither glitters nor moves from frame to frame.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace searvins::simulator {

/// Where a pixel lies in a pattern, in texels, and its sides.
struct TexturePatch {
  float x{0}, y{0};
  float x_u{0}, y_u{0}, x_v{0}, y_v{0};
};

namespace texture_detail {

/// floor, for what fits an int: the library's call takes longer than all the rest of a sample.
[[nodiscard]] inline int floor_of(float x) {
  const int i = static_cast<int>(x);
  return i - (static_cast<float>(i) > x ? 1 : 0);
}

/// log2 of a number >= 1, straight lines between the powers of two (at most 0.09 too small).
[[nodiscard]] inline float rough_log2(float x) {
  const auto bits = std::bit_cast<std::uint32_t>(x);
  return static_cast<float>(static_cast<std::int32_t>(bits) - (127 << 23)) * 0x1p-23F;
}

}  // namespace texture_detail

/// The pattern. Its sides are powers of two.
class Texture {
 public:
  Texture() : Texture(1, 1, std::vector<float>{128.F}) {}
  /// From rows of values in 0..255.
  Texture(int width, int height, const std::vector<float>& values) : Texture(width, height, rounded(values)) {}

  [[nodiscard]] int width() const { return levels_.front().width; }
  [[nodiscard]] int height() const { return levels_.front().height; }

  /// The mean over a patch, of at most so many samples.
  [[nodiscard]] float mean(const TexturePatch& patch, int most_samples = 8) const {
    const float u2 = patch.x_u * patch.x_u + patch.y_u * patch.y_u, v2 = patch.x_v * patch.x_v + patch.y_v * patch.y_v;
    const bool along_u = u2 > v2;
    const float longer = std::sqrt(std::max(along_u ? u2 : v2, 1e-12F)), shorter = std::sqrt(std::max(along_u ? v2 : u2, 1e-12F));
    // A patch that is smaller than a texel needs one sample, however thin it is.
    const int n = longer <= 1 ? 1 : std::clamp(static_cast<int>(longer / std::max(shorter, 1.F) + 0.5F), 1, most_samples);
    const float level = texture_detail::rough_log2(std::max(longer / static_cast<float>(n), 1.F));
    const float part = 1 / static_cast<float>(n);
    Row row{patch.x, patch.y, part * (along_u ? patch.x_u : patch.x_v), part * (along_u ? patch.y_u : patch.y_v), n};
    const float middle = 0.5F * static_cast<float>(n - 1);
    row.x -= middle * row.step_x, row.y -= middle * row.step_y;
    const std::size_t last = levels_.size() - 1, lower = std::min(static_cast<std::size_t>(level), last);
    const float share = level - static_cast<float>(lower), near = part * sum(levels_[lower], row);
    return lower == last || share < 0.02F ? near : near + share * (part * sum(levels_[lower + 1], row) - near);
  }

 private:
  struct Level {
    int width, height;
    float scale;  // 256 of its steps are one of its texels
    std::vector<std::uint8_t> values;
  };
  /// Samples in a row, in texels of level 0.
  struct Row {
    float x, y, step_x, step_y;
    int count;
  };

  Texture(int width, int height, std::vector<std::uint8_t> values) {
    levels_.push_back({width, height, 256, std::move(values)});
    while (levels_.back().width > 1 && levels_.back().height > 1) levels_.push_back(halved(levels_.back()));
  }

  [[nodiscard]] static std::vector<std::uint8_t> rounded(const std::vector<float>& values) {
    std::vector<std::uint8_t> out;
    out.reserve(values.size());
    for (const float v : values) out.push_back(static_cast<std::uint8_t>(std::clamp(v + 0.5F, 0.F, 255.F)));
    return out;
  }

  [[nodiscard]] static Level halved(const Level& fine) {
    Level coarse{fine.width / 2, fine.height / 2, fine.scale / 2, {}};
    for (int y = 0; y < coarse.height; ++y)
      for (int x = 0; x < coarse.width; ++x) {
        const auto i = static_cast<std::size_t>(2 * y * fine.width + 2 * x), below = i + static_cast<std::size_t>(fine.width);
        const int four = fine.values[i] + fine.values[i + 1] + fine.values[below] + fine.values[below + 1];
        coarse.values.push_back(static_cast<std::uint8_t>((four + 2) / 4));
      }
    return coarse;
  }

  /// The sum of samples, interpolated in steps of 1/256 texel; the middle of the first texel is at (0.5, 0.5).
  [[nodiscard]] static float sum(const Level& level, const Row& row) {
    const int columns = level.width - 1, rows = level.height - 1;
    float x = row.x * level.scale, y = row.y * level.scale, total = 0;
    const float step_x = row.step_x * level.scale, step_y = row.step_y * level.scale;
    for (int n = 0; n < row.count; ++n, x += step_x, y += step_y) {
      const int px = texture_detail::floor_of(x) - 128, py = texture_detail::floor_of(y) - 128;
      const int ax = px & 255, ay = py & 255, i = px >> 8, j = py >> 8;
      const int x0 = i & columns, x1 = (i + 1) & columns;
      const std::uint8_t* upper = level.values.data() + static_cast<std::ptrdiff_t>(j & rows) * level.width;
      const std::uint8_t* under = level.values.data() + static_cast<std::ptrdiff_t>((j + 1) & rows) * level.width;
      const int top = (upper[x0] << 8) + ax * (upper[x1] - upper[x0]), bottom = (under[x0] << 8) + ax * (under[x1] - under[x0]);
      total += static_cast<float>((top << 8) + ay * (bottom - top));
    }
    return total * 0x1p-16F;
  }

  std::vector<Level> levels_;
};

}  // namespace searvins::simulator
