// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// FAST-9: a pixel is a corner when nine neighbours in a row, on a circle of sixteen, are all brighter or all darker than it.
///
///     contrast c(p) = max over the 16 arcs of 9 of   max( min (n - p), min (p - n) )       n on the arc, circle of radius 3
///     corner at threshold t  <=>  c > t
///
/// [Rosten and Drummond, ECCV 2006]. Nearly all pixels are turned down by a bound that needs no arcs: an arc of nine on a circle of sixteen
/// holds at least one of every two opposite pixels, so
///
///     c <= max( min over k of max(n_k, n_k+8) - p,   p - max over k of min(n_k, n_k+8) )
///
/// which is byte minima and maxima alone, sixteen pixels an instruction. The contrasts of what is left are computed sixteen at a time, and
/// a corner must have the greatest contrast among its eight neighbours (of equals, the first in reading order).
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>
#include <vector>

#include <searvins/vision/image_view.hpp>

namespace searvins::orb {

/// A corner at whole pixels of its level.
struct Corner {
  int x{0}, y{0};
  int contrast{0};           ///< grey values, > threshold
  float response{0};         ///< for ranking, set by harris.hpp
  float dx_px{0}, dy_px{0};  ///< from (x, y) to the corner, once it is known to a fraction of a pixel
};

namespace detail {

struct CirclePoint {
  int x, y;
};

/// Around the circle; k and k + 8 are opposite.
inline constexpr std::array<CirclePoint, 16> kCircle{{{0, -3},
                                                      {1, -3},
                                                      {2, -2},
                                                      {3, -1},
                                                      {3, 0},
                                                      {3, 1},
                                                      {2, 2},
                                                      {1, 3},
                                                      {0, 3},
                                                      {-1, 3},
                                                      {-2, 2},
                                                      {-3, 1},
                                                      {-3, 0},
                                                      {-3, -1},
                                                      {-2, -2},
                                                      {-1, -3}}};

// By value: std::min and std::max return references, and loops over those are not vectorised.
[[nodiscard]] constexpr std::uint8_t lesser(std::uint8_t a, std::uint8_t b) { return a < b ? a : b; }
[[nodiscard]] constexpr std::uint8_t greater(std::uint8_t a, std::uint8_t b) { return a < b ? b : a; }

/// Contrasts of sixteen pixels at once: the circles side by side, so that each step of the search for arcs is one instruction on sixteen
/// bytes.
class ContrastBatch {
 public:
  static constexpr std::size_t kLanes = 16;

  [[nodiscard]] bool full() const { return count_ == kLanes; }
  [[nodiscard]] std::size_t size() const { return count_; }
  [[nodiscard]] int x(std::size_t lane) const { return x_[lane]; }
  void clear() { count_ = 0; }

  /// For images of this stride; empties the batch.
  void begin(int stride_bytes) {
    for (std::size_t k = 0; k < 16; ++k) offset_[k] = kCircle[k].y * static_cast<std::ptrdiff_t>(stride_bytes) + kCircle[k].x;
    count_ = 0;
  }

  /// Takes a pixel, at column x of its row, into the next lane.
  void add(const std::uint8_t* pixel, int x) {
    const std::size_t lane = count_++;
    x_[lane] = x;
    centre_[lane] = *pixel;
    for (std::size_t k = 0; k < 16; ++k) ring_[k * kLanes + lane] = pixel[offset_[k]];
  }

  /// max(c, 0) of every lane in use.
  void contrasts(std::array<std::uint8_t, kLanes>& out) {
    std::memcpy(ring_.data() + 16 * kLanes, ring_.data(), 8 * kLanes);
    std::array<std::uint8_t, kLanes> highest, lowest;
    best_arc<lesser, greater>(highest);
    best_arc<greater, lesser>(lowest);
    for (std::size_t i = 0; i < kLanes; ++i) {
      const std::uint8_t p = centre_[i];
      out[i] = static_cast<std::uint8_t>(
          greater(static_cast<std::uint8_t>(greater(highest[i], p) - p), static_cast<std::uint8_t>(p - lesser(lowest[i], p))));
    }
  }

 private:
  static constexpr std::size_t kRows = 24;  // the circle, and its first half again: no arc runs over the end
  using Ring = std::array<std::uint8_t, kRows * kLanes>;
  using Pick = std::uint8_t (*)(std::uint8_t, std::uint8_t);

  /// kAcross over the arcs of what kAlong gives along an arc of nine: 2, 4, 8 and one more.
  template <Pick kAlong, Pick kAcross>
  void best_arc(std::array<std::uint8_t, kLanes>& best) const {
    Ring of2, of4, of9;
    for (std::size_t i = 0; i < 22 * kLanes; ++i) of2[i] = kAlong(ring_[i], ring_[i + kLanes]);
    for (std::size_t i = 0; i < 20 * kLanes; ++i) of4[i] = kAlong(of2[i], of2[i + 2 * kLanes]);
    for (std::size_t i = 0; i < 16 * kLanes; ++i) of9[i] = kAlong(kAlong(of4[i], of4[i + 4 * kLanes]), ring_[i + 8 * kLanes]);
    for (std::size_t i = 0; i < kLanes; ++i) best[i] = of9[i];
    for (std::size_t k = 1; k < 16; ++k)
      for (std::size_t i = 0; i < kLanes; ++i) best[i] = kAcross(best[i], of9[k * kLanes + i]);
  }

  Ring ring_{};
  std::array<std::uint8_t, kLanes> centre_{};
  std::array<int, kLanes> x_{};
  std::array<std::ptrdiff_t, 16> offset_{};
  std::size_t count_{0};
};

}  // namespace detail

/// Finds the corners of an image; memory is kept from call to call.
class FastDetector {
 public:
  static constexpr int kRadius = 3;
  static constexpr int kMinWidth = 40;  ///< px; narrower images have no corners

  /// Appends the corners with contrast > threshold (0 .. 254) at least `border` (>= 4) pixels from every edge, row by row.
  void detect(const vision::ImageView& image, int threshold, int border, std::vector<Corner>& out) {
    border = std::max(border, kRadius + 1);
    if (image.width < std::max(2 * border + 1, kMinWidth) || image.height < 2 * border + 1) return;
    batch_.begin(image.stride_bytes);
    for (Row& row : rows_) row.reset(image.width);
    // One pixel of margin: a corner at the border is compared with neighbours outside it.
    for (int y = border - 1; y <= image.height - border; ++y) {
      Row& row = rows_[static_cast<std::size_t>(y % 3)];
      row.clear();
      find_in_row(image, y, border - 1, image.width - border + 1, threshold, row);
      if (y > border) keep_maxima(y - 1, border, image.width - border, out);
    }
  }

 private:
  static constexpr int kBlock = 32;  // pixels whose bounds are computed at once
  struct Row {
    std::vector<std::uint8_t> contrast;  // 0 where there is no corner
    std::vector<int> places;             // x of the corners, rising
    void reset(int width) {
      contrast.assign(static_cast<std::size_t>(width), 0);
      places.clear();
    }
    void clear() {
      for (const int x : places) contrast[static_cast<std::size_t>(x)] = 0;
      places.clear();
    }
  };
  using Bounds = std::array<std::uint8_t, kBlock>;

  /// How far the bound exceeds the threshold, 0 where it does not, for kBlock pixels from (x, y) on.
  static void bound_block(const vision::ImageView& image, int x, int y, std::uint8_t threshold, Bounds& excess) {
    std::array<const std::uint8_t*, 16> n;
    for (std::size_t k = 0; k < 16; ++k) n[k] = image.row(y + detail::kCircle[k].y) + x + detail::kCircle[k].x;
    bound_block(image.row(y) + x, n, threshold, excess, std::make_index_sequence<7>{});
  }

  /// The loop over pixels is the only one, its body straight: that is what g++ and clang++ turn into vector instructions.
  template <std::size_t... kPairs>
  static void bound_block(const std::uint8_t* centre, const std::array<const std::uint8_t*, 16>& n, std::uint8_t threshold, Bounds& excess,
                          std::index_sequence<kPairs...>) {
    using detail::greater, detail::lesser;
    Bounds result;
    for (std::size_t i = 0; i < kBlock; ++i) {
      std::uint8_t least = greater(n[0][i], n[8][i]), most = lesser(n[0][i], n[8][i]);
      ((least = lesser(least, greater(n[kPairs + 1][i], n[kPairs + 9][i])),
        most = greater(most, lesser(n[kPairs + 1][i], n[kPairs + 9][i]))),
       ...);
      const std::uint8_t p = centre[i];
      const auto brighter = static_cast<std::uint8_t>(greater(least, p) - p);
      const auto darker = static_cast<std::uint8_t>(p - lesser(most, p));
      result[i] = static_cast<std::uint8_t>(greater(greater(brighter, darker), threshold) - threshold);
    }
    excess = result;
  }

  void find_in_row(const vision::ImageView& image, int y, int begin, int end, int threshold, Row& row) {
    Bounds excess;
    for (int x = begin; x < end; x += kBlock) {
      // The last block reaches back instead of over the edge.
      const int start = std::min(x, image.width - kRadius - kBlock);
      bound_block(image, start, y, static_cast<std::uint8_t>(threshold), excess);
      for (int i = 0; i < kBlock; i += 8) {
        std::uint64_t eight = 0;
        std::memcpy(&eight, excess.data() + i, sizeof eight);
        if (eight == 0) continue;
        for (int k = std::max(i, x - start); k < i + 8 && start + k < end; ++k)
          if (excess[static_cast<std::size_t>(k)] != 0) consider(image.row(y) + start + k, start + k, threshold, row);
      }
    }
    settle(threshold, row);
  }

  void consider(const std::uint8_t* pixel, int x, int threshold, Row& row) {
    batch_.add(pixel, x);
    if (batch_.full()) settle(threshold, row);
  }

  /// Keeps the corners among the pixels considered.
  void settle(int threshold, Row& row) {
    std::array<std::uint8_t, detail::ContrastBatch::kLanes> contrast;
    batch_.contrasts(contrast);
    for (std::size_t i = 0; i < batch_.size(); ++i) {
      if (contrast[i] <= threshold) continue;
      row.contrast[static_cast<std::size_t>(batch_.x(i))] = contrast[i];
      row.places.push_back(batch_.x(i));
    }
    batch_.clear();
  }

  /// Corners of row y, once the rows above and below are known.
  void keep_maxima(int y, int begin, int end, std::vector<Corner>& out) const {
    const Row& row = rows_[static_cast<std::size_t>(y % 3)];
    const std::uint8_t* above = rows_[static_cast<std::size_t>((y + 2) % 3)].contrast.data();
    const std::uint8_t* here = row.contrast.data();
    const std::uint8_t* below = rows_[static_cast<std::size_t>((y + 1) % 3)].contrast.data();
    for (const int x : row.places) {
      if (x < begin || x >= end) continue;
      const std::uint8_t c = here[x];
      const bool first = c > above[x - 1] && c > above[x] && c > above[x + 1] && c > here[x - 1];
      if (first && c >= here[x + 1] && c >= below[x - 1] && c >= below[x] && c >= below[x + 1]) out.push_back({x, y, c});
    }
  }

  std::array<Row, 3> rows_;
  detail::ContrastBatch batch_;
};

}  // namespace searvins::orb
