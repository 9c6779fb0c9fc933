// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Where a patch of one image lies in another, to a fraction of a pixel: corners are found to whole pixels, and a disparity that is off by
/// half a pixel is a depth that is off by a tenth.
///
/// Cost of a displacement (dx, dy), over a window of 16 x 11 pixels with n pixels, d = left - right:
///
///     cost = sum d^2 - (sum d)^2 / n          the mean is taken out: two cameras are rarely exposed alike
///
/// The least cost within +-kReach whole pixels along the row is taken, then the minimum of the parabola through it and its neighbours, and
/// likewise one row up and down. A minimum at the end of the search is none. Compared with the patch's own contrast (its cost against a
/// grey wall) the cost says whether the two show the same.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include <searvins/vision/image_view.hpp>

#include "examples/orb_frontend/harris.hpp"

namespace searvins::orb {

/// Result of an alignment, in pixels of the images given.
struct Alignment {
  bool found{false};
  float x{0}, y{0};   ///< place in the right image that corresponds to the centre in the left one
  float mismatch{0};  ///< cost over the patch's contrast: 0 identical, about 2 unrelated
};

namespace detail {

inline constexpr int kPatchLeft = 8, kPatchWidth = 16, kPatchUp = 5, kPatchHeight = 11;
inline constexpr int kReach = 4;

/// The cost above; both windows must lie inside their images.
[[nodiscard]] inline float patch_cost(const vision::ImageView& left, int xl, int yl, const vision::ImageView& right, int xr, int yr) {
  std::int32_t sum = 0, squares = 0;
  for (int row = -kPatchUp; row < kPatchHeight - kPatchUp; ++row) {
    const std::uint8_t* a = left.row(yl + row) + xl - kPatchLeft;
    const std::uint8_t* b = right.row(yr + row) + xr - kPatchLeft;
    for (int i = 0; i < kPatchWidth; ++i) {
      const auto d = static_cast<std::int16_t>(a[i] - b[i]);
      sum += d;
      squares += d * d;
    }
  }
  const auto mean_part = static_cast<float>(sum) * static_cast<float>(sum) / static_cast<float>(kPatchWidth * kPatchHeight);
  return static_cast<float>(squares) - mean_part;
}

/// Cost of a patch against a grey wall: n times its variance.
[[nodiscard]] inline float patch_contrast(const vision::ImageView& image, int x, int y) {
  std::int32_t sum = 0, squares = 0;
  for (int row = -kPatchUp; row < kPatchHeight - kPatchUp; ++row) {
    const std::uint8_t* a = image.row(y + row) + x - kPatchLeft;
    for (int i = 0; i < kPatchWidth; ++i) {
      sum += a[i];
      squares += a[i] * a[i];
    }
  }
  return static_cast<float>(squares) - static_cast<float>(sum) * static_cast<float>(sum) / static_cast<float>(kPatchWidth * kPatchHeight);
}

[[nodiscard]] inline bool patch_fits(const vision::ImageView& image, int x, int y, int margin) {
  return x - kPatchLeft - margin >= 0 && x - kPatchLeft + kPatchWidth + margin <= image.width && y - kPatchUp - 1 >= 0 &&
         y - kPatchUp + kPatchHeight + 1 <= image.height;
}

}  // namespace detail

/// Finds the patch around (xl, yl) of `left` near (xr, yl) of `right`: along the row for disparity, one row up and down for what
/// rectification left over.
[[nodiscard]] inline Alignment align_on_row(const vision::ImageView& left, int xl, int yl, const vision::ImageView& right, int xr) {
  using detail::kReach;
  if (!detail::patch_fits(left, xl, yl, 0) || !detail::patch_fits(right, xr, yl, kReach)) return {};
  std::array<float, 2 * kReach + 1> cost;
  for (int dx = -kReach; dx <= kReach; ++dx)
    cost[static_cast<std::size_t>(dx + kReach)] = detail::patch_cost(left, xl, yl, right, xr + dx, yl);
  const auto best = static_cast<std::size_t>(std::min_element(cost.begin(), cost.end()) - cost.begin());
  if (best == 0 || best + 1 == cost.size()) return {};
  const int x = xr + static_cast<int>(best) - kReach;
  const float above = detail::patch_cost(left, xl, yl, right, x, yl - 1), below = detail::patch_cost(left, xl, yl, right, x, yl + 1);
  Alignment found{true, static_cast<float>(x), static_cast<float>(yl), 0};
  found.x += parabola_peak(-cost[best - 1], -cost[best], -cost[best + 1]);
  found.y += parabola_peak(-above, -cost[best], -below);
  found.mismatch = cost[best] / std::max(detail::patch_contrast(left, xl, yl), 1.0F);
  return found;
}

}  // namespace searvins::orb
