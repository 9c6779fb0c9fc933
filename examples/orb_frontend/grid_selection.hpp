// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The best corners, but not all in one place: geometry needs them all over the image, and each of them once.
///
/// The image is divided into square cells. Going down the ranking, a corner is taken while its cell has taken fewer than its share; what is
/// then missing is filled with the best of the others. The share is `kCrowding` times that of an even distribution, because an even one
/// would take corners from the sky that nobody finds again.
///
/// A corner is found on several levels, and a rough one twice on the same. Whatever lies within some pixels of a corner taken before, on
/// whichever level, is left out: it would take a place, be tracked as a second point that is none, and contest the first one's partner in
/// the right image.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <searvins/vision/image_view.hpp>

#include "examples/orb_frontend/fast.hpp"
#include "examples/orb_frontend/harris.hpp"
#include "examples/orb_frontend/pyramid.hpp"

namespace searvins::orb {

/// Chooses corners of an image, level by level; memory is kept from call to call.
class GridSelector {
 public:
  static constexpr int kCell = 48;        ///< px of the level
  static constexpr double kCrowding = 2;  ///< share of a cell over that of an even distribution
  static constexpr int kSpot = 3;         ///< px of the full image: corners keep a distance of at least kSpot, at most 2 kSpot

  /// A new image of this size.
  void begin_image(int width, int height) {
    spot_columns_ = static_cast<std::size_t>(width / kSpot) + 3;  // one spot of margin on every side
    is_taken_.assign(spot_columns_ * (static_cast<std::size_t>(height / kSpot) + 3), 0);
  }

  /// The `wanted` best of the `corners` of a level of this scale (all, when there are no more) that are not taken, those within the shares
  /// first, each part best first; equal responses go in reading order. Each is moved to its place to a fraction of a pixel. `corners` is
  /// sorted on the way.
  void select(const vision::ImageView& level, float scale, std::vector<Corner>& corners, std::size_t wanted, std::vector<Corner>& out) {
    out.clear();
    std::sort(corners.begin(), corners.end(), is_before);
    const std::size_t columns = cells(level.width), rows = cells(level.height);
    const double even = static_cast<double>(wanted) / static_cast<double>(columns * rows);
    const auto share = static_cast<std::size_t>(kCrowding * even) + 1;
    count_.assign(columns * rows, 0);
    left_over_.clear();
    for (const Corner& corner : corners) {
      if (out.size() >= wanted) return;
      std::size_t& count = count_[cell_of(corner, columns)];
      if (count >= share)
        left_over_.push_back(corner);
      else if (take(level, scale, corner, out))
        ++count;
    }
    for (const Corner& corner : left_over_) {
      if (out.size() >= wanted) return;
      take(level, scale, corner, out);
    }
  }

 private:
  [[nodiscard]] static bool is_before(const Corner& a, const Corner& b) {
    if (a.response != b.response) return a.response > b.response;
    return a.y != b.y ? a.y < b.y : a.x < b.x;
  }
  [[nodiscard]] static std::size_t cells(int size) { return static_cast<std::size_t>((size + kCell - 1) / kCell); }
  [[nodiscard]] static std::size_t cell_of(const Corner& corner, std::size_t columns) {
    return static_cast<std::size_t>(corner.y / kCell) * columns + static_cast<std::size_t>(corner.x / kCell);
  }

  bool take(const vision::ImageView& level, float scale, Corner corner, std::vector<Corner>& out) {
    if (is_near_taken(corner, scale)) return false;
    const HarrisCross cross = climb_to_corner(level, corner.x, corner.y, corner.response);
    if (is_near_taken(corner, scale)) return false;
    is_taken_[spot_of(corner, scale)] = 1;
    corner.response = cross.here;
    corner.dx_px = parabola_peak(cross.left, cross.here, cross.right);
    corner.dy_px = parabola_peak(cross.above, cross.here, cross.below);
    out.push_back(corner);
    return true;
  }

  [[nodiscard]] std::size_t spot_of(const Corner& corner, float scale) const {
    const auto spot = [scale](int x) {
      return static_cast<std::size_t>(std::max(0.0F, to_full_image(static_cast<float>(x), scale))) / kSpot + 1;
    };
    return spot(corner.y) * spot_columns_ + spot(corner.x);
  }

  /// Whether the corner's spot or one of the eight around it is taken.
  [[nodiscard]] bool is_near_taken(const Corner& corner, float scale) const {
    const std::size_t centre = spot_of(corner, scale);
    for (std::size_t row = centre - spot_columns_; row <= centre + spot_columns_; row += spot_columns_)
      for (std::size_t i = row - 1; i <= row + 1; ++i)
        if (is_taken_[i] != 0) return true;
    return false;
  }

  std::size_t spot_columns_{0};
  std::vector<std::uint8_t> is_taken_;
  std::vector<std::size_t> count_;
  std::vector<Corner> left_over_;
};

}  // namespace searvins::orb
