// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The features of one image: corners of every level, spread over the image, each with an orientation and a descriptor.
///
///     image -> pyramid -> FAST-9 -> Harris ranking -> grid -> place to a fraction of a pixel, orientation -> smoothed level -> BRIEF
///
/// Levels share the wanted number by the inverse of their scale; what one cannot give, the next ones may. Where a level has too few corners
/// at the threshold it is searched again at the lower one.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

#include <searvins/vision/image_view.hpp>

#include "examples/orb_frontend/brief.hpp"
#include "examples/orb_frontend/fast.hpp"
#include "examples/orb_frontend/grid_selection.hpp"
#include "examples/orb_frontend/harris.hpp"
#include "examples/orb_frontend/orientation.hpp"
#include "examples/orb_frontend/pyramid.hpp"
#include "examples/orb_frontend/smoothing.hpp"

namespace searvins::orb {

/// A corner that can be recognised.
struct Feature {
  float u_px{0}, v_px{0};  ///< place in the full image
  int level{0};
  int x{0}, y{0};  ///< whole pixels on the level
  float angle_rad{0};
  float response{0};
  Descriptor descriptor{};
};

/// What is looked for.
struct ExtractorOptions {
  std::size_t features{500};
  int levels{3};
  float scale_factor{1.25F};
  int fast_threshold{10};     ///< grey values
  int fast_threshold_low{5};  ///< for levels that have too few corners at the first
};

/// Finds features; memory is kept from image to image.
class Extractor {
 public:
  explicit Extractor(const ExtractorOptions& options = {}) : options_(options) {}

  /// Replaces `out` by the features of the image, level by level, the best first within a level. The image must live as long as the pyramid
  /// is used.
  void extract(const vision::ImageView& image, std::vector<Feature>& out) {
    out.clear();
    pyramid_.build(image, options_.levels, options_.scale_factor);
    selector_.begin_image(image.width, image.height);
    double weight = 0;
    for (int l = 0; l < pyramid_.levels(); ++l) weight += 1 / static_cast<double>(pyramid_.scale(l));
    for (int l = 0; l < pyramid_.levels(); ++l) {
      const double own = 1 / static_cast<double>(pyramid_.scale(l));
      const std::size_t missing = options_.features - std::min(options_.features, out.size());
      const auto wanted = static_cast<std::size_t>(static_cast<double>(missing) * own / weight + 0.5);
      weight -= own;
      extract_level(l, std::min(wanted, missing), out);
    }
  }

  [[nodiscard]] const Pyramid& pyramid() const { return pyramid_; }
  [[nodiscard]] const ExtractorOptions& options() const { return options_; }

  /// Pixels of a level along its edges where no corner is looked for: the disc of the orientation and a column more, from wherever it is
  /// moved to.
  static constexpr int kBorder = kDiscRadius + 2 + kClimb;
  static constexpr std::size_t kFew = 2,
                               kMany = 8;  ///< corners for each that is wanted: fewer call for the lower threshold, more are not ranked
  static_assert(kBorder >= kBriefReach + kClimb && kBorder > kHarrisReach + 1 + kClimb);

 private:
  void extract_level(int l, std::size_t wanted, std::vector<Feature>& out) {
    if (wanted == 0) return;
    const vision::ImageView& image = pyramid_.level(l);
    find_corners(image, options_.fast_threshold);
    if (corners_.size() < kFew * wanted && options_.fast_threshold_low < options_.fast_threshold)
      find_corners(image, options_.fast_threshold_low);
    keep_strongest(kMany * wanted);
    for (Corner& corner : corners_) corner.response = harris_response(image, corner.x, corner.y);
    selector_.select(image, pyramid_.scale(l), corners_, wanted, chosen_);
    if (chosen_.empty()) return;
    smoother_.smooth(image, smooth_);
    for (const Corner& corner : chosen_) out.push_back(feature_of(corner, image, l));
  }

  void find_corners(const vision::ImageView& image, int threshold) {
    corners_.clear();
    detector_.detect(image, threshold, kBorder, corners_);
  }

  /// Leaves the corners of the highest contrasts: there is no end of corners in a picture of gravel.
  void keep_strongest(std::size_t count) {
    if (corners_.size() <= count) return;
    const auto end = corners_.begin() + static_cast<std::ptrdiff_t>(count);
    std::nth_element(corners_.begin(), end, corners_.end(), [](const Corner& a, const Corner& b) {
      if (a.contrast != b.contrast) return a.contrast > b.contrast;
      return a.y != b.y ? a.y < b.y : a.x < b.x;
    });
    corners_.erase(end, corners_.end());
  }

  [[nodiscard]] Feature feature_of(const Corner& corner, const vision::ImageView& image, int l) const {
    const float scale = pyramid_.scale(l);
    Feature feature;
    feature.u_px = to_full_image(static_cast<float>(corner.x) + corner.dx_px, scale);
    feature.v_px = to_full_image(static_cast<float>(corner.y) + corner.dy_px, scale);
    feature.level = l;
    feature.x = corner.x;
    feature.y = corner.y;
    feature.angle_rad = orientation_rad(image, corner.x, corner.y);
    feature.response = corner.response;
    feature.descriptor = brief_.describe(smooth_.view(), corner.x, corner.y, feature.angle_rad);
    return feature;
  }

  ExtractorOptions options_;
  Pyramid pyramid_;
  FastDetector detector_;
  GridSelector selector_;
  Smoother smoother_;
  Brief brief_;
  examples::GrayImage smooth_;
  std::vector<Corner> corners_, chosen_;
};

}  // namespace searvins::orb
