// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Features by place: which ones lie in a rectangle of the image. What makes matching cheap is not comparing fast but comparing few.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "examples/orb_frontend/extractor.hpp"

namespace searvins::orb {

/// Cells of given size over the full image, each with the numbers of its features in rising order; memory is kept from image to image.
class FeatureIndex {
 public:
  /// Cells of cell_width x cell_height px; a cell as wide as the image makes an index of rows.
  void build(const std::vector<Feature>& features, int width, int height, int cell_width, int cell_height) {
    cell_width_ = std::max(cell_width, 1);
    cell_height_ = std::max(cell_height, 1);
    columns_ = std::max(1, (width + cell_width_ - 1) / cell_width_);
    rows_ = std::max(1, (height + cell_height_ - 1) / cell_height_);
    begin_.assign(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_) + 1, 0);
    for (const Feature& f : features) ++begin_[cell_of(f) + 1];
    for (std::size_t c = 1; c < begin_.size(); ++c) begin_[c] += begin_[c - 1];
    next_ = begin_;
    members_.resize(features.size());
    for (std::size_t i = 0; i < features.size(); ++i) members_[next_[cell_of(features[i])]++] = static_cast<std::uint32_t>(i);
  }

  /// Calls use(i) for the features of every cell that the rectangle touches: a few outside it are among them.
  template <class Use>
  void for_each_near(float u_min, float u_max, float v_min, float v_max, Use use) const {
    const int left = column(u_min), right = column(u_max), top = row(v_min), bottom = row(v_max);
    for (int r = top; r <= bottom; ++r) {
      const std::size_t first = begin_[at(left, r)], end = begin_[at(right, r) + 1];  // cells of a row follow each other
      for (std::size_t k = first; k < end; ++k) use(static_cast<std::size_t>(members_[k]));
    }
  }

 private:
  [[nodiscard]] int column(float u) const { return std::clamp(static_cast<int>(u) / cell_width_, 0, columns_ - 1); }
  [[nodiscard]] int row(float v) const { return std::clamp(static_cast<int>(v) / cell_height_, 0, rows_ - 1); }
  [[nodiscard]] std::size_t at(int c, int r) const {
    return static_cast<std::size_t>(r) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(c);
  }
  [[nodiscard]] std::size_t cell_of(const Feature& f) const { return at(column(f.u_px), row(f.v_px)); }

  int cell_width_{1}, cell_height_{1}, columns_{1}, rows_{1};
  std::vector<std::size_t> begin_{0, 0}, next_;
  std::vector<std::uint32_t> members_;
};

}  // namespace searvins::orb
